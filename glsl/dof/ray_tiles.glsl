// The block that lists tiles by whether rays may be called for in them or next to them (ray_tiles.comp), and its kinds,
// as app/frame/mask.py numbers them.
#define LIST RayTiles
#define CLASSES 2
#define NO_RAYS 0
#define RAYS 1
