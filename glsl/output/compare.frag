// Shows one finished picture, or two on either side of a bar.
// Reads: left, right (display values, any resolution: filtered to the window's), bar_x (0..1 of the rectangle;
//   negative: no bar), texel (1/window px).
// Writes: pixel (display values).
// Method: none beyond bilinear filtering; a white line between dark edges is seen on any picture.

uniform sampler2D left;
uniform sampler2D right;
uniform float bar_x;
uniform float texel;
in vec2 uv;
out vec4 pixel;

void main() {
    vec3 picture = uv.x < bar_x || bar_x < 0.0 ? texture(left, uv).rgb : texture(right, uv).rgb;
    float distance_px = bar_x < 0.0 ? 1e9 : abs(uv.x - bar_x) / texel;
    pixel = vec4(distance_px < 1.0 ? vec3(1.0) : distance_px < 2.0 ? vec3(0.0) : picture, 1.0);
}
