// The block that lists the tiles in which edges are looked for (edge_tiles.comp), all of one kind.
#define LIST EdgeTiles
#define CLASSES 1
#define TILE_CLASS 0
