"""Presets: what is saved comes back, and a wrong file is one sentence that names it and what is wrong in it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.cli import main
from app.errors import BAD_INPUT, UserError
from app.frame.pipeline import VIEWS
from app.knob import qualities
from app.presets import OF_VIEWPOINT, Preset, is_preset, preset_of, read_preset, write_preset
from app.settings import Settings, put, to_dict, walk

from .test_settings import LEAVES, all_settings


@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(saved=all_settings(), before=all_settings(), view=st.sampled_from([None, *VIEWS, "coc"]))
def test_what_is_saved_comes_back_over_any_other_settings(
    saved: Settings, before: Settings, view: str | None, tmp_path: Path
) -> None:
    write_preset(tmp_path / "p.json", preset_of(saved, view))
    found = read_preset(tmp_path / "p.json")
    assert found.view == view
    assert found.applied(before) == saved
    assert [path.name for path in tmp_path.iterdir()] == ["p.json"]


def test_only_what_differs_is_written_and_the_viewpoints_own(tmp_path: Path) -> None:
    write_preset(tmp_path / "p.json", preset_of(put(Settings(), "rays.budget", 2.0), "hybrid"), {"by": "hand"})
    assert json.loads((tmp_path / "p.json").read_text()) == {
        "view": "hybrid",
        "settings": {"lens.aperture": 0.05, "lens.focus_distance": 2.0, "rays.budget": 2.0},
        "about": {"by": "hand"},
    }


def test_a_report_is_a_preset(tmp_path: Path) -> None:
    used = put(Settings(), "rays.budget", 2.0)
    (tmp_path / "r.json").write_text(json.dumps({"scene": "x", "view": "post", "settings": to_dict(used), "seed": 0}))
    assert read_preset(tmp_path / "r.json").applied(Settings()) == used


def test_a_preset_of_a_view_alone_has_all_settings_at_their_defaults(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "p.json"
    file.write_text('{"view": "post"}')
    assert is_preset(file)
    assert read_preset(file) == Preset("post")
    assert read_preset(file).applied(put(Settings(), "post.rings", 8)) == Settings()
    assert main(["plan", "still-life", "--preset", str(file)]) == 0
    assert capsys.readouterr().out.startswith("post of still-life")


def test_a_key_of_a_file_is_not_called_an_option(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "p.json"
    for value, rest in (('"big"', "'big': give a number"), ("7", "7: give a value from 0 to 1")):
        file.write_text(f'{{"settings": {{"lens.aperture": {value}}}}}')
        assert main(["plan", "still-life", "--preset", str(file)]) == BAD_INPUT
        assert f"preset {file}: lens.aperture {rest}" in capsys.readouterr().err


def test_a_preset_without_a_lens_leaves_focus_and_aperture_alone() -> None:
    before = put(put(Settings(), "lens.aperture", 0.3), "post.rings", 8)
    after = Preset(values={"rays.budget": 2.0}).applied(before)
    assert (after.lens.aperture, after.post.rings, after.rays.budget) == (0.3, 4, 2.0)
    assert set(OF_VIEWPOINT) < LEAVES.keys()


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("no JSON", "not JSON"),
        ("[" * 100000, "not JSON"),
        ("[]", '"settings"'),
        ('{"eye": [0, 0, 0], "target": [0, 0, 1]}', '"settings"'),
        ("{}", '"settings"'),
        ('{"settings": []}', '"settings"'),
        ('{"view": "post", "settings": null}', '"settings"'),
        ('{"view": null}', '"settings"'),
        ('{"settings": {"lens.colour": 1}}', "lens.colour"),
        ('{"settings": {"lens.aperture": "wide"}}', "lens.aperture"),
        ('{"settings": {"lens.aperture": NaN}}', "lens.aperture"),
        ('{"settings": {"post.rings": 1e99}}', "post.rings"),
        ('{"settings": {"post.rings": null}}', "post.rings"),
        ('{"settings": {}, "view": "shrap"}', "shrap"),
        ('{"settings": {}, "view": ["post"]}', "post"),
    ],
)
def test_a_wrong_file_is_one_sentence(
    text: str, named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "wrong.json"
    file.write_text(text)
    assert not is_preset(file)
    assert main(["plan", "still-life", "--preset", str(file)]) == BAD_INPUT
    error = capsys.readouterr().err
    assert len(error.splitlines()) == 1
    assert "wrong.json" in error
    assert named in error


@pytest.mark.parametrize("kind", ["missing", "folder", "binary"])
def test_what_is_no_file_of_text_is_one_sentence(kind: str, tmp_path: Path) -> None:
    file = tmp_path / kind
    if kind == "folder":
        file.mkdir()
    if kind == "binary":
        file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UserError, match=kind):
        read_preset(file)
    with pytest.raises(UserError, match="gone"):
        write_preset(tmp_path / "gone" / "p.json", Preset())


def test_options_win_over_the_preset_and_that_over_the_camera_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    camera, preset = tmp_path / "camera.json", tmp_path / "preset.json"
    camera.write_text('{"eye": [0, 1, 3], "target": [0, 1, 0], "focus_distance": 2.5, "aperture": 0.03}')
    preset.write_text('{"view": "post", "settings": {"lens.aperture": 0.02, "post.rings": 3}}')

    def planned(*more: str) -> list[str]:
        assert main(["plan", "still-life", "--camera", str(camera), "--preset", str(preset), *more]) == 0
        return capsys.readouterr().out.splitlines()

    lines = planned()
    assert lines[0].startswith("post of still-life")
    assert lines[0].endswith("aperture 0.02 m, focus 2.5 m")
    assert any("RINGS=3" in line for line in lines)
    lines = planned("--view", "hybrid", "--lens.aperture", "0.04", "--post.rings", "6")
    assert lines[0].startswith("hybrid of still-life")
    assert lines[0].endswith("aperture 0.04 m, focus 2.5 m")
    assert any("RINGS=6" in line for line in lines)


@pytest.mark.parametrize(("path", "values"), list(qualities(Settings())))
def test_values_worth_trying_are_allowed_distinct_and_hold_the_default(path: str, values: tuple[Any, ...]) -> None:
    leaf, default = LEAVES[path]
    assert len(set(values)) == len(values) > 1
    assert default in values
    assert all(type(value) is type(default) for value in values)
    low, high = leaf.metadata["low"], leaf.metadata["high"]
    assert low is None or all(low <= value <= high for value in values)
    if not isinstance(default, bool):
        assert list(values) in (sorted(values), sorted(values, reverse=True)), "cheapest first"


def test_the_settings_that_trade_accuracy_for_time_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert "rays.budget" in dict(qualities(Settings()))
    assert len(dict(qualities(Settings()))) < len(list(walk(Settings()))) / 2
    with pytest.raises(SystemExit):
        main(["plan", "--help"])
    assert "trades accuracy for time" in " ".join(capsys.readouterr().out.split())
