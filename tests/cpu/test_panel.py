"""The panel, drawn by Dear ImGui without a GPU: every setting, view and target draws, and nothing changes by itself."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pyglet
import pytest
from imgui_bundle import imgui

from app.camera import Camera, Viewpoint, write_viewpoint
from app.controls import BINDINGS
from app.frame.memory import frame_memory, memory_sum
from app.frame.pipeline import VIEWABLE, frame_plan
from app.frame.targets import TARGETS
from app.panel import style
from app.panel.input import UiInput, imgui_key
from app.panel.knobs import TITLES, describe, draw_knob, title
from app.panel.memory import MOST_LINES, memory_table
from app.panel.model import Cost, Look, Request, Shown
from app.panel.panel import MAX_SHARE, Panel
from app.panel.scenes import camera_files
from app.panel.views import value_range
from app.scene.facts import Facts
from app.scene.model import LoadReport
from app.settings import Settings, put, walk

SIZE = (1200.0, 4000.0)  # tall: nothing is clipped away


@contextmanager
def interface() -> Iterator[imgui.IO]:
    """ImGui with a font and a tall display, but nothing that draws."""
    imgui.create_context()
    io = imgui.get_io()
    io.set_ini_filename("")
    io.backend_flags |= imgui.BackendFlags_.renderer_has_textures
    io.display_size, io.delta_time = imgui.ImVec2(*SIZE), 1 / 60
    style.apply(1.0)
    yield io
    imgui.destroy_context()


@pytest.fixture
def ui() -> Iterator[imgui.IO]:
    with interface() as io:
        yield io


def shown() -> Shown:
    plan = frame_plan("hybrid", Settings(), Facts(near_coc_px=30.0, far_coc_px=40.0))
    timings = tuple((call.step.name, 1.5) for call in plan.calls)
    return Shown(
        device="a device",
        timing_source="wall clock",
        costs=(Cost("hybrid", plan, timings, 3, 256, (640, 360)),),
        scene="still-life",
        report=LoadReport("file", 10, 20, 1, ("a note.",), 0.1),
        viewpoints=(Viewpoint(Camera(), 1.0, 0.1, "front"),),
        memory={"depth": 1 << 20},
        load_error="that file is no scene",
        preset_error="that file is no preset",
        advising=True,
        advice="search: 3 of at most 48 candidates",
        shader_error="dof/gather.comp:12: syntax error",
        message="saved",
        loading=("reading", 0.5),
    )


def frame(panel: Panel, look: Look, what: Shown, size: tuple[float, float] = SIZE) -> tuple[Look, list[Request]]:
    imgui.new_frame()
    result = panel.draw(look, what, size)
    imgui.render()
    return result


def draw(panel: Panel, look: Look, what: Shown, size: tuple[float, float] = SIZE) -> Look:
    look, requests = frame(panel, look, what, size)
    assert requests == []
    return look


@pytest.mark.parametrize("view", ["sharp", "hybrid", *VIEWABLE])
def test_drawing_changes_nothing_by_itself(ui: imgui.IO, view: str) -> None:
    panel, look = Panel(), Look(view=view, other="depth", compare=True, help=True)
    for _ in range(3):
        assert draw(panel, look, shown()) == look


def test_memory_is_listed_by_texture_and_summed_up_by_view() -> None:
    plan = frame_plan("sharp", Settings(), Facts(near_coc_px=9.0, far_coc_px=9.0))
    memory = {f"target {i}": (100 - i) << 20 for i in range(MOST_LINES + 3)} | {"half_color, trace_near": 500 << 20}
    costs = (Cost("sharp", plan, size=(1920, 1080)), Cost("post"))
    lines = memory_table(Shown(memory=memory, costs=costs))
    assert lines[0] == " 500.0 MiB  half_color, trace_near"
    left_out = sum(100 - i for i in range(MOST_LINES - 1, MOST_LINES + 3))
    assert lines[MOST_LINES] == f" {left_out}.0 MiB  4 others"
    assert lines[MOST_LINES + 1 :] == [f"sharp: {memory_sum(frame_memory(plan, (1920, 1080)))}"]
    assert memory_table(Shown()) == []


def help_window() -> imgui.internal.Window:
    return imgui.internal.find_window_by_name("##help")


@pytest.mark.parametrize("panel_shown", [True, False])
@pytest.mark.parametrize("density", [1.0, 1.5, 2.0])
@pytest.mark.parametrize(
    "size", [(640.0, 480.0), (800.0, 600.0), (900.0, 600.0), (1260.0, 600.0), (1320.0, 540.0), (2000.0, 1000.0)]
)
def test_the_help_lies_within_the_window(size: tuple[float, float], density: float, panel_shown: bool) -> None:
    with interface() as io:
        imgui.get_style().font_scale_dpi = density
        io.display_size = imgui.ImVec2(*size)
        panel = Panel()
        for _ in range(4):
            draw(panel, Look(help=True, panel=panel_shown), Shown(), size)
        box = help_window()
        assert box.pos.x >= 0
        assert box.pos.y >= 0
        assert box.pos.x + box.size.x <= size[0]
        assert box.pos.y + box.size.y <= size[1]
        assert box.content_size.x <= box.inner_rect.get_width(), "no line is cut off at its right"
        if density == 1.0:
            assert not box.scrollbar_x
            assert box.scroll_max.y == 0.0 or size[1] < 600.0
        left, _, width, _ = panel.picture(size)
        if density == 1.0 and width >= 640.0:
            assert left <= box.pos.x <= box.pos.x + box.size.x <= left + width, "it hides none of the panel"


@pytest.mark.parametrize("size", [(320.0, 180.0), (1.0, 1.0), (5000.0, 40.0)])
def test_no_window_is_too_small(ui: imgui.IO, size: tuple[float, float]) -> None:
    ui.display_size = imgui.ImVec2(*size)
    panel = Panel()
    for _ in range(3):
        draw(panel, Look(help=True), shown(), size)
    x, y, width, height = panel.picture(size)
    assert x == y == 0.0
    assert width >= 1.0
    assert height >= 1.0


def test_a_window_that_was_small_for_a_while_gets_its_panel_back(ui: imgui.IO) -> None:
    panel, look = Panel(), Look()
    for _ in range(3):
        draw(panel, look, shown())
    width = panel.width
    for size in ((501.0, 300.0), (1.0, 1.0), (301.0, 300.0), SIZE):
        ui.display_size = imgui.ImVec2(*size)
        for _ in range(3):
            draw(panel, look, shown(), size)
        assert panel.width <= max(MAX_SHARE * size[0], imgui.get_style().window_min_size.x)
    assert panel.width == width


def test_the_panel_stands_beside_the_picture_and_can_be_hidden(ui: imgui.IO) -> None:
    panel = Panel()
    draw(panel, Look(), shown())
    assert panel.width > 200.0
    assert panel.picture(SIZE)[2] == SIZE[0] - panel.width
    draw(panel, Look(panel=False), shown())
    assert panel.picture(SIZE)[2] == SIZE[0]


@pytest.mark.parametrize("path", [path for path, _, _ in walk(Settings())])
def test_every_setting_draws_at_its_ends_and_keeps_its_value(ui: imgui.IO, path: str) -> None:
    leaf = {p: leaf for p, leaf, _ in walk(Settings())}[path]
    low, high = leaf.metadata["low"], leaf.metadata["high"]
    ends = [low, high] if low is not None and not isinstance(leaf.default, tuple) else []
    for value in [leaf.default, *(type(leaf.default)(end) for end in ends)]:
        settings = put(Settings(), path, value)
        imgui.new_frame()
        imgui.begin("knob")
        assert draw_knob(settings, path, leaf, value) == settings
        imgui.end()
        imgui.render()


def clicked_at(height: float) -> Look:
    """What is wanted after a click near the panel's left edge, made as a person does: move, press, release."""
    with interface():
        panel, look, source = Panel(), Look(view="hybrid"), UiInput()
        draw(panel, look, Shown())
        source.pointer(SIZE[0] - panel.width + 30.0, height)
        draw(panel, look, Shown())
        for down in (True, False):
            source.button("left", down)
            look = draw(panel, look, Shown())
        return look


def test_a_click_on_a_view_button_chooses_it() -> None:
    """The first button of the row is looked for by its height, since fonts differ."""
    views = {clicked_at(height).view for height in range(40, 140, 8)}
    assert views == {"hybrid", "sharp"}


def test_a_typed_path_and_enter_ask_for_that_scene() -> None:
    """The path's field is looked for by its height, like the button above."""
    asked = set()
    for height in range(140, 280, 8):
        with interface():
            panel, look, source = Panel(), Look(), UiInput()
            draw(panel, look, Shown())
            source.pointer(SIZE[0] - panel.width + 30.0, height)
            for down in (True, False):
                source.button("left", down)
                draw(panel, look, Shown())
            requests: list[Request] = []
            for character in "~/a b.glb":
                source.text(character)
                look, found = frame(panel, look, Shown())
                requests += found
            for down in (True, False):
                source.key("return", down)
                look, found = frame(panel, look, Shown())
                requests += found
            asked |= set(requests)
    assert asked == {Request("load", "~/a b.glb")}


def test_a_new_group_of_settings_gets_a_readable_title() -> None:
    assert title("new_group") == "New group"
    assert {path.partition(".")[0] for path, _, _ in walk(Settings())} >= TITLES.keys()


def test_values_read_as_a_person_writes_them() -> None:
    assert describe(0.05, "m") == "0.05 m"
    assert describe(True, "") == "on"
    assert describe((0.5, 0.6, 0.7), "") == "0.5, 0.6, 0.7"
    assert describe(Settings().shading.mode, "") == "lit"


def test_the_viewer_uses_the_settings_range_or_the_targets_own() -> None:
    target = TARGETS["coc"]
    assert value_range(target, Settings()) == target.range
    settings = put(put(Settings(), "overlay.range_low", -3.0), "overlay.range_high", 5.0)
    assert value_range(target, settings) == (-3.0, 5.0)


def test_every_bound_key_and_every_key_of_a_keyboard_reaches_imgui() -> None:
    pyglet.options["shadow_window"] = False  # else importing the key names asks for a display
    from pyglet.window import key

    letters = [chr(code) for code in range(ord("a"), ord("z") + 1)]
    digits = [f"_{digit}" for digit in range(10)] + [f"num_{digit}" for digit in range(10)]
    named = [
        name.lower()
        for name in [
            "LSHIFT",
            "RSHIFT",
            "LCTRL",
            "RCTRL",
            "LALT",
            "RALT",
            "LEFT",
            "RIGHT",
            "UP",
            "DOWN",
            "PAGEUP",
            "PAGEDOWN",
            "HOME",
            "END",
        ]
    ]
    named += [
        "insert",
        "delete",
        "backspace",
        "return",
        "tab",
        "space",
        "escape",
        "num_enter",
        "bracketleft",
        "bracketright",
        "grave",
        "minus",
        "equal",
    ]
    for name in [*letters, *digits, *named, *(k for binding in BINDINGS for k in binding.keys)]:
        assert imgui_key(name) is not None, name
    for name in named:
        spoken = key.symbol_string(getattr(key, name.upper())).lower()  # pyglet has two names for some keys
        assert imgui_key(spoken) == imgui_key(name)
    for name in (k for binding in BINDINGS for k in binding.keys):
        assert key.symbol_string(getattr(key, name.upper())).lower() == name
    assert imgui_key("no such key") is None


def test_modifiers_follow_the_keys_and_focus_loss_releases_them(ui: imgui.IO) -> None:
    source, panel = UiInput(), Panel()
    source.key("rctrl", True)
    draw(panel, Look(), shown())
    assert ui.key_ctrl
    source.focus(False)
    for _ in range(2):
        draw(panel, Look(), shown())
    assert not ui.key_ctrl


def test_camera_files_beside_a_scene_are_found_best_first(tmp_path: Path) -> None:
    scene = tmp_path / "room.glb"
    scene.write_bytes(b"")
    for name in ("attic", "room_plant", "room"):
        write_viewpoint(tmp_path / f"{name}.json", Viewpoint(Camera(), 1.0, 0.1))
    (tmp_path / "package.json").write_text("{}")
    assert [view.name for view in camera_files(scene)] == ["room", "room_plant", "attic"]
    assert camera_files(tmp_path / "missing.glb") == ()
