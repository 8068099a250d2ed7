// What a ray sees: the nearest surface, read and shaded exactly as the raster path does it, or the sky.
// Reads: the scene's blocks and textures, the ray-tracing tree.
#include "shared/primary.glsl"
#include "shared/objects.glsl"
#include "shared/surface.glsl"
#include "shared/shade.glsl"
#include "lib/coc.glsl"
#if ALPHA_MASKED
#define HAS_ALPHA_MASK
#endif
#include "rays/traverse.glsl"

// The attributes of a triangle's three vertices, weighted.
vec3 weights_of(vec2 barycentrics) {
    return vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
}

vec2 vertex_uv(uint i) {
    Vertex vertex = vertex_at(i);
    return vec2(vertex.u, vertex.v);
}

// In the world.
vec3 vertex_position(uint i) {
    Vertex vertex = vertex_at(i);
    return to_world(object_of(vertex.material), vec3(vertex.px, vertex.py, vertex.pz));
}

vec2 uv_at(uvec3 v, vec3 w) {
    return w.x * vertex_uv(v.x) + w.y * vertex_uv(v.y) + w.z * vertex_uv(v.z);
}

// One pixel at planar depth z in units of uv: the level-of-detail rule of shared/surface.glsl.
float uv_footprint(uvec3 v, float z) {
    vec2 du = vertex_uv(v.y) - vertex_uv(v.x), dv = vertex_uv(v.z) - vertex_uv(v.x);
    vec3 origin = vertex_position(v.x);
    float world_area = length(cross(vertex_position(v.y) - origin, vertex_position(v.z) - origin));
    return sqrt(abs(du.x * dv.y - du.y * dv.x) / max(world_area, 1e-30)) * pixel_footprint(z);
}

#if ALPHA_MASKED
bool alpha_passes(uint material, uvec3 v, vec2 barycentrics, float z) {
    if (material_at(material).alpha_cutoff == 0.0) return true;
    return alpha_passes(material, uv_at(v, weights_of(barycentrics)), uv_footprint(v, z));
}
#endif

Surface surface_of_hit(Hit hit, Ray ray) {
    uvec3 v = hit.vertices;
    vec3 w = weights_of(hit.barycentrics);
    vec3 a = vertex_position(v.x);
    vec3 facing = cross(vertex_position(v.y) - a, vertex_position(v.z) - a);
    float side = dot(facing, ray.direction) <= 0.0 ? 1.0 : -1.0;  // counter-clockwise: the front, as in the rasteriser
    vec2 uv = vec2(0.0);
    vec4 tangent = vec4(0.0);
    vec3 normal = vec3(0.0);
    float footprint = 0.0;
#if TEXTURED
    uv = uv_at(v, w);
    footprint = uv_footprint(v, hit.t);
#endif
#if LIT
    for (int i = 0; i < 3; i++) normal += w[i] * unpack_normal(vertex_at(v[i]).normal);
    normal = normal_to_world(hit.object, normal);
#endif
#if NORMAL_MAPPED
    for (int i = 0; i < 3; i++) tangent += w[i] * unpack_tangent(vertex_at(v[i]).tangent);
    tangent = tangent_to_world(hit.object, tangent);
#endif
    return surface_at(hit.material, ray.origin + hit.t * ray.direction, side, normal, tangent, uv, footprint);
}

// Radiance along a lens ray (alpha: luminance of its specular part), and the planar depth [m], world position [m] and
// moving object (0: what stands still, or the sky) it came from.
vec4 radiance(Ray ray, out float planar_depth, out vec3 position, out uint object) {
    Hit hit;
    object = 0u;
    if (!trace_closest(ray, SKY_DEPTH, hit)) {
        planar_depth = SKY_DEPTH;
        position = ray.origin + SKY_DEPTH * ray.direction;
        return vec4(sky_radiance(normalize(ray.direction)), 0.0);
    }
    planar_depth = hit.t;
    object = hit.object;
    position = ray.origin + hit.t * ray.direction;
    return shade(surface_of_hit(hit, ray), -normalize(ray.direction));
}
