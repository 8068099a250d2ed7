// Finds what a ray hits in the scene.
// Reads: BvhNodes, TrianglePositions, Triangles (app/bvh/pack.py; positions in m); define BVH_STACK = the entries that
//   a walk down the tree needs. With OBJECTS there is a tree for each moving object, in its own space, and a small one
//   over all of them in the first nodes (app/bvh/top.py): define TOP_STACK = the entries for that.
// Writes: nothing.
// Method: ordered traversal of a four-child BVH on grids with a stack: descend until a leaf is found, then test its
//   triangles ("while-while": Aila and Laine 2009, "Understanding the efficiency of ray traversal on GPUs", section 3;
//   nodes: Ylitie, Karras and Laine 2017, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs").
//   All loops test at their end: a SIMD rasteriser goes once more through the body of a loop that tests at its start.
//
// With HAS_ALPHA_MASK the including shader defines `alpha_passes`: whether a ray stops at this point of a material. A
// ray that meets a hole sets out again from there: a mask costs a texture and a dozen fetches, and is asked once for
// each closest hit, not for every triangle that might become it. A software rasteriser, which skips no branch, would
// pay for it with every triangle of the scene that it tests: passes that trace took 1.4 to 1.7 times as long.
#include "shared/records.glsl"
#include "shared/objects.glsl"
#include "lib/intersect.glsl"

#ifdef HAS_ALPHA_MASK
bool alpha_passes(uint material, uvec3 vertices, vec2 barycentrics, float t);
#endif

RECORDS(BvhNodes, BvhNode, nodes, node_at)
RECORDS(TrianglePositions, vec4, triangle_positions, corner_at)  // 3 a triangle, leaf order; w of the first: its turn
RECORDS(Triangles, uvec4, triangles, triangle_at)                // leaf order: 3 vertices, material

struct Hit {
    float t;            // in lengths of the ray's direction
    float turn;         // grows in the order of drawing (app/bvh/pack.py)
    uint triangle;      // place in leaf order
    uvec3 vertices;
    uint material;
    uint object;        // 0: what stands still
    vec2 barycentrics;  // weights of the second and third vertex
};

const uint LEAF_BIT = 0x80000000u;
const uint FIRST_MASK = 0x0fffffffu;
const float LAST_PLANE = 255.0;  // of a node's grid
const uint NO_NODE = 0xffffffffu;  // the reference of a missing child, and the end of a walk
const uint NO_TRIANGLE = 0xffffffffu;
const int MISSED = 0x7f800000;  // an infinite distance's bits; those of all others are less, as signed integers

// References to what walks will look at later. An object's tree is walked on top of what waits of the top level.
#if OBJECTS
uint stack[BVH_STACK + TOP_STACK];
#else
uint stack[BVH_STACK];
#endif
int top = 0;

vec3 grid_steps(BvhNode node) {
    return vec3(node.step_x, node.step_y, node.step_z);
}

RaySetup prepare_ray_for_tree(uint first, Ray ray) {
    BvhNode root = node_at(first);
    return prepare_ray(ray, root.origin, root.origin + LAST_PLANE * grid_steps(root));
}

// The nearest child that the ray may hit between t_min and t_max; the others wait on the stack, the nearest on top. If
// there is none, what waited there.
uint nearest_child(uint node, RaySetup setup, float t_min, float t_max) {
    BvhNode n = node_at(node);
    vec4 enter = intersect_boxes(setup, n.origin, grid_steps(n), n.low, n.high, t_min, t_max);
    enter = mix(enter, vec4(INFINITY), equal(n.child, uvec4(NO_NODE)));
    // The last two bits of each distance say whose it is. Three rounds of exchanges sort the four.
    ivec4 key = floatBitsToInt(enter) & ~3 | ivec4(0, 1, 2, 3);
    key = ivec4(min(key.xz, key.yw), max(key.xz, key.yw));
    key = ivec4(min(key.xz, key.yw), max(key.xz, key.yw));
    key.yz = ivec2(min(key.y, key.z), max(key.y, key.z));
    for (int i = 3; i > 0; --i) {  // written always, kept by moving `top`: no branch
        stack[top] = n.child[key[i] & 3];
        top += int(key[i] < MISSED);
    }
    return key.x < MISSED ? n.child[key.x & 3] : stack[--top];
}

// The first leaf on the way from a node or leaf on, or NO_NODE.
uint next_leaf(uint node, RaySetup setup, float t_min, float t_max) {
    do {
        if (node < LEAF_BIT) node = nearest_child(node, setup, t_min, t_max);
    } while (node < LEAF_BIT);
    return node;
}

// Tests the triangles of a leaf; keeps the closest hit, of equally close ones the first drawn, as the raster's depth
// test does: duplicates then look the same in all views, whatever the tree. At t_min itself, turns up to `after` do not
// count.
void intersect_leaf(uint leaf, RaySetup setup, Ray ray, float after, inout Hit hit) {
    uint i = leaf & FIRST_MASK, end = i + ((leaf >> 28) & 7u) + 1u;
    do {
        vec4 a = corner_at(3u * i);
        vec3 b = corner_at(3u * i + 1u).xyz;
        vec3 c = corner_at(3u * i + 2u).xyz;
        float t;
        vec2 barycentrics;
        bool found = intersect_triangle(setup, ray.origin, a.xyz, b, c, ray.t_min, hit.t, t, barycentrics);
        if (found && !(t == hit.t && a.w > hit.turn || t == ray.t_min && a.w <= after)) {
            hit.t = t;
            hit.turn = a.w;
            hit.triangle = i;
            hit.barycentrics = barycentrics;
        }
    } while (++i < end);
}

// Walks the tree that begins at node `first`; keeps what is closer than `hit`.
// `any_hit` is a constant at each call: the compiler makes two functions of this one.
void traverse_tree(uint first, Ray ray, float after, const bool any_hit, inout Hit hit) {
    RaySetup setup = prepare_ray_for_tree(first, ray);
    int bottom = top;
    stack[top++] = NO_NODE;
    uint node = first;
    do {
        node = next_leaf(node, setup, ray.t_min, hit.t);
        if (node == NO_NODE) break;
        intersect_leaf(node, setup, ray, after, hit);
        node = any_hit && hit.triangle != NO_TRIANGLE ? NO_NODE : stack[--top];
    } while (node != NO_NODE);
    top = bottom;
}

#if OBJECTS
// The same ray in an object's own space. Not a unit direction: t stays what it was. Subtracting first keeps the error
// in proportion to the way from the object, however far both are from the world's origin.
Ray ray_from_world(Object object, Ray ray) {
    mat3 linear = mat3(object.from_world);
    return Ray(linear * (ray.origin - object.to_world[3].xyz), linear * ray.direction, ray.t_min);
}

// A rotation into an object's space moves a ray by up to 16 roundings of its reach: five on each term of the origin,
// four on each of the direction, times sqrt(3) for the sum of a row. The margin that boxes have already, 15 roundings,
// grows to hold both.
const float TRANSFORM_GROWTH = 3.0;

// Walks the top level as `traverse_tree` does a tree; its leaves are objects, whose trees are walked in turn.
void traverse_objects(Ray ray, float after, const bool any_hit, inout Hit hit) {
    RaySetup setup = prepare_ray_for_tree(0u, ray);
    setup.origin_near = ray.origin + TRANSFORM_GROWTH * (setup.origin_near - ray.origin);
    setup.origin_far = ray.origin + TRANSFORM_GROWTH * (setup.origin_far - ray.origin);
    stack[top++] = NO_NODE;
    uint node = 0u;
    do {
        node = next_leaf(node, setup, ray.t_min, hit.t);
        if (node == NO_NODE) break;
        Object object = object_at(node & FIRST_MASK);
        traverse_tree(object.root, ray_from_world(object, ray), after, any_hit, hit);
        node = any_hit && hit.triangle != NO_TRIANGLE ? NO_NODE : stack[--top];
    } while (node != NO_NODE);
    top = 0;
}
#endif

bool traverse(Ray ray, float after, float t_max, const bool any_hit, out Hit hit) {
    hit.t = t_max;
    hit.turn = INFINITY;
    hit.triangle = NO_TRIANGLE;
    hit.barycentrics = vec2(0.0);
#if OBJECTS
    traverse_objects(ray, after, any_hit, hit);
#else
    traverse_tree(0u, ray, after, any_hit, hit);
#endif
    return hit.triangle != NO_TRIANGLE;
}

// The closest hit with t_min <= t <= t_max.
bool trace_closest(Ray ray, float t_max, out Hit hit) {
    float after = 0.0;
    bool found, hole = false;
    do {
        found = traverse(ray, after, t_max, false, hit);
        if (!found) break;
        uvec4 triangle = triangle_at(hit.triangle);
        hit.vertices = triangle.xyz;
        hit.material = material_of(triangle.w);
        hit.object = object_of(triangle.w);
#ifdef HAS_ALPHA_MASK
        hole = !alpha_passes(hit.material, hit.vertices, hit.barycentrics, hit.t);
        ray.t_min = hit.t;
        after = hit.turn;
#endif
    } while (hole);
    return found;
}

// Whether anything lies at t_min <= t <= t_max.
bool trace_any(Ray ray, float t_max) {
    Hit hit;
#ifdef HAS_ALPHA_MASK
    return trace_closest(ray, t_max, hit);  // holes can only be passed in the order in which the ray meets them
#else
    return traverse(ray, 0.0, t_max, true, hit);
#endif
}
