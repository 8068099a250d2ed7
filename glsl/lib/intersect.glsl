// Rays against boxes and triangles, without holes.
// Method: triangle test of Woop, Benthin and Wald 2013, "Watertight ray/triangle intersection" (JCGT 2:1), sections 3
//         and 4; slab test of Ize 2013, "Robust BVH ray traversal" (JCGT 2:2), section 3, for boxes on a grid (Ylitie,
//         Karras and Laine 2017, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs").
// `precise` keeps the compiler from fusing or reordering: an edge shared by two triangles must get exactly opposite
// edge functions from both sides, or a ray could slip between them.

struct Ray {
    vec3 origin;     // m
    vec3 direction;  // t counts in its length, which may be 1e-6 to 1e6
    float t_min;     // hits at t < t_min are ignored
};

// What all tests of one ray share.
struct RaySetup {
    vec3 inverse;      // 1 / direction, finite
    bvec3 backward;    // where it is negative: the ray meets a box's high plane first
    vec3 origin_near;  // origin moved beyond every rounding error, towards a box for the plane that is met first ...
    vec3 origin_far;   // ... and back for the other
    vec3 shear_x;      // rows of the shear that maps the ray to the z axis: two permuted axes ...
    vec3 shear_y;
    vec3 shear_z;      // ... and the distance along the ray
};

const float ROUNDING = 5.9604645e-8;  // 2^-24, the largest relative error of one float32 operation
const float SLAB_GROWTH = 1.0 + 2.0 * 3.0 * ROUNDING;  // 1 + 2 gamma_3: Ize 2013
const float SMALLEST_RATIO = 1e-18;  // of direction components; a coordinate (< 1e12 m) over it stays finite
const float TRIANGLE_ERROR = 5.0 * ROUNDING;  // of a sheared coordinate, relative to its terms: Woop 2013, section 4
const float GRID_ERROR = 5.0 * ROUNDING;  // of a box's plane, relative to the reach: see intersect_boxes
const float INFINITY = uintBitsToFloat(0x7f800000u);

float away_from_zero(float x, float smallest) { return abs(x) < smallest ? (x < 0.0 ? -smallest : smallest) : x; }

// `lo` and `hi` bound all geometry [m]: the farther it is from the origin, the more the triangle test rounds.
RaySetup prepare_ray(Ray ray, vec3 lo, vec3 hi) {
    RaySetup setup;
    vec3 d = ray.direction;
    float longest = max(abs(d.x), max(abs(d.y), abs(d.z)));
    float smallest = longest * SMALLEST_RATIO;
    vec3 finite = vec3(away_from_zero(d.x, smallest), away_from_zero(d.y, smallest), away_from_zero(d.z, smallest));
    setup.inverse = 1.0 / finite;
    vec3 reach = max(abs(lo - ray.origin), abs(hi - ray.origin));
    // The last term keeps the sum with a far origin from rounding the margin away.
    float largest = max(reach.x, max(reach.y, reach.z));
    vec3 margin = (2.0 * TRIANGLE_ERROR + GRID_ERROR) * largest + ROUNDING * abs(ray.origin);
    setup.backward = lessThan(setup.inverse, vec3(0.0));
    vec3 towards = mix(margin, -margin, setup.backward);
    setup.origin_near = ray.origin + towards;
    setup.origin_far = ray.origin - towards;
    // The longest axis of the direction becomes z. Entries 0 and 1 are exact, so each product below is one rounding.
    if (abs(d.z) == longest) {
        setup.shear_x = vec3(1.0, 0.0, -d.x / d.z);
        setup.shear_y = vec3(0.0, 1.0, -d.y / d.z);
        setup.shear_z = vec3(0.0, 0.0, 1.0 / d.z);
    } else if (abs(d.y) == longest) {
        setup.shear_x = vec3(0.0, -d.z / d.y, 1.0);
        setup.shear_y = vec3(1.0, -d.x / d.y, 0.0);
        setup.shear_z = vec3(0.0, 1.0 / d.y, 0.0);
    } else {
        setup.shear_x = vec3(-d.y / d.x, 1.0, 0.0);
        setup.shear_y = vec3(-d.z / d.x, 0.0, 1.0);
        setup.shear_z = vec3(1.0 / d.x, 0.0, 0.0);
    }
    return setup;
}

// Four bytes as numbers, the lowest first.
vec4 bytes(uint word) {
    return vec4(uvec4(word, word >> 8, word >> 16, word >> 24) & 0xffu);
}

// Entry distances of a node's four boxes; +infinity where missed. Their planes lie on a grid: `low` and `high` hold a
// byte for each box, along x, y and z, that counts steps [m] from the grid's origin [m] (app/bvh/pack.py).
//
// A plane at origin + n step is met at n (step / d) + (origin - o) / d. The grid is exact, and a power of two scales
// without rounding. Rounded are, each once: 1 / d and the sum, both relative to t, which SLAB_GROWTH holds; origin - o
// and its product, relative to |origin - o|, and the n-fold, relative to |n step|. The reach is to the corners of the
// root's grid, and thus at least 127 steps; no node has longer ones, and none of its planes is beyond the geometry by
// more than one. So |origin - o| < 1.01 reach, and |n step|, the way between two planes, < 2.02 reach: in all, this
// moves a plane by less than 4.1 roundings of the reach. GRID_ERROR is more.
vec4 intersect_boxes(RaySetup ray, vec3 origin, vec3 steps, uvec3 low, uvec3 high, float t_min, float t_max) {
    uvec3 near = uvec3(
        ray.backward.x ? high.x : low.x, ray.backward.y ? high.y : low.y, ray.backward.z ? high.z : low.z
    );
    uvec3 far = low ^ high ^ near;  // the other of the two
    vec3 pace = steps * ray.inverse;
    vec3 first_near = (origin - ray.origin_near) * ray.inverse, first_far = (origin - ray.origin_far) * ray.inverse;
    vec4 enter_x = bytes(near.x) * pace.x + first_near.x, leave_x = bytes(far.x) * pace.x + first_far.x;
    vec4 enter_y = bytes(near.y) * pace.y + first_near.y, leave_y = bytes(far.y) * pace.y + first_far.y;
    vec4 enter_z = bytes(near.z) * pace.z + first_near.z, leave_z = bytes(far.z) * pace.z + first_far.z;
    vec4 enter = max(max(enter_x, enter_y), max(enter_z, vec4(t_min)));
    vec4 leave = min(min(leave_x, leave_y), min(leave_z, vec4(t_max)));
    return mix(vec4(INFINITY), enter, lessThanEqual(enter, leave * SLAB_GROWTH));
}

// What rounding took from the product ab = a * b, exactly (Dekker 1971: halves of 12 bits multiply without rounding).
float product_error(float a, float b, float ab) {
    precise float a_scaled = a * 4097.0, b_scaled = b * 4097.0;  // 2^12 + 1
    precise float a_high = a_scaled - (a_scaled - a), b_high = b_scaled - (b_scaled - b);
    precise float a_low = a - a_high, b_low = b - b_high;
    precise float error = ((a_high * b_high - ab) + a_high * b_low + a_low * b_high) + a_low * b_low;
    return error;
}

// a.x b.y - a.y b.x: positive, zero or negative as the exact value is. Where both products round to the same number
// their errors decide; the paper recomputes in double precision there, which is slow or missing on many GPUs.
float edge_function(vec2 a, vec2 b) {
    precise float p = a.x * b.y;
    precise float q = a.y * b.x;
    precise float area = p - q;
    return area != 0.0 ? area : product_error(a.x, b.y, p) - product_error(a.y, b.x, q);
}

vec3 to_ray_space(RaySetup ray, vec3 v) {
    precise float x = dot(ray.shear_x, v);
    precise float y = dot(ray.shear_y, v);
    precise float z = dot(ray.shear_z, v);
    return vec3(x, y, z);
}

// The ray's hit with triangle (a, b, c) [m], both sides: true, the distance and the weights of b and c. The distance is
// the same to the last bit if b and c change places: sums of three begin with those two.
bool intersect_triangle(
    RaySetup ray, vec3 origin, vec3 a, vec3 b, vec3 c, float t_min, float t_max, out float t, out vec2 barycentrics
) {
    vec3 p = to_ray_space(ray, a - origin), q = to_ray_space(ray, b - origin), r = to_ray_space(ray, c - origin);
    float u = edge_function(r.xy, q.xy), v = edge_function(p.xy, r.xy), w = edge_function(q.xy, p.xy);
    float lowest = min(u, min(v, w)), highest = max(u, max(v, w));
    precise float determinant = u + (v + w);
    precise float weighted = u * p.z + (v * q.z + w * r.z);
    float inverse = 1.0 / determinant;
    t = weighted * inverse;
    barycentrics = vec2(v, w) * inverse;
    // Zeros count as inside. A NaN or infinite t (edge-on, determinant 0) fails the comparison.
    return (lowest >= 0.0 || highest <= 0.0) && determinant != 0.0 && t >= t_min && t <= t_max;
}
