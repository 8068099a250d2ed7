// What kinds of tiles the post-process tells apart, each drawn by a kernel that holds no more than it needs, over a
// list of its own. For the passes that fill and follow those lists, and for app/frame/post.py, which names them in this
// order.
// Method: tile classification with indirect dispatch (Jimenez 2014, slide 91, has two classes).
#include "dof/layers.glsl"

const uint SHARP = 0u;   // nothing blurred reaches it: the raster image stays as it is
const uint SLIGHT = 1u;  // blur that full resolution draws, and no other
const uint NEAR = 2u;    // near blur reaches it; nothing in it is blurred far beyond focus
const uint FAR = 3u;     // far blur, and no near blur
const uint MIXED = 4u;   // both

// The block with their lists (list_tile.glsl, listed_tile.glsl), and how many kinds there are.
#define LIST TileWork
#define CLASSES 5

// `reach`: most negative and largest CoC that reaches the tile, full-res px.
uint tile_class(vec2 reach) {
    if (max(-reach.x, reach.y) <= IN_FOCUS_COC_PX) return SHARP;
    if (max(-reach.x, reach.y) <= HALF_RES_BEGIN_PX) return SLIGHT;
    if (reach.y <= HALF_RES_BEGIN_PX) return NEAR;
    return -reach.x <= HALF_RES_BEGIN_PX ? FAR : MIXED;
}
