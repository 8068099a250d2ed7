"""The one table of targets: format, resolution, and what a texel means in which unit."""

from __future__ import annotations

from .records import Buffer, Target

# full-resolution px per side of a tile: small enough to class finely, large enough that a tile costs one work group
TILE_PX = 16
TILE_CLASSES = 5  # kinds of tiles that the post-process tells apart: dof/tile_classes.glsl
RAY_CLASSES = 2  # and that the hybrid does: dof/ray_tiles.glsl

# most rings of a gather's kernel; row n of the target `kernel` holds the taps of one of n rings, twice: glsl/lib/kernel.glsl
MOST_RINGS = 8
KERNEL_SIZE = ((2 * MOST_RINGS + 1) ** 2, 2 * (MOST_RINGS + 1))

# fmt: off
TARGETS: dict[str, Target] = {
    t.name: t
    for t in (
        # G-buffer
        Target("base_color", 4, "f2", "linear base colour; a: metallic"),
        Target("normal", 4, "f2", "world normal, octahedral in xy; z: roughness; w: 1 on a surface, 0 in the sky", filter="nearest", show="normal", signed="xy"),
        Target("emissive", 4, "f2", "emitted radiance, linear"),
        Target("depth", 1, "f4", "planar view depth, m; SKY_DEPTH where nothing is", filter="nearest", show="scalar", range=(0.0, 10.0)),
        Target("object", 1, "f2", "index of the moving object; 0: what stands still", filter="nearest", show="scalar", range=(0.0, 4.0)),
        Target("motion", 2, "f2", "screen motion since last frame, px", filter="nearest", show="vector", range=(-8.0, 8.0), signed="xy"),
        # lighting
        Target("lit", 4, "f2", "radiance, linear; a: luminance of its specular part"),
        Target("coc", 1, "f4", "signed CoC radius, full-res px, negative in front of focus", filter="nearest", show="signed", range=(-20.0, 20.0), signed="x"),
        # post-process
        Target("kernel", 2, "f4", "points of the aperture, half lens diameters: a kernel a row, as many rings as the row's number", fixed=KERNEL_SIZE, filter="nearest", show="vector", range=(-1.0, 1.0), signed="xy"),
        Target("tiles", 2, "f4", "x: most negative, y: largest signed CoC in the tile, full-res px, as far as the post-process gathers", TILE_PX, filter="nearest", show="signed", range=(-20.0, 20.0), signed="xy"),
        Target("tiles_row", 2, "f4", "tiles after the horizontal half of the dilation", TILE_PX, filter="nearest", show="signed", range=(-20.0, 20.0), signed="xy"),
        Target("tiles_dilated", 2, "f4", "x: most negative, y: largest CoC that reaches the tile, full-res px", TILE_PX, filter="nearest", show="signed", range=(-20.0, 20.0), signed="xy"),
        Target("half_color", 4, "f2", "radiance of the 2x2 block's chosen layer; a: its signed CoC radius, full-res px", 2, signed="w"),
        Target("half_specular", 1, "f2", "specular luminance of that layer", 2, show="scalar"),
        Target("prefiltered", 4, "f2", "half_color blurred over the area that one tap of the gather stands for; a: signed radius left to draw, full-res px", 2, signed="w"),
        Target("near_gather", 4, "f2", "near layer, premultiplied by coverage; a: coverage", 2),
        Target("far_gather", 4, "f2", "radiance of what lies behind the near layer; a: 1 where any was seen", 2),
        Target("near_specular", 1, "f2", "specular luminance of the near layer, premultiplied by coverage", 2, show="scalar"),
        Target("near_blur", 4, "f2", "near_gather after the median", 2),
        Target("far_blur", 4, "f2", "far_gather after the median", 2),
        Target("post", 4, "f2", "the post-processed picture, radiance; a: specular luminance of its near layer"),
        Target("post_behind", 4, "f2", "what the post-process shows behind its near layer, radiance; a: 1 where anything was seen"),
        # hybrid
        Target("scout", 2, "f4", "x: share of lens rays that hit near surfaces which the raster image does not hold; y: rays that say so", TILE_PX, history=True, filter="nearest", show="scalar"),
        Target("mask_guide", 4, "f4", "means over 2x2 px; xyz: world normal, w: CoC, px", 2, cleared=True, filter="nearest", signed="xyzw"),
        Target("mask_slope", 4, "f4", "x: most negative CoC of the 2x2 px; yz: what CoC changes along x and y per half-res px by the surface's own slope", 2, cleared=True, filter="nearest", show="signed", range=(-20.0, 20.0), signed="xyz"),
        Target("mask_smooth_row", 4, "f4", "mask_guide after the horizontal Gaussian", 2, cleared=True, filter="nearest", signed="xyzw"),
        Target("mask_smooth", 4, "f4", "mask_guide after the Gaussian; xyz: normal, w: CoC, px", 2, cleared=True, filter="nearest", signed="xyzw"),
        Target("mask_edges", 2, "f2", "x: mask response of an edge, 0..1; y: how far its near blur reaches, half-res px", 2, cleared=True, filter="nearest", show="scalar"),
        Target("mask_tiles", 1, "f4", "largest reach of an edge in the tile, half-res px", TILE_PX, cleared=True, filter="nearest", show="scalar", range=(0.0, 20.0)),
        Target("mask_reach_row", 1, "f4", "the same after the horizontal half of the dilation", TILE_PX, filter="nearest", show="scalar", range=(0.0, 20.0)),
        Target("mask_reach", 1, "f4", "largest reach of the edges that reach the tile, half-res px", TILE_PX, filter="nearest", show="scalar", range=(0.0, 20.0)),
        Target("mask_coarse", 2, "f2", "mask_edges, one texel per 2^n x 2^n of its texels, n after the largest reach; fills the lower left corner", 2, cleared=True, filter="nearest", show="scalar"),
        Target("mask_rows", 4, "f4", "x: power of the coarse row's strongest edge, half-res px^2; y: its reach, half-res px; z: its response; w: half-res px a coarse row", 2, cleared=True, filter="nearest", show="signed", range=(-400.0, 400.0), signed="x"),
        Target("mask", 2, "f2", "x: weight of the pixel in the ray budget, steps of 1/255, less: no more rays, 0: none; y: weight of rays in the composite", 2, cleared=True, show="scalar"),
        Target("ray_count", 2, "f4", "x: lens rays traced in the pixel this frame; y: in earlier frames", 2, history=True, filter="nearest", show="scalar", range=(0.0, 16.0)),
        Target("trace_near", 4, "f2", "this frame's near radiance times hit ratio; a: hit ratio", 2, cleared=True, filter="nearest"),
        Target("trace_far", 4, "f2", "this frame's far radiance times (1 - hit ratio); a: 1 - hit ratio", 2, cleared=True, filter="nearest"),
        Target("trace_motion", 4, "f2", "mean screen motion since last frame, px; xy: of near hits, zw: of far hits", 2, cleared=True, filter="nearest", show="vector", range=(-8.0, 8.0), signed="xyzw"),
        Target("trace_spread", 4, "f4", "this frame's hits, x: mean CoC of near, y: of far, px; z: mean square of the screen motion of near, w: of far, px^2", 2, cleared=True, filter="nearest", show="signed", range=(-20.0, 20.0), signed="xy"),
        Target("trace_moments", 4, "f4", "mean over this frame's rays of compressed luminance; x: near part, y: its square; zw: far", 2, cleared=True, filter="nearest", show="scalar"),
        Target("probe_hit", 4, "f4", "of one lens ray of the 3x3 pixels; xyz: world position of its hit, m; w: compressed luminance", 6, history=True, cleared=True, filter="nearest", show="scalar", signed="xyz"),
        Target("probe_lens", 4, "f4", "the same ray; xy: its point of the lens in the unit square; z: object it hit; w: 1 + near share, 0: no ray", 6, history=True, cleared=True, filter="nearest", show="scalar", range=(0.0, 2.0)),
        Target("gradient", 2, "f2", "squared relative change of light that stored lens rays find, 0..1; x: near, y: far; -1: unknown", 6, filter="nearest", show="signed", range=(-1.0, 1.0), signed="xy"),
        Target("near_layer", 4, "f4", "accumulated near radiance times hit ratio; a: accumulated hit ratio", 2, history=True, cleared=True, filter="nearest"),
        Target("far_layer", 4, "f4", "accumulated far radiance times (1 - hit ratio); a: accumulated 1 - hit ratio", 2, history=True, cleared=True, filter="nearest"),
        Target("layer_state", 4, "f4", "x: rays in the near mean, y: in the far mean; z: hit ratio; w: still frames they hold, 0: nothing", 2, history=True, cleared=True, filter="nearest"),
        Target("layer_coc", 2, "f4", "x: accumulated CoC of near hits, y: of far hits, px", 2, history=True, cleared=True, filter="nearest", show="signed", range=(-20.0, 20.0), signed="xy"),
        Target("layer_moments", 4, "f4", "trace_moments, accumulated", 2, history=True, cleared=True, filter="nearest", show="scalar"),
        Target("near_light", 4, "f2", "near radiance times its share, as composed this frame; a: the share", 2, cleared=True, filter="nearest", signed="xyzw"),
        Target("far_light", 4, "f2", "far radiance times its share, as composed this frame; a: the share", 2, cleared=True, filter="nearest", signed="xyzw"),
        Target("layer_smoothing", 4, "f2", "part of a layer's light that neighbours may smooth; x: near, y: far; zw: how far either is gathered, half-res px", 2, cleared=True, filter="nearest", show="scalar"),
        Target("near_smooth", 4, "f2", "near_light after spatial reconstruction", 2, cleared=True, filter="nearest", signed="xyzw"),
        Target("far_smooth", 4, "f2", "far_light after spatial reconstruction", 2, cleared=True, filter="nearest", signed="xyzw"),
        Target("hybrid", 4, "f2", "the hybrid picture, radiance; a: share of the traced near layer", signed="xyz"),
        # ray-traced view and raster reference
        Target("traced", 4, "f4", "mean radiance over lens samples; a: number of samples", filter="nearest"),
        Target("traced_error", 4, "f4", "what rounding has so far withheld from the mean (Kahan); a: lens samples tried", filter="nearest", show="signed", range=(-1e-6, 1e-6), signed="xyz"),
        Target("reference", 4, "f4", "mean radiance over rasterised lens points; a: number of points that count", filter="nearest"),
        Target("reference_error", 4, "f4", "what rounding has so far withheld from the mean (Kahan)", filter="nearest", show="signed", range=(-1e-6, 1e-6), signed="xyz"),
        # output
        Target("resolved", 4, "f4", "temporally anti-aliased radiance; a: frames accumulated", history=True, signed="xyz"),
        Target("display", 4, "f1", "tone-mapped, sRGB-encoded"),
    )
}

# What is nearest so far, while the G-buffer is drawn: storage of a frame that no pass names.
DEPTH_TEST = Target("depth test", 1, "depth", "depth of the nearest surface, as the rasteriser compares it")

BUFFERS: dict[str, Buffer] = {
    b.name: b
    for b in (
        Buffer("TileWork", "per class of tiles (dof/tile_classes.glsl) three group counts and the tile count; then its tiles, x | y << 16", header=16 * TILE_CLASSES, bytes_per_pixel=4 * TILE_CLASSES, scale=TILE_PX),
        Buffer("EdgeTiles", "three group counts and the number of tiles in which edges are looked for; then those tiles, x | y << 16", header=16, bytes_per_pixel=4, scale=TILE_PX),
        Buffer("RayTiles", "for the tiles without rays and for those where rays may be called for (dof/ray_tiles.glsl) three group counts and the tile count; then the tiles, x | y << 16", header=16 * RAY_CLASSES, bytes_per_pixel=4 * RAY_CLASSES, scale=TILE_PX),
        Buffer("MaskReach", "largest reach of an edge, half-res px", header=16),
        Buffer("RayHistogram", "masked pixels per weight in the ray budget, one count per step of 1/255", header=1024),
        Buffer("RayBudget", "rays that a step of weight is worth", header=16),
        Buffer("RayWork", "three group counts of the dispatch, pixel count, then x | y << 16 of each half-res pixel with rays", header=16, bytes_per_pixel=4, scale=2),
    )
}
# fmt: on
