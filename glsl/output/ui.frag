// Paints the user interface: the vertex colour times a texel of the font atlas or of a picture.
// Reads: image (display values, straight alpha).
// Writes: pixel (display values, straight alpha; blended over the window).
// Method: Dear ImGui's shading rule (Cornut, imgui.h, ImDrawCmd).

uniform sampler2D image;
in vec2 vertex_uv;
in vec4 vertex_color;
out vec4 pixel;

void main() {
    pixel = vertex_color * texture(image, vertex_uv);
}
