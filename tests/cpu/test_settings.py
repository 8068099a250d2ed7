"""Settings: one definition per leaf, from which text, dictionaries and the history key follow without loss."""

from __future__ import annotations

import json
import math
import re
from dataclasses import Field, FrozenInstanceError
from enum import Enum
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.errors import BAD_INPUT, UserError
from app.optics import coc_scale_px
from app.settings import Settings, from_dict, history_key, parse, plain, put, to_dict, walk

LEAVES = {path: (leaf, value) for path, leaf, value in walk(Settings())}
EACH_LEAF = pytest.mark.parametrize("path", LEAVES)
UNITS = {"", "m", "px", "deg", "of height", "rays", "EV"}

#: Names that other tools call (DESIGN, section 7): renaming one breaks them.
CONTRACT = [
    "lens.aperture",
    "lens.focus_distance",
    "lens.blades",
    "lens.rotation",
    "lens.anamorphic",
    "lens.spherical_aberration",
    "rays.budget",
    "rays.max_per_pixel",
    "blend.hit_ratio",
    "blend.specular",
    "shading.mode",
    "shading.background",
]


def values(leaf: Field[Any]) -> st.SearchStrategy[Any]:
    """Every value that a leaf may take."""
    low, high, default = leaf.metadata["low"], leaf.metadata["high"], leaf.default
    if isinstance(default, bool):
        return st.booleans()
    if isinstance(default, Enum):
        return st.sampled_from(list(type(default)))
    if isinstance(default, tuple):
        return st.tuples(*[st.floats(low, high)] * len(default))
    return st.integers(low, high) if isinstance(default, int) else st.floats(low, high)


@st.composite
def all_settings(draw: st.DrawFn) -> Settings:
    settings = Settings()
    for path, (leaf, _) in LEAVES.items():
        settings = put(settings, path, draw(values(leaf)))
    return settings


def numbers(value: Any) -> tuple[float, ...]:
    """The numbers in a leaf's value; none for switches and choices."""
    parts = value if isinstance(value, tuple) else (value,)
    return tuple(x for x in parts if isinstance(x, (int, float)) and not isinstance(x, bool))


def one_sentence(error: UserError) -> str:
    text = str(error)
    assert text
    assert "\n" not in text
    assert error.exit_code == BAD_INPUT
    return text


@EACH_LEAF
def test_a_leaf_explains_itself(path: str) -> None:
    leaf, _ = LEAVES[path]
    assert re.fullmatch(r"[A-Za-z0-9].{10,}\.", leaf.metadata["doc"], re.DOTALL), "one sentence for the tooltip"
    assert leaf.metadata["unit"] in UNITS


@EACH_LEAF
def test_a_range_contains_its_default(path: str) -> None:
    leaf, default = LEAVES[path]
    low, high = leaf.metadata["low"], leaf.metadata["high"]
    assert (low is None) == (high is None) == (not numbers(default)), "numbers have a range, nothing else does"
    for number in numbers(default):
        assert math.isfinite(low)
        assert math.isfinite(high)
        assert low <= number <= high
    if leaf.metadata["log"]:
        assert low >= 0.0, "a logarithmic slider keeps to one sign; ImGui's reaches 0 itself past its smallest step"


@pytest.mark.parametrize("path", CONTRACT)
def test_promised_names_exist(path: str) -> None:
    assert path in LEAVES


@EACH_LEAF
@given(data=st.data())
def test_text_put_and_walk_round_trip(path: str, data: st.DataObject) -> None:
    leaf, _ = LEAVES[path]
    value = data.draw(values(leaf))
    shown = plain(value)
    text = ",".join(map(str, shown)) if isinstance(shown, list) else str(shown)
    parsed = parse(path, text, leaf)
    assert parsed == value
    assert type(parsed) is type(value)
    changed = put(Settings(), path, parsed)
    assert {p: v for p, _, v in walk(changed)} == {p: v for p, (_, v) in LEAVES.items()} | {path: value}


@given(settings=all_settings())
def test_dictionaries_round_trip_even_through_json(settings: Settings) -> None:
    assert from_dict(to_dict(settings)) == settings
    assert from_dict(json.loads(json.dumps(to_dict(settings)))) == settings


@EACH_LEAF
@given(data=st.data())
def test_history_key_changes_exactly_with_leaves_that_reset(path: str, data: st.DataObject) -> None:
    leaf, default = LEAVES[path]
    value = data.draw(values(leaf))
    changed = put(Settings(), path, value)
    assert (history_key(changed) == history_key(Settings())) == (value == default or not leaf.metadata["resets"])


def bad_texts(leaf: Field[Any]) -> list[str]:
    low, high, default = leaf.metadata["low"], leaf.metadata["high"], leaf.default
    bad = ["", "wide", "1e999999", "nan"]
    if isinstance(default, tuple):
        bad += ["1,2", "1,2,3,4", "nan,0,0", f"{high * 2 + 1},0,0", f"{low - 1},0,0", "inf,0,0"]
    elif numbers(default):
        bad += ["inf", "-inf", "0x10", "1,5", f"{high + abs(high) + 1}", f"{low - abs(low) - 1}"]
        bad += ["2.5"] if isinstance(default, int) else []
    return bad


@EACH_LEAF
def test_bad_text_is_one_sentence_that_names_the_option(path: str) -> None:
    leaf, _ = LEAVES[path]
    for text in bad_texts(leaf):
        with pytest.raises(UserError) as caught:
            parse(f"--{path}", text, leaf)
        assert f"--{path}" in one_sentence(caught.value)


@pytest.mark.parametrize("text", ["inf", "-inf", "nan", "1e999", "0", "-2", "1e7"])
def test_what_is_no_focus_distance_is_told_which_ones_there_are(text: str) -> None:
    """Infinity above all: its nearest is 1e6 m, from which it differs by K / 1e6, a tenth of a pixel at the most."""
    with pytest.raises(UserError, match=r"^--lens.focus_distance .*: give a value from 0.001 to 1e\+06$"):
        parse("--lens.focus_distance", text, LEAVES["lens.focus_distance"][0])
    assert coc_scale_px(LEAVES["lens.aperture"][0].metadata["high"], 2160, math.radians(1.0)) / 1e6 < 0.1


@pytest.mark.parametrize(
    "path", ["", "lens", "lens.", "lens.apertur", "nothing", "lens.aperture.x", ".", "rays.budget "]
)
def test_unknown_paths_are_one_sentence(path: str) -> None:
    with pytest.raises(UserError) as caught:
        from_dict({path: 1})
    assert repr(path) in one_sentence(caught.value)
    if path not in ("lens",):
        with pytest.raises(UserError):
            put(Settings(), path, 1)


@pytest.mark.parametrize("value", [None, {}, [], "x", {"a": 1}, [1, 2]])
def test_a_preset_with_the_wrong_kind_of_value_is_refused(value: Any) -> None:
    for path in ("lens.aperture", "lens.blades", "shading.background", "shading.mode", "post.median"):
        with pytest.raises(UserError) as caught:
            from_dict({path: value})
        assert path in one_sentence(caught.value)


def test_put_leaves_the_original_alone() -> None:
    settings = Settings()
    assert put(settings, "lens.aperture", 0.5).lens.aperture == 0.5
    assert settings == Settings()
    with pytest.raises(FrozenInstanceError):
        settings.lens.aperture = 1.0  # type: ignore[misc]


def test_settings_are_hashable_so_that_plans_can_be_cached() -> None:
    assert hash(Settings()) == hash(from_dict({}))


def test_base_is_kept_where_a_preset_is_silent() -> None:
    base = put(Settings(), "lens.blades", 7)
    assert from_dict({"lens.aperture": 0.2}, base).lens.blades == 7
