// Where moving objects are and were: from the space that an object's vertices are kept in to the world, and back in
// time. Object 0 is all that stands still. Without OBJECTS nothing moves, and every function here returns what it was
// given. A vertex's material word holds the object in its upper 8 bits (app/gpu/arrays.py).
#include "shared/records.glsl"

#if OBJECTS
RECORDS(Objects, Object, objects, object_at)

const uint OBJECT_SHIFT = 24u;

uint object_of(uint word) {
    return word >> OBJECT_SHIFT;
}

uint material_of(uint word) {
    return word & ((1u << OBJECT_SHIFT) - 1u);
}

vec3 to_world(uint object, vec3 position) {
    return (object_at(object).to_world * vec4(position, 1.0)).xyz;
}

// Normals go by the inverse transpose, whatever the scale; the length is not kept.
vec3 normal_to_world(uint object, vec3 normal) {
    return normal * mat3(object_at(object).from_world);
}

vec4 tangent_to_world(uint object, vec4 tangent) {
    return vec4(mat3(object_at(object).to_world) * tangent.xyz, tangent.w);
}

// Where a point of the world was one frame ago [m].
vec3 previous_position(uint object, vec3 position) {
    return (object_at(object).to_previous * vec4(position, 1.0)).xyz;
}
#else
uint object_of(uint word) { return 0u; }
uint material_of(uint word) { return word; }
vec3 to_world(uint object, vec3 position) { return position; }
vec3 normal_to_world(uint object, vec3 normal) { return normal; }
vec4 tangent_to_world(uint object, vec4 tangent) { return tangent; }
vec3 previous_position(uint object, vec3 position) { return position; }
#endif
