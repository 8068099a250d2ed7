// How far the ray mask has to look from a tile of 8x8 half-res (16x16 full-res) pixels.

// The most negative CoC [px] that reaches a tile or its neighbours, whose margins an edge's reach may cross.
float tile_near_coc(sampler2D tiles_dilated, ivec2 tile) {
    ivec2 last = textureSize(tiles_dilated, 0) - 1;
    float lowest = 0.0;
    for (int i = 0; i < 9; i++) {
        lowest = min(lowest, texelFetch(tiles_dilated, clamp(tile + ivec2(i % 3, i / 3) - 1, ivec2(0), last), 0).x);
    }
    return lowest;
}
