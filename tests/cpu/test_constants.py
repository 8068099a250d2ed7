"""Facts that Python and GLSL both must know, read from the text of either: changing one side alone is an error."""

from __future__ import annotations

import re

import numpy as np
import pytest

from app import optics
from app.bvh import pack
from app.frame import hybrid, mask
from app.frame.output import SHOW_KINDS
from app.frame.targets import MOST_RINGS, TILE_PX
from app.gpu import arrays
from app.gpu.shaders import load_glsl
from app.gpu.textures import NO_TEXTURE
from app.measure.metrics import RELATIVE_EPSILON
from app.panel.colormap import DIVERGING
from app.settings import Settings, ToneMap, walk
from tests.gpu import hybrid_twin, library_twin, post_twin

_FILES = {name: re.sub(r"//[^\n]*", "", text) for name, text in load_glsl().items()}
_CONSTANT = re.compile(r"const\s+(?:float|uint|int)\s+(\w+)\s*=\s*([^;]+);")


def constant(file: str, name: str) -> float:
    """The value of a GLSL constant whose initialiser is a literal or a quotient of two."""
    parts = [float(int(p, 0) if p.startswith("0x") else p) for p in found(file)[name].replace("u", "").split("/")]
    return parts[0] if len(parts) == 1 else parts[0] / parts[1]


def found(file: str) -> dict[str, str]:
    """Every scalar constant of a file with its initialiser."""
    return dict(_CONSTANT.findall(_FILES[file]))


@pytest.mark.parametrize(
    ("file", "name", "expected"),
    [
        ("lib/coc.glsl", "SKY_DEPTH", optics.SKY_DEPTH),
        ("lib/kernel.glsl", "MOST_RINGS", MOST_RINGS),
        ("lib/coc.glsl", "IN_FOCUS_COC_PX", optics.IN_FOCUS_COC_PX),
        ("lib/pi.glsl", "PI", np.pi),
        ("lib/tile.glsl", "TILE_PX", TILE_PX),
        ("lib/tile_reach.glsl", "REACH_MARGIN_PX", post_twin.REACH_MARGIN_PX),
        ("dof/mask_reach.comp", "TILE", TILE_PX / 2),
        ("lib/finite.glsl", "LARGEST_RADIANCE", post_twin.LARGEST_RADIANCE),
        ("lib/kernel.glsl", "GOLDEN", post_twin.GOLDEN),
        ("lib/kernel.glsl", "ROOT", post_twin.ROOT),
        ("lib/mask.glsl", "RAYS_BEGIN_PX", mask.RAYS_BEGIN_PX),
        ("lib/mask.glsl", "RAYS_BEGIN_PX", hybrid_twin.RAYS_BEGIN_PX),
        ("lib/mask.glsl", "RAYS_END_PX", hybrid_twin.RAYS_END_PX),
        ("lib/mask.glsl", "REACH_MARGIN_HALF", hybrid_twin.REACH_MARGIN_HALF),
        ("lib/mask.glsl", "RIM", hybrid_twin.RIM),
        ("lib/mask.glsl", "MOST_REACH_HALF", hybrid_twin.MOST_REACH_HALF),
        ("lib/errors.glsl", "RELATIVE_EPSILON", RELATIVE_EPSILON),
        ("lib/gradient.glsl", "DARK", hybrid_twin.DARK),
        ("lib/gradient.glsl", "DRIFT", hybrid_twin.DRIFT),
        ("lib/hit_layers.glsl", "SAME_DEPTH_PX", hybrid_twin.SAME_DEPTH_PX),
        ("lib/hit_layers.glsl", "SAME_DEPTH_SHARE", hybrid_twin.SAME_DEPTH_SHARE),
        ("lib/mask.glsl", "EDGE_WORTH", hybrid_twin.EDGE_WORTH),
        ("lib/mask.glsl", "FARTHEST_TEXELS", hybrid_twin.FARTHEST_TEXELS),
        ("lib/work_list.glsl", "GROUP_ITEMS", library_twin.GROUP_ITEMS),
        ("lib/work_list.glsl", "ROW_GROUPS", library_twin.ROW_GROUPS),
        ("shared/scene.glsl", "NO_TEXTURE", NO_TEXTURE),
        ("shared/objects.glsl", "OBJECT_SHIFT", arrays.OBJECT_SHIFT),
        ("rays/traverse.glsl", "LAST_PLANE", pack.LAST_PLANE),
        ("rays/traverse.glsl", "LEAF_BIT", pack.LEAF_BIT),
        ("rays/traverse.glsl", "FIRST_MASK", pack.MAX_TRIANGLES - 1),
        ("rays/traverse.glsl", "NO_NODE", pack.NO_CHILD),
    ],
)
def test_a_constant_is_its_twins(file: str, name: str, expected: float) -> None:
    assert np.float32(constant(file, name)) == np.float32(expected)


def test_a_leafs_triangle_count_lies_where_the_traversal_looks() -> None:
    assert f"(leaf >> {pack.FIRST_BITS}) & {pack.MAX_LEAF - 1}u) + 1u" in _FILES["rays/traverse.glsl"]


def test_the_diverging_map_has_the_legends_stops() -> None:
    stops = re.search(r"vec3 stops\[5\] = vec3\[\]\((.+?)\);", _FILES["lib/colormap.glsl"], re.DOTALL)
    assert stops
    numbers = [float(x) for x in re.findall(r"\d+\.\d+", stops[1])]
    assert (np.reshape(numbers, (5, 3)) == DIVERGING).all()


def test_every_kind_of_target_and_every_tone_curve_has_its_branch() -> None:
    """The last of each is the `#else`, or no curve at all for the first of the tone maps."""
    for shader, define, count in (("show", "SHOW", len(SHOW_KINDS)), ("display", "TONE_MAP", len(ToneMap))):
        branches = set(map(int, re.findall(rf"#(?:el)?if {define} == (\d+)", _FILES[f"output/{shader}.comp"])))
        assert branches == set(range(count)) - {count - 1 if define == "SHOW" else 0}


def test_the_largest_radiance_fits_the_targets_that_hold_it() -> None:
    assert constant("lib/finite.glsl", "LARGEST_RADIANCE") < np.finfo(np.float16).max


def test_no_constant_is_defined_twice_for_one_shader() -> None:
    """Two files of the library that name one thing twice would stop compiling as soon as a shader includes both."""
    owners: dict[str, str] = {}
    for file in sorted(f for f in _FILES if f.startswith(("lib/", "shared/", "rays/")) and f.endswith(".glsl")):
        for name in found(file):
            assert name not in owners, f"{name} stands in {owners[name]} and in {file}"
            owners[name] = file


def test_the_largest_kernel_that_can_be_asked_for_has_a_row() -> None:
    (rings,) = (leaf for path, leaf, _ in walk(Settings()) if path == "post.rings")
    assert max(rings.metadata["high"], hybrid.RECONSTRUCT_RINGS) <= MOST_RINGS
