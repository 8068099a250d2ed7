// Tiles: the squares that work is listed by.

const float TILE_PX = 16.0;  // full-resolution px a side

// Tiles along x and y of a picture of `size` px.
ivec2 tile_count(vec2 size) {
    return ivec2(ceil(size / TILE_PX));
}
