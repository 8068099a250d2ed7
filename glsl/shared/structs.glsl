// Made by `python -m app.gpu.layout` from the dtypes there; do not edit.

struct Vertex {  // 32 bytes
    float px;  // @0  position in the world or, of a moving object, in its own space, m
    float py;  // @4
    float pz;  // @8
    uint normal;  // @12  octahedral, snorm16x2
    float u;  // @16  texture coordinate, v downwards
    float v;  // @20
    uint tangent;  // @24  octahedral, snorm16x2; lowest bit of the high half: handedness is -1
    uint material;  // @28  index into the materials; bits 24..: the moving object's, 0 if it stands still
};

struct Material {  // 192 bytes
    vec4 base_color;  // @0  linear factor; alpha multiplies the texture's
    vec3 emissive;  // @16  linear radiance factor, strength included
    float alpha_cutoff;  // @28  texels below are holes; 0: opaque
    float metallic;  // @32  factor
    float roughness;  // @36  factor, perceptual
    float normal_scale;  // @40  of the tangent-space xy
    float unused;  // @44  padding
    uvec4 textures;  // @48  base colour, metallic-roughness, normal, emissive: texture: size class in bits 24.., layer in bits 0..15, wrap u and v in bits 16..17 and 18..19; NO_TEXTURE if none
    vec4 uv_base_u;  // @64  row of the base colour's uv transform: u' = dot(xyz, (u, v, 1))
    vec4 uv_base_v;  // @80  v'
    vec4 uv_surface_u;  // @96  the same for metallic-roughness
    vec4 uv_surface_v;  // @112
    vec4 uv_normal_u;  // @128  the same for the normal map
    vec4 uv_normal_v;  // @144
    vec4 uv_emissive_u;  // @160  the same for emissive
    vec4 uv_emissive_v;  // @176
};

struct Light {  // 64 bytes
    vec3 position;  // @0  world, m; unused for a sun
    uint kind;  // @12  0 sun, 1 point, 2 spot
    vec3 direction;  // @16  unit, world, the way the light travels
    float inverse_range;  // @28  1/m; 0: unlimited
    vec3 intensity;  // @32  linear colour times lux (sun) or candela
    float spot_scale;  // @44  1 / (cos inner - cos outer)
    float spot_offset;  // @48  -cos outer * spot_scale
    uint casts_shadow;  // @52  1 for the one sun that the shadow map belongs to
    uint unused0;  // @56  padding
    uint unused1;  // @60  padding
};

struct Frame {  // 592 bytes
    mat4 view;  // @0  world to view (-z forward)
    mat4 view_proj;  // @64  world to clip, jittered (and sheared for the raster reference)
    mat4 view_to_world;  // @128  inverse of view
    mat4 prev_view_proj;  // @192  last frame's world to clip, without jitter
    mat4 this_view_proj;  // @256  this frame's world to clip, without jitter
    mat4 shadow_view_proj;  // @320  world to the sun's clip space
    vec3 lens_eye;  // @384  the point rays of this raster frame start from: eye, or a lens point in the raster reference, m
    float near_plane;  // @396  m
    vec3 sky;  // @400  linear radiance straight up, or the flat background when unlit
    float tan_half_fov_y;  // @412
    vec3 ground;  // @416  linear radiance straight down
    float aperture;  // @428  lens diameter, m
    vec2 size_px;  // @432  full resolution
    vec2 inverse_size;  // @440  1/px
    vec2 jitter_px;  // @448  sub-pixel offset of this frame's samples from the pixel centre, in -0.5..0.5
    float coc_scale_px;  // @456  K of coc_px = K (1/d - 1/z)
    float inverse_focus;  // @460  1/d, 1/m; 0 at infinity
    float max_coc_px;  // @464  largest CoC radius that the post-process reaches, px
    float lens_anamorphic;  // @468  horizontal squeeze of the aperture: x is scaled by 1/this
    float lens_rotation;  // @472  rad
    float lens_aberration;  // @476  s of the area weight 1 + s(2t - 1), -1..1
    float lens_cat_eye;  // @480  shift of the barrel's disc seen from a corner, half lens diameters
    vec2 lens_point;  // @488  raster reference: this frame's point of the lens, half diameters
    uint frame_index;  // @496  counts from 0 at the last history reset
    uint seed;  // @500
    float exposure;  // @504  linear factor before tone mapping
    uint light_count;  // @508
    uint samples_per_frame;  // @512  traced view: lens samples per pixel added this frame
    uint slice_begin;  // @516  traced view: first row of this frame's slice, px
    uint slice_end;  // @520  one past its last row
    float ray_budget;  // @524  hybrid: mean rays per masked pixel
    uint max_rays;  // @528  hybrid: most rays for one pixel
    float mask_sensitivity;  // @532  s of the mask's saturating response
    float focus_blend;  // @536  width of the near/far split, as CoC radius in px
    float history_alpha;  // @540  smallest blend factor of the ray accumulation
    float reconstruct_radius;  // @544  radius of the layers' spatial reconstruction, of CoC
    float blend_hit_ratio;  // @548  far: rays count below this hit ratio
    float blend_specular;  // @552  near: specular luminance at which the post-process wins
    float taa_alpha;  // @556  blend factor of the newest frame
    uint moved;  // @560  1 if the view or an object moved since last frame
    uint history_valid;  // @564  0 right after a reset
    float mask_threshold;  // @568  mask responses below get no rays
    float mask_variance;  // @572  weight of the rays' deviation in the ray budget
    float mask_smoothing;  // @576  standard deviation of the mask's Gaussian, half-res px
    float layer_fade_px;  // @580  post-process: CoC difference over which a sample passes from fore- to background
    float overlay_range_lo;  // @584  value shown as the colour map's start
    float overlay_range_hi;  // @588  value shown as its end
};

struct BvhNode {  // 64 bytes
    vec3 origin;  // @0  first planes of the grid, m
    float step_x;  // @12  from a plane of the grid to the next, m
    uvec3 low;  // @16  the boxes' low planes along x, y and z: a byte for each child, child 0 in the lowest
    float step_y;  // @28
    uvec3 high;  // @32  their high planes
    float step_z;  // @44
    uvec4 child;  // @48  references to the children (app/bvh/pack.py)
};

struct Object {  // 208 bytes
    mat4 to_world;  // @0  its own space to the world
    mat4 from_world;  // @64  the inverse; rays use the linear part only, about to_world's translation
    mat4 to_previous;  // @128  where a point of the world now was one frame ago
    uint root;  // @192  node where its tree begins
    uint unused0;  // @196  padding
    uint unused1;  // @200  padding
    uint unused2;  // @204  padding
};

#ifdef RECORDS_IN_TEXTURES
uvec4 record_texel(usampler2D records, uint i) {
    return texelFetch(records, ivec2(i % 4096u, i / 4096u), 0);
}

void read_record(usampler2D records, uint i, out uvec4 record) { record = record_texel(records, i); }
void read_record(usampler2D records, uint i, out vec4 record) { record = uintBitsToFloat(record_texel(records, i)); }

void read_record(usampler2D records, uint i, out Vertex record) {
    uvec4 t0 = record_texel(records, 2u * i + 0u);
    uvec4 t1 = record_texel(records, 2u * i + 1u);
    record.px = uintBitsToFloat(t0.x);
    record.py = uintBitsToFloat(t0.y);
    record.pz = uintBitsToFloat(t0.z);
    record.normal = t0.w;
    record.u = uintBitsToFloat(t1.x);
    record.v = uintBitsToFloat(t1.y);
    record.tangent = t1.z;
    record.material = t1.w;
}

void read_record(usampler2D records, uint i, out Material record) {
    uvec4 t0 = record_texel(records, 12u * i + 0u);
    uvec4 t1 = record_texel(records, 12u * i + 1u);
    uvec4 t2 = record_texel(records, 12u * i + 2u);
    uvec4 t3 = record_texel(records, 12u * i + 3u);
    uvec4 t4 = record_texel(records, 12u * i + 4u);
    uvec4 t5 = record_texel(records, 12u * i + 5u);
    uvec4 t6 = record_texel(records, 12u * i + 6u);
    uvec4 t7 = record_texel(records, 12u * i + 7u);
    uvec4 t8 = record_texel(records, 12u * i + 8u);
    uvec4 t9 = record_texel(records, 12u * i + 9u);
    uvec4 t10 = record_texel(records, 12u * i + 10u);
    uvec4 t11 = record_texel(records, 12u * i + 11u);
    record.base_color = uintBitsToFloat(t0.xyzw);
    record.emissive = uintBitsToFloat(t1.xyz);
    record.alpha_cutoff = uintBitsToFloat(t1.w);
    record.metallic = uintBitsToFloat(t2.x);
    record.roughness = uintBitsToFloat(t2.y);
    record.normal_scale = uintBitsToFloat(t2.z);
    record.unused = uintBitsToFloat(t2.w);
    record.textures = t3.xyzw;
    record.uv_base_u = uintBitsToFloat(t4.xyzw);
    record.uv_base_v = uintBitsToFloat(t5.xyzw);
    record.uv_surface_u = uintBitsToFloat(t6.xyzw);
    record.uv_surface_v = uintBitsToFloat(t7.xyzw);
    record.uv_normal_u = uintBitsToFloat(t8.xyzw);
    record.uv_normal_v = uintBitsToFloat(t9.xyzw);
    record.uv_emissive_u = uintBitsToFloat(t10.xyzw);
    record.uv_emissive_v = uintBitsToFloat(t11.xyzw);
}

void read_record(usampler2D records, uint i, out Light record) {
    uvec4 t0 = record_texel(records, 4u * i + 0u);
    uvec4 t1 = record_texel(records, 4u * i + 1u);
    uvec4 t2 = record_texel(records, 4u * i + 2u);
    uvec4 t3 = record_texel(records, 4u * i + 3u);
    record.position = uintBitsToFloat(t0.xyz);
    record.kind = t0.w;
    record.direction = uintBitsToFloat(t1.xyz);
    record.inverse_range = uintBitsToFloat(t1.w);
    record.intensity = uintBitsToFloat(t2.xyz);
    record.spot_scale = uintBitsToFloat(t2.w);
    record.spot_offset = uintBitsToFloat(t3.x);
    record.casts_shadow = t3.y;
    record.unused0 = t3.z;
    record.unused1 = t3.w;
}

void read_record(usampler2D records, uint i, out BvhNode record) {
    uvec4 t0 = record_texel(records, 4u * i + 0u);
    uvec4 t1 = record_texel(records, 4u * i + 1u);
    uvec4 t2 = record_texel(records, 4u * i + 2u);
    uvec4 t3 = record_texel(records, 4u * i + 3u);
    record.origin = uintBitsToFloat(t0.xyz);
    record.step_x = uintBitsToFloat(t0.w);
    record.low = t1.xyz;
    record.step_y = uintBitsToFloat(t1.w);
    record.high = t2.xyz;
    record.step_z = uintBitsToFloat(t2.w);
    record.child = t3.xyzw;
}

void read_record(usampler2D records, uint i, out Object record) {
    uvec4 t0 = record_texel(records, 13u * i + 0u);
    uvec4 t1 = record_texel(records, 13u * i + 1u);
    uvec4 t2 = record_texel(records, 13u * i + 2u);
    uvec4 t3 = record_texel(records, 13u * i + 3u);
    uvec4 t4 = record_texel(records, 13u * i + 4u);
    uvec4 t5 = record_texel(records, 13u * i + 5u);
    uvec4 t6 = record_texel(records, 13u * i + 6u);
    uvec4 t7 = record_texel(records, 13u * i + 7u);
    uvec4 t8 = record_texel(records, 13u * i + 8u);
    uvec4 t9 = record_texel(records, 13u * i + 9u);
    uvec4 t10 = record_texel(records, 13u * i + 10u);
    uvec4 t11 = record_texel(records, 13u * i + 11u);
    uvec4 t12 = record_texel(records, 13u * i + 12u);
    record.to_world = mat4(uintBitsToFloat(t0), uintBitsToFloat(t1), uintBitsToFloat(t2), uintBitsToFloat(t3));
    record.from_world = mat4(uintBitsToFloat(t4), uintBitsToFloat(t5), uintBitsToFloat(t6), uintBitsToFloat(t7));
    record.to_previous = mat4(uintBitsToFloat(t8), uintBitsToFloat(t9), uintBitsToFloat(t10), uintBitsToFloat(t11));
    record.root = t12.x;
    record.unused0 = t12.y;
    record.unused1 = t12.z;
    record.unused2 = t12.w;
}
#endif
