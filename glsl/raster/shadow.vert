// Brings every vertex of the scene to the sun's clip space.
// Reads: the vertex buffer (m, in the world or a moving object's own space), where moving objects are, sun_view_proj.
// Writes: what shadow.frag interpolates.
// Method: shadow mapping (Williams 1978), orthographic for a sun.
#include "shared/objects.glsl"

uniform mat4 sun_view_proj;

in vec3 position;
in uint material;
#if ALPHA_MASKED
in vec2 uv;
out vec2 v_uv;
flat out uint v_material;
#endif

void main() {
    gl_Position = sun_view_proj * vec4(to_world(object_of(material), position), 1.0);
#if ALPHA_MASKED
    v_uv = uv;
    v_material = material_of(material);
#endif
}
