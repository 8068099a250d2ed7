"""glsl/lib/running_mean.glsl over 100 000 samples against a float64 mean: it neither stalls nor drifts."""

from __future__ import annotations

import moderngl
import numpy as np

from app.sampling import hash_u32

from .harness import call_glsl

EPS = 2.0**-23
FILE = "lib/running_mean.glsl"
SAMPLES = 100_000
INCLUDES = '#include "lib/sampling.glsl"\n'

# Every sample is exact in float32, so that the mean's own rounding is all that differs. x: a large mean with small
# noise, whose updates fall below half an ulp of it; y: seventeen octaves, as fireflies have; z: one in eight is not a
# number or infinite.
WRAPPER = """
vec3 noise(uint i, uint seed) {
    uint h = hash_u32(i + hash_u32(seed));
    float bad = uintBitsToFloat((h & 8u) != 0u ? 0x7fc00000u : (h & 16u) != 0u ? 0x7f800000u : 0xff800000u);
    return vec3(1000.0 + float(h >> 18u) / 16384.0, exp2(float(int(h % 17u)) - 8.0), (h & 7u) == 0u ? bad : 1.0);
}
void add_range(inout vec4 mean, inout vec3 withheld, uvec3 range) {
    for (uint i = range.x; i < range.y; ++i) add_sample(mean, withheld, noise(i, range.z));
}
vec4 mean_of(vec4 mean, vec3 withheld, uvec3 range) {
    add_range(mean, withheld, range);
    return mean;
}
vec3 withheld_of(vec4 mean, vec3 withheld, uvec3 range) {
    add_range(mean, withheld, range);
    return withheld;
}"""
BATCH = 50_000  # samples per dispatch, as a renderer adds them over frames; llvmpipe leaves loops after 65 535 rounds


def twin(count: int, seed: int) -> np.ndarray:
    """The same samples (count, 3) in float64, with black for what is not finite."""
    with np.errstate(over="ignore"):
        h = hash_u32(np.arange(count, dtype=np.uint32) + hash_u32(np.uint32(seed)))
    return np.stack(
        [1000.0 + (h >> 18) / 16384.0, 2.0 ** ((h % 17).astype(float) - 8.0), np.where(h & 7 == 0, 0.0, 1.0)], -1
    )


def run(ctx: moderngl.Context, count: int, seeds: list[int]) -> np.ndarray:
    """The mean (n, 4) of the first `count` samples of each seed, its state handed from dispatch to dispatch."""
    mean, withheld = np.zeros((len(seeds), 4)), np.zeros((len(seeds), 3))
    for begin in range(0, count, BATCH):
        ranges = np.array([[begin, min(begin + BATCH, count), seed] for seed in seeds])
        mean, withheld = (
            call_glsl(ctx, FILE, f"{call}(vec4 m, vec3 w, uvec3 r)", mean, withheld, ranges, extra=INCLUDES + WRAPPER)
            for call in ("vec4 mean_of", "vec3 withheld_of")
        )
    return mean


def test_a_hundred_thousand_samples_keep_the_mean_to_the_last_bits(ctx: moderngl.Context) -> None:
    seeds = [0, 1, 2, 3]
    found = run(ctx, SAMPLES, seeds)
    assert (found[:, 3] == SAMPLES).all()
    for mean, seed in zip(found, seeds, strict=True):
        samples = twin(SAMPLES, seed)
        expected = samples.mean(0)
        # each step rounds (x - mean) / n by a share of eps; weighted by n / N these add up to eps times the mean
        # deviation, and the compensation leaves one rounding of the mean itself
        tolerance = EPS * (np.abs(expected) + 2.0 * np.abs(samples - expected).mean(0))
        assert (np.abs(mean[:3] - expected) <= tolerance).all()


def test_without_compensation_the_same_samples_would_be_lost(ctx: moderngl.Context) -> None:
    """The test above can fail: a plain float32 mean of x misses it by more than its tolerance."""
    samples = twin(SAMPLES, 0)[:, 0].astype(np.float32)
    mean = np.float32(0.0)
    for n, x in enumerate(samples, 1):
        mean += (x - mean) / np.float32(n)
    exact = samples.astype(float).mean()
    assert abs(float(mean) - exact) > 4.0 * EPS * exact


def test_every_prefix_is_a_mean(ctx: moderngl.Context) -> None:
    for count in (1, 2, 3, 7, 64, 1000):
        samples = twin(count, 5)
        tolerance = EPS * (np.abs(samples.mean(0)) + 2.0 * np.abs(samples - samples.mean(0)).mean(0))
        assert (np.abs(run(ctx, count, [5])[0, :3] - samples.mean(0)) <= tolerance).all()


def test_equal_samples_have_exactly_their_value_as_mean(ctx: moderngl.Context) -> None:
    wrapper = """vec4 same(uint count, float value) {
        vec4 mean = vec4(0.0); vec3 withheld = vec3(0.0);
        for (uint i = 0u; i < count; ++i) add_sample(mean, withheld, vec3(value));
        return mean;
    }"""
    values = np.array([0.1, 1e-20, 12345.678, 65504.0, 0.0], np.float32)
    found = call_glsl(ctx, FILE, "vec4 same(uint n, float v)", 10_000, values, extra=wrapper)
    assert (found[:, :3] == values[:, None]).all()


def test_bad_samples_count_as_black(ctx: moderngl.Context) -> None:
    wrapper = """vec4 two(uint bits) {
        vec4 mean = vec4(0.0); vec3 withheld = vec3(0.0);
        add_sample(mean, withheld, vec3(3.0));
        add_sample(mean, withheld, vec3(1.0, uintBitsToFloat(bits), 1.0));
        return mean;
    }"""
    bits = np.array([0x7FC00000, 0xFFC00001, 0x7F800000, 0xFF800000], np.uint32)
    found = call_glsl(ctx, FILE, "vec4 two(uint b)", bits, extra=wrapper)
    assert (found == [2.0, 1.5, 2.0, 2.0]).all()
