// The block that lists tiles by whether rays may be called for in them or next to them (ray_tiles.comp), and its kinds,
// as app/frame/hybrid.py numbers them.
#define LIST RayTiles
#define CLASSES 2
const uint NO_RAYS = 0u;
const uint RAYS = 1u;
