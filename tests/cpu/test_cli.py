"""The command line as its callers meet it: exit codes, one sentence on stderr, no traceback, help that lists
everything.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from app.cli import COMMANDS, main, parser
from app.errors import BAD_INPUT, NO_GRAPHICS, UserError
from app.frame.pipeline import VIEWS
from app.scene.gallery import SCENES
from app.settings import Settings, walk

from .gltf_maker import CORNERS, Maker

ROOT = Path(__file__).parents[2]
LEAVES = [path for path, _, _ in walk(Settings())]


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "app", *arguments], cwd=ROOT, capture_output=True, text=True, timeout=60, check=False
    )


def spaced(text: str) -> str:
    """With a single space between words."""
    return " ".join(text.split())


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line on stderr of a command that exits with 2 and prints nothing else."""
    assert main(arguments) == BAD_INPUT
    captured = capsys.readouterr()
    assert captured.out == ""
    lines = captured.err.splitlines()
    assert len(lines) == 1, captured.err
    assert lines[0].startswith("hybrid-dof: ")
    return lines[0]


def test_it_runs_as_a_program() -> None:
    done = run("scenes")
    assert (done.returncode, done.stderr) == (0, "")
    assert all(scene.name in done.stdout for scene in SCENES)


def test_a_failing_program_says_one_line_and_exits_2() -> None:
    done = run("info", "no-such-scene.glb")
    assert (done.returncode, done.stdout) == (BAD_INPUT, "")
    assert len(done.stderr.splitlines()) == 1
    assert "no-such-scene.glb" in done.stderr


@pytest.mark.parametrize("command", ["info", "plan"])
def test_a_scene_scaled_to_nothing_is_refused(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its meshes hold triangles, its only node leaves none of them."""
    maker = Maker()
    maker.node(mesh=maker.mesh(maker.primitive(maker.accessor(CORNERS))), scale=[0, 0, 0])
    path = maker.write(tmp_path / "nothing.glb")
    assert "nothing.glb places no triangle that could be drawn" in refused(capsys, command, str(path))


def test_debug_adds_the_traceback() -> None:
    done = run("info", "no-such-scene.glb", "--debug")
    assert done.returncode == BAD_INPUT
    assert "Traceback" in done.stderr
    assert done.stderr.splitlines()[-1].startswith("hybrid-dof: ")


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_reader_that_goes_away_is_no_error(unbuffered: str) -> None:
    """`hybrid-dof scenes | head -0`: whether the pipe breaks at the first line or at the last flush."""
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [sys.executable, "-m", "app", "scenes"], cwd=ROOT, stdout=writer, stderr=subprocess.PIPE, text=True, timeout=60,
        check=False, env=os.environ | {"PYTHONUNBUFFERED": unbuffered},
    )  # fmt: skip
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main([command, "--help"])
    assert caught.value.code == 0
    out = capsys.readouterr().out
    assert out.startswith(f"usage: hybrid-dof {command}")
    if command in ("view", "shot", "plan", "tune"):
        assert all(f"--{path}" in out for path in LEAVES)
        assert "--preset" in out
    if command in ("view", "shot", "plan"):
        assert all(view in out for view in VIEWS)


@pytest.mark.parametrize("argument", ["--help", "--version"])
def test_the_program_itself_has_help_and_a_version(argument: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main([argument])
    assert caught.value.code == 0
    assert capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("shot", "still-life", "-o", "x.png", "--lens.aperture", "wide"), "--lens.aperture"),
        (("shot", "still-life", "-o", "x.png", "--lens.aperture", "-1"), "--lens.aperture"),
        (("plan", "still-life", "--lens.blades", "2.5"), "--lens.blades"),
        (("plan", "still-life", "--shading.background", "1,2"), "--shading.background"),
        (("plan", "still-life", "--shading.mode", "glossy"), "--shading.mode"),
        (("plan", "still-life", "--lens.apertur"), "--lens.apertur"),
        (("plan", "still-life", "--lens.colour", "3"), "--lens.colour"),
        (("plan", "still-life", "--view", "nonsense"), "nonsense"),
        (("plan", "still-life", "--view", "display"), "display"),
        (("plan", "still-life", "--lens.aperture", "0", "--view", "mask"), "the aperture is 0"),
        (("plan", "still-life", "--size", "640"), "--size"),
        (("plan", "still-life", "--size", "0x480"), "--size"),
        (("plan", "still-life", "--size", "640x-480"), "--size"),
        (("plan", "still-life", "--size", "axb"), "--size"),
        (("plan", "still-life", "--size", "²x3"), "--size"),
        (("plan", "still-life", "--camera", "nowhere.json"), "nowhere.json"),
        (("plan", "nowhere.glb"), "nowhere.glb"),
        (("plan", "nowhere"), "nowhere"),
        (("plan",), "scene"),
        (("info", "nowhere.gltf"), "nowhere.gltf"),
        (("shot", "still-life"), "-o"),
        (("shot", "still-life", "-o", "x.bmp"), "x.bmp"),
        (("shot", "still-life", "-o", "no/such/folder/x.png"), "no/such/folder"),
        (("shot", "still-life", "-o", "x.png", "--frames", "0"), "--frames"),
        (("shot", "still-life", "-o", "x.png", "--spp", "-3"), "--spp"),
        (("shot", "still-life", "-o", "x.png", "--spp", "many"), "--spp"),
        (("shot", "still-life", "-o", "x.png", "--seed", "x"), "--seed"),
        (("shot", "toy-train", "-o", "x.png", "--time", "noon"), "--time"),
        (("shot", "toy-train", "-o", "x.png", "--time", "nan"), "--time"),
        (("shot", "toy-train", "-o", "x.png", "--fps", "0"), "--fps"),
        (("plan", "toy-train", "--fps", "25"), "--fps"),
        (("shot", "still-life", "-o", "x.png", "--seed", "-1"), "--seed"),
        (("shot", "still-life", "-o", "x.png", "--seed", "4294967296"), "--seed"),
        (("tune", "still-life"), "--error"),
        (("tune", "still-life", "--error", "0.1", "--ms", "9"), "--ms"),
        (("tune", "still-life", "--error", "little"), "--error"),
        (("tune", "still-life", "--error", "0"), "--error"),
        (("tune", "still-life", "--ms", "nan"), "--ms"),
        (("tune", "still-life", "--ms", "inf"), "--ms"),
        (("tune", "still-life", "--ms", "9", "--views", "post,shrap"), "shrap"),
        (("tune", "still-life", "--ms", "9", "--views", "reference"), "reference"),
        (("tune", "still-life", "--ms", "9", "--views", ""), "--views"),
        (("tune", "still-life", "--ms", "9", "--metric", "ssim"), "--metric"),
        (("tune", "still-life", "--ms", "9", "--region", "edges"), "--region"),
        (("tune", "still-life", "--ms", "9", "--spp", "3"), "--spp"),
        (("tune", "still-life", "--ms", "9", "--steps", "0"), "--steps"),
        (("tune", "still-life", "--ms", "9", "--view", "post"), "--view"),
        (("tune", "still-life", "--ms", "9", "-o", "preset.png"), "preset.png"),
        (("tune", "still-life", "--ms", "9", "-o", "no/such/folder/p.json"), "no/such/folder"),
        (("tune", "still-life", "--ms", "9", "--preset", "nowhere.json"), "nowhere.json"),
        (("tune", "still-life", "--ms", "9", "--post.rings", "99"), "--post.rings"),
        (("scenes", "surplus"), "surplus"),
        (("--nonsense",), "--nonsense"),
    ],
)
def test_bad_input_is_one_sentence_that_names_it(
    arguments: tuple[str, ...],
    named: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert named in refused(capsys, *arguments)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("value", ["-1", "nan", "inf", "-inf", "1e400", ""])
@pytest.mark.parametrize("path", ["lens.aperture", "lens.focus_distance"])
def test_a_lens_that_cannot_be_is_refused_by_the_command_and_by_a_camera_file(
    path: str, value: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert f"--{path}" in refused(capsys, "plan", "still-life", f"--{path}={value}")
    file, key = tmp_path / "camera.json", path.removeprefix("lens.")
    file.write_text(f'{{"eye": [0, 1, 3], "target": [0, 1, 0], "{key}": "{value}"}}')
    assert key in refused(capsys, "plan", "still-life", "--camera", str(file))


@pytest.mark.parametrize("fov", ["0", "-45", "180", "1e-9", "NaN", "Infinity", "null"])
def test_a_camera_file_without_a_field_of_view_is_refused(
    fov: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "camera.json"
    file.write_text(f'{{"eye": [0, 1, 3], "target": [0, 1, 0], "fov_y_deg": {fov}}}')
    assert str(file) in refused(capsys, "plan", "still-life", "--camera", str(file))


@pytest.mark.parametrize("path", LEAVES)
def test_every_setting_is_an_option_that_is_checked(path: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert f"--{path}" in refused(capsys, "plan", "still-life", f"--{path}", "certainly not")
    options = parser().parse_args(["plan", "still-life", f"--{path}", "1"])
    assert getattr(options, path) == "1"


def test_a_plan_prints_what_runs_what_does_not_and_why(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "still-life", "--view", "hybrid", "--size", "320x180"]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    lines = captured.out.splitlines()
    assert lines[0].startswith("hybrid of still-life at 320x180")
    runs, skips = ([line.split() for line in lines if line.startswith(f"  {verb}")] for verb in ("runs", "skips"))
    assert {"gbuffer", "lighting", "trace", "composite", "display"} <= {words[1] for words in runs}
    assert {"traced", "reference"} <= {words[1] for words in skips}
    assert all(len(words) > 3 for words in (*runs, *skips)), "each with its reason"


def test_a_plan_says_what_each_pass_is_for(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "still-life", "--explain"]) == 0
    _, said = capsys.readouterr().out.split("what each is for:\n")
    told = dict(line.split(maxsplit=1) for line in said.splitlines() if line.startswith("  ") and " MiB " not in line)
    assert told["edge_tiles"].startswith("Lists the tiles")
    assert {"gbuffer", "motion", "traced"} <= told.keys(), "those that do not run, too"


@pytest.mark.parametrize("view", ["motion", "gradient"])
def test_what_only_runs_to_be_looked_at_says_so(capsys: pytest.CaptureFixture[str], view: str) -> None:
    assert main(["plan", "still-life", "--view", view]) == 0
    assert f"runs {view} it is what was asked for" in spaced(capsys.readouterr().out)


def test_an_unlit_plan_asks_for_nothing_of_lights(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "still-life", "--shading.mode", "unlit"]) == 0
    out = capsys.readouterr().out
    assert not {"LIT=1", "SUN=1", "POINT_LIGHTS=1", "SHADOWS=1", "NORMAL_MAPPED=1"} & {*out.split()}


def test_a_plan_tells_which_blur_the_post_process_cuts_only_where_it_does(capsys: pytest.CaptureFixture[str]) -> None:
    for lens, cut in (("--lens.aperture=0", False), ("--lens.aperture=0.02", False), ("--lens.aperture=0.2", True)):
        assert main(["plan", "still-life", "--size", "320x180", lens]) == 0
        assert ("post.max_coc" in capsys.readouterr().out) == cut, lens


def test_the_plan_of_a_scene_that_moves_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "toy-train"]) == 0
    out = capsys.readouterr().out
    assert "runs motion objects move; HAS_OBJECT=1 OBJECTS=1" in spaced(out)
    assert "OBJECTS=1" in next(line for line in out.splitlines() if line.startswith("  runs   trace"))
    assert main(["plan", "still-life"]) == 0
    out = capsys.readouterr().out
    assert "skips motion nothing moves" in spaced(out)
    assert "OBJECTS" not in out


def test_info_says_what_moves(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "toy-train"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[1] for line in lines if line.startswith("  moves: ")] == [
        "wind",
        "wind",
        "train,",
        "axle",
        "axle",
    ]
    assert all(line.endswith(" m, every 8 s") for line in lines if line.startswith("  moves: "))


def test_plan_and_info_tell_what_frames_take(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "still-life", "--view", "post", "--size", "640x360"]) == 0
    lines = capsys.readouterr().out.splitlines()
    listed = lines[lines.index("memory of the frame, targets that share a texture together:") + 1 :]
    total, unshared = (float(x) for x in re.findall(r"([\d.]+) MiB", listed[-1]))
    assert f"{640 * 360 * 16 / 2**20:.1f} MiB  resolved" in listed[0]
    assert sum(float(line.split()[0]) for line in listed[:-1]) == pytest.approx(total, abs=0.05 * len(listed))
    assert total < unshared
    assert main(["plan", "still-life", "--view", "post", "--size", "1280x720"]) == 0
    assert float(re.findall(r"([\d.]+) MiB", capsys.readouterr().out)[-2]) == pytest.approx(4.0 * total, rel=0.01)
    assert main(["info", "still-life"]) == 0
    told = re.findall(r"^  (\w+) at 1920x1080: ([\d.]+) MiB, in motion ([\d.]+) MiB$", capsys.readouterr().out, re.M)
    assert [view for view, *_ in told] == list(VIEWS)
    taken = {view: float(still) for view, still, _ in told}
    assert taken["traced"] < taken["sharp"] < taken["post"] < taken["hybrid"]
    assert all(float(still) <= float(moving) for _, still, moving in told)


def test_a_pinholes_plan_says_that_it_is_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "still-life", "--lens.aperture", "0"]) == 0
    assert "skips gather the aperture is 0, a pinhole: everything is sharp" in spaced(capsys.readouterr().out)


def test_an_option_wins_over_the_camera_file(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "camera.json"
    file.write_text('{"eye": [0, 1, 3], "target": [0, 1, 0], "focus_distance": 2.5, "aperture": 0.03}')
    assert main(["plan", "still-life", "--camera", str(file)]) == 0
    assert "aperture 0.03 m, focus 2.5 m" in capsys.readouterr().out.splitlines()[0]
    assert main(["plan", "still-life", "--camera", str(file), "--lens.aperture", "0.01"]) == 0
    assert "aperture 0.01 m, focus 2.5 m" in capsys.readouterr().out.splitlines()[0]


def test_plan_lists_the_programs_of_a_frame_and_of_the_next_step(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(("plan", "toy-train", "--view", "sharp", "--programs")) == 0
    lines = capsys.readouterr().out.splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("shader programs: "))
    now, next_step = map(int, re.findall(r"(\d+) (?:in this frame|within one step)", lines[head]))
    rows = [line.split() for line in lines[head + 2 : next(k for k in range(head, len(lines)) if "memory" in lines[k])]]
    assert now == sum(int(row[1]) for row in rows) > 0
    assert next_step == sum(int(row[2]) for row in rows) > now
    assert {row[0] for row in rows if int(row[1])} == {
        "raster/gbuffer", "raster/motion.comp", "raster/lighting.comp", "output/resolve.comp", "output/display.comp",
    }  # fmt: skip
    assert "rays/trace.comp" in {row[0] for row in rows}


@pytest.mark.parametrize("command", ["plan", "info"])
def test_a_folder_is_called_one_and_scenes_without_a_file_are_told_of(
    command: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    told = refused(capsys, command, str(tmp_path))
    assert f"{tmp_path} is a folder" in told
    assert "stress:" in told
    assert "stress:" in refused(capsys, command, "nowhere")


def test_a_scene_without_a_name_is_told_as_that(capsys: pytest.CaptureFixture[str]) -> None:
    told = refused(capsys, "info", "")
    assert "empty" in told
    assert ": . " not in told


@pytest.mark.parametrize("size", ["-4x5", "4x-5", "0x0", "-.5x3", "-infx3"])
def test_a_size_of_less_than_nothing_is_told_like_one_of_nothing(size: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert f"argument --size: {size!r} is not a size such as 1280x720" in refused(
        capsys, "plan", "still-life", "--size", size
    )


def test_a_negative_number_is_a_value_however_it_is_written(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "still-life", "--lens.rotation", "-1e1", "--view", "sharp"]) == 0
    capsys.readouterr()
    assert "from 0 to 100" in refused(capsys, "plan", "still-life", "--shading.background", "-1,0,0")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("frobnicate",), "frobnicate"),
        (("view", "nix.obj"), "nix.obj"),
        (("view", "stress:nix"), "nix"),
        (("view", "nix.obj", "--camera", "nix.json"), "nix.json"),
        (("view", "--view", "shrap"), "shrap"),
        (("shot", "nix.obj", "-o", "x.png"), "nix.obj"),
        (("shot", "still-life", "-o", "x.png", "--view", "shrap"), "shrap"),
        (("shot", "still-life", "-o", "x.png", "--camera", "nix.json"), "nix.json"),
        (("tune", "nix.obj", "--ms", "9"), "nix.obj"),
        (("tune", "still-life", "--ms", "9", "--camera", "nix.json"), "nix.json"),
        (("bench", "nix.obj", "-o", "results"), "nix.obj"),
        (("plan", "nix.obj", "--measure"), "nix.obj"),
    ],
)
def test_arguments_are_checked_before_display_and_driver(
    arguments: tuple[str, ...],
    named: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    def no_driver() -> None:
        raise UserError("no OpenGL", NO_GRAPHICS)

    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr("app.gpu.context.headless_context", no_driver)
    assert named in refused(capsys, *arguments)


def test_what_lacks_nothing_but_a_display_is_told_so(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    assert main(["still-life"]) == NO_GRAPHICS
    assert "hybrid-dof shot" in capsys.readouterr().err
