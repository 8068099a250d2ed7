// What every pass of a frame may know: camera, lens, thresholds. Written once per frame from app/gpu/layout.py's FRAME.
#include "shared/structs.glsl"

layout(std140) uniform FrameBlock { Frame frame; };
