"""The one table of targets: format, resolution, and what a texel means in which unit."""

from __future__ import annotations

from .records import Buffer, Target

# full-resolution px per side of a tile: small enough to class finely, large enough that a tile costs one work group
TILE_PX = 16

# fmt: off
TARGETS: dict[str, Target] = {
    t.name: t
    for t in (
        # G-buffer
        Target("base_color", 4, "f2", "linear base colour; a: metallic"),
        Target("normal", 4, "f2", "world normal, octahedral in xy; z: roughness; w: 1 on a surface, 0 in the sky", filter="nearest", show="normal"),
        Target("emissive", 4, "f2", "emitted radiance, linear"),
        Target("depth", 1, "f4", "planar view depth, m; SKY_DEPTH where nothing is", filter="nearest", show="scalar", range=(0.0, 10.0)),
        Target("object", 1, "f2", "index of the moving object; 0: what stands still", filter="nearest", show="scalar", range=(0.0, 4.0)),
        Target("motion", 2, "f2", "screen motion since last frame, px", filter="nearest", show="vector", range=(-8.0, 8.0)),
        # lighting
        Target("lit", 4, "f2", "radiance, linear; a: luminance of its specular part"),
        Target("coc", 1, "f4", "signed CoC radius, full-res px, negative in front of focus", filter="nearest", show="signed", range=(-20.0, 20.0)),
        # post-process
        Target("tiles", 2, "f4", "x: most negative, y: largest signed CoC in the tile, full-res px", TILE_PX, filter="nearest", show="signed", range=(-20.0, 20.0)),
        Target("tiles_row", 2, "f4", "tiles after the horizontal half of the dilation", TILE_PX, filter="nearest", show="signed", range=(-20.0, 20.0)),
        Target("tiles_dilated", 2, "f4", "x: most negative, y: largest CoC that reaches the tile, full-res px", TILE_PX, filter="nearest", show="signed", range=(-20.0, 20.0)),
        Target("half_color", 4, "f2", "radiance of the 2x2 block's chosen layer; a: its signed CoC radius, full-res px", 2),
        Target("half_specular", 1, "f2", "specular luminance of that layer", 2, show="scalar"),
        Target("prefiltered", 4, "f2", "half_color blurred over the area that one tap of the gather stands for; a: signed CoC radius, full-res px", 2),
        Target("near_gather", 4, "f2", "near layer, premultiplied by coverage; a: coverage", 2),
        Target("far_gather", 4, "f2", "radiance of what lies behind the near layer; a: 1 where any was seen", 2),
        Target("near_specular", 1, "f2", "specular luminance of the near layer, premultiplied by coverage", 2, show="scalar"),
        Target("near_blur", 4, "f2", "near_gather after the median", 2),
        Target("far_blur", 4, "f2", "far_gather after the median", 2),
        Target("post", 4, "f2", "the post-processed picture, radiance; a: specular luminance of its near layer"),
        # hybrid
        Target("mask_edges", 2, "f2", "x: mask response of an edge, 0..1; y: how far its near blur reaches, half-res px", 2, filter="nearest", show="scalar"),
        Target("mask_tiles", 1, "f4", "largest reach of an edge in the tile, half-res px", TILE_PX, filter="nearest", show="scalar", range=(0.0, 20.0)),
        Target("mask_reach_row", 1, "f4", "the same after the horizontal half of the dilation", TILE_PX, filter="nearest", show="scalar", range=(0.0, 20.0)),
        Target("mask_reach", 1, "f4", "largest reach of the edges that reach the tile, half-res px", TILE_PX, filter="nearest", show="scalar", range=(0.0, 20.0)),
        Target("mask_rows", 4, "f4", "x: power of the row's strongest edge, half-res px^2; y: its reach, half-res px; z: its response", 2, filter="nearest", show="signed", range=(-400.0, 400.0)),
        Target("mask", 2, "f2", "x: mask response where near blur reaches, 0..1, 0: no rays; y: weight of rays in the composite", 2, show="scalar"),
        Target("ray_count", 2, "f4", "x: lens rays traced in the pixel this frame; y: in earlier frames", 2, history=True, filter="nearest", show="scalar", range=(0.0, 16.0)),
        Target("trace_near", 4, "f2", "this frame's near radiance times hit ratio; a: hit ratio", 2, filter="nearest"),
        Target("trace_far", 4, "f2", "this frame's far radiance times (1 - hit ratio); a: 1 - hit ratio", 2, filter="nearest"),
        Target("trace_motion", 4, "f2", "mean screen motion since last frame, px; xy: of near hits, zw: of far hits", 2, filter="nearest", show="vector", range=(-8.0, 8.0)),
        Target("trace_spread", 4, "f4", "mean over this frame's rays; x: near share times CoC, px; y: times squared luminance; zw: of far hits", 2, filter="nearest", show="signed", range=(-20.0, 20.0)),
        Target("near_layer", 4, "f4", "accumulated near radiance times hit ratio; a: accumulated hit ratio", 2, history=True, filter="nearest"),
        Target("far_layer", 4, "f4", "accumulated far radiance times (1 - hit ratio); a: accumulated 1 - hit ratio", 2, history=True, filter="nearest"),
        Target("layer_state", 4, "f4", "x: rays in the near mean, y: in the far mean; z: hit ratio; w: 1 if valid", 2, history=True, filter="nearest"),
        Target("layer_spread", 4, "f4", "trace_spread, accumulated", 2, history=True, filter="nearest", show="signed", range=(-20.0, 20.0)),
        Target("layer_noise", 4, "f4", "x: near CoC, px; y: far CoC, px; z: mean premultiplied luminance of near; w: its variance per ray", 2, filter="nearest", show="signed", range=(-20.0, 20.0)),
        Target("far_noise", 2, "f4", "x: mean premultiplied luminance of far; y: its variance per ray", 2, filter="nearest", show="scalar"),
        Target("near_light", 4, "f2", "near radiance times its share, as composed this frame; a: the share", 2, filter="nearest"),
        Target("far_light", 4, "f2", "far radiance times its share, as composed this frame; a: the share", 2, filter="nearest"),
        Target("near_smooth", 4, "f2", "near_light after spatial reconstruction", 2, filter="nearest"),
        Target("far_smooth", 4, "f2", "far_light after spatial reconstruction", 2, filter="nearest"),
        Target("hybrid", 4, "f2", "the hybrid picture, radiance"),
        # ray-traced view and raster reference
        Target("traced", 4, "f4", "mean radiance over lens samples; a: number of samples", filter="nearest"),
        Target("traced_error", 4, "f4", "what rounding has so far withheld from the mean (Kahan)", filter="nearest", show="signed", range=(-1e-6, 1e-6)),
        Target("reference", 4, "f4", "mean radiance over rasterised lens points; a: number of points", filter="nearest"),
        Target("reference_error", 4, "f4", "what rounding has so far withheld from the mean (Kahan)", filter="nearest", show="signed", range=(-1e-6, 1e-6)),
        # output
        Target("resolved", 4, "f4", "temporally anti-aliased radiance; a: frames accumulated", history=True),
        Target("display", 4, "f1", "tone-mapped, sRGB-encoded"),
    )
}

BUFFERS: dict[str, Buffer] = {
    b.name: b
    for b in (
        Buffer("RayHistogram", "masked pixels per mask response, one count per step of 1/255", header=1024),
        Buffer("RayBudget", "rays that a step of mask response is worth", header=16),
        Buffer("RayWork", "three group counts of the dispatch, pixel count, then x | y << 16 of each half-res pixel with rays", header=16, bytes_per_pixel=4, scale=2),
    )
}
# fmt: on
