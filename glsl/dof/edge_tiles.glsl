// The block that lists the tiles in which edges are looked for (edge_tiles.comp): one kind, 0.
#define LIST EdgeTiles
#define CLASSES 1
