// Covers the picture's rectangle with one triangle.
// Reads: nothing. Writes: uv (0..1 over the rectangle, from the bottom left).
// Method: the vertices (0,0), (2,0), (0,2) of a triangle twice as large as the rectangle, which clipping cuts to it.

out vec2 uv;

void main() {
    uv = vec2((gl_VertexID & 1) * 2, (gl_VertexID >> 1) * 2);
    gl_Position = vec4(2.0 * uv - 1.0, 0.0, 1.0);
}
