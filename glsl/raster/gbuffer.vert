// Brings every vertex of the scene to this frame's jittered clip space.
// Reads: the vertex buffer (m, in the world or a moving object's own space), where moving objects are.
// Writes: what gbuffer.frag interpolates.
// Method: the projection of app/camera.py; in the raster reference sheared about the focal plane (Haeberli and Akeley
// 1990).
#include "shared/frame.glsl"
#include "shared/objects.glsl"
#include "lib/octahedral.glsl"

in vec3 position;
in uint normal;
in uint material;
out vec3 v_normal;
flat out uint v_material;
#if OBJECTS
flat out uint v_object;
#endif
#if TEXTURED
in vec2 uv;
out vec2 v_uv;
#endif
#if NORMAL_MAPPED
in uint tangent;
out vec4 v_tangent;
#endif

void main() {
    uint object = object_of(material);
    gl_Position = frame.view_proj * vec4(to_world(object, position), 1.0);
    v_normal = normal_to_world(object, unpack_normal(normal));
    v_material = material_of(material);
#if OBJECTS
    v_object = object;
#endif
#if TEXTURED
    v_uv = uv;
#endif
#if NORMAL_MAPPED
    v_tangent = tangent_to_world(object, unpack_tangent(tangent));
#endif
}
