// Finds how many rays a step of mask response is worth, so that masked pixels get the budgeted mean.
// Reads: RayHistogram (masked pixels per response step 1..255).
// Fills: RayBudget (rays per response step).
// Method: the mean of clamp(scale * level, fewest, most) over the histogram grows with `scale`; each of 256
// invocations tries one scale and the interval that holds the answer is divided again, four times: past float32. One
// work group.
#include "shared/frame.glsl"
#include "lib/mask.glsl"

layout(local_size_x = 256) in;
layout(std430) readonly buffer RayHistogram { uint pixels_of_level[256]; };
layout(std430) writeonly buffer RayBudget { float rays_per_level; };

shared uint first_enough;

// Rays of one frame beyond the budget, for a scale.
float surplus(float scale, float fewest, float most) {
    float mean = clamp(frame.ray_budget, fewest, most), sum = 0.0;
    for (int level = 1; level < 256; level++) {
        uint pixels = pixels_of_level[level];
        if (pixels > 0u) sum += float(pixels) * (planned_rays(float(level), scale, fewest, most) - mean);
    }
    return sum;
}

void main() {
    uint lane = gl_LocalInvocationIndex;
    float most = float(frame.max_rays), fewest = min(1.0, frame.ray_budget);
    float low = 0.0, high = most;
    for (int digit = 0; digit < 4; digit++) {
        if (lane == 0u) first_enough = 255u;
        barrier();
        float width = (high - low) / 256.0;
        if (surplus(low + float(lane + 1u) * width, fewest, most) >= 0.0) atomicMin(first_enough, lane);
        barrier();
        low += float(first_enough) * width;
        high = low + width;
        barrier();
    }
    if (lane == 0u) rays_per_level = high;
}
