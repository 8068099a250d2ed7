// Finds how many rays a step of mask response is worth, so that masked pixels get the budgeted mean.
// Reads: RayHistogram (masked pixels per response step 1..255).
// Fills: RayBudget (rays per response step).
// Method: the mean of clamp(scale * level, fewest, most) over the histogram grows with `scale`; each of 256
// invocations tries one scale and the interval that holds the answer is divided again, four times: past float32.
// Running sums over the levels make a try a matter of two look-ups. One work group.
#include "shared/frame.glsl"
#include "lib/mask.glsl"

layout(local_size_x = 256) in;
layout(std430) readonly buffer RayHistogram { uint pixels_of_level[256]; };
layout(std430) writeonly buffer RayBudget { float rays_per_level; };

shared uint first_enough;
shared uint pixels_upto[256];   // masked pixels of this level and all below
shared float levels_upto[256];  // the sum of their levels

// Running sums over the levels (Hillis and Steele 1986). The whole work group calls it.
void sum_up(uint lane) {
    pixels_upto[lane] = lane > 0u ? pixels_of_level[lane] : 0u;
    levels_upto[lane] = float(lane) * float(pixels_upto[lane]);
    for (uint step = 1u; step < 256u; step *= 2u) {
        barrier();
        uint pixels = lane >= step ? pixels_upto[lane - step] : 0u;
        float levels = lane >= step ? levels_upto[lane - step] : 0.0;
        barrier();
        pixels_upto[lane] += pixels;
        levels_upto[lane] += levels;
    }
    barrier();
}

// Rays of one frame beyond the budget, for a scale: levels up to `low` get the fewest, those above `high` the most.
float surplus(float scale, float fewest, float most) {
    uint low = uint(min(fewest / scale, 255.0)), high = uint(min(most / scale, 255.0));
    float between = scale * (levels_upto[high] - levels_upto[low]);
    float rays = fewest * float(pixels_upto[low]) + between + most * float(pixels_upto[255] - pixels_upto[high]);
    return rays - clamp(frame.ray_budget, fewest, most) * float(pixels_upto[255]);
}

void main() {
    uint lane = gl_LocalInvocationIndex;
    float most = float(frame.max_rays), fewest = min(1.0, frame.ray_budget);
    float low = 0.0, high = most;
    sum_up(lane);
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
