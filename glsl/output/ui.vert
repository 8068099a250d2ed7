// Places the user interface's triangles on the window.
// Reads: position (window units, y downwards), uv, color (display values); transform (scale xy, offset zw, to clip
//   space).
// Writes: clip position.
// Method: Dear ImGui's vertex format (Cornut, imgui.h, ImDrawVert).

uniform vec4 transform;
in vec2 position;
in vec2 uv;
in vec4 color;
out vec2 vertex_uv;
out vec4 vertex_color;

void main() {
    vertex_uv = uv;
    vertex_color = color;
    gl_Position = vec4(position * transform.xy + transform.zw, 0.0, 1.0);
}
