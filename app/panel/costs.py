"""What the frame cost and why: milliseconds by pass with source and device, and which passes ran or were left out."""

from __future__ import annotations

from imgui_bundle import imgui

from ..scene.validate import count
from . import style
from .memory import draw_memory
from .model import Cost, ProgramsShown, Shown


def draw_costs(shown: Shown) -> None:
    """Milliseconds per pass as a table with bars. Every figure stands beside its clock and device."""
    muted(f"{shown.timing_source}\n{shown.device}")
    for cost in shown.costs:
        total = sum(ms for _, ms in cost.timings)
        imgui.text_unformatted(
            f"{cost.view}: {total:.1f} ms in {len(cost.timings)} passes, {cost.size[0]} x {cost.size[1]} px"
        )
        if cost.timings and imgui.begin_table(
            f"ms {cost.view}", 3, imgui.TableFlags_.row_bg | imgui.TableFlags_.sizing_stretch_prop
        ):
            for name, ms in cost.timings:
                _row(name, ms, total)
            imgui.end_table()
        _health(cost)
    muted(f"whole frame with window: {shown.frame_ms:.1f} ms (wall clock)")
    draw_memory(shown)
    if shown.programs:
        muted(programs_line(shown.programs))


def programs_line(programs: ProgramsShown) -> str:
    """How many shader programs there are, and how many the next step can ask for."""
    begun = "" if programs.complete else " so far"
    rays = f", {programs.for_rays} more once rays are asked for" if programs.for_rays else ""
    return (
        f"{count(programs.kept, 'shader program')} of at most {programs.most}; "
        f"ready for the next step{begun}: {programs.ready}{rays}"
    )


def muted(text: str) -> None:
    """Wrapped text in the quiet colour."""
    imgui.push_style_color(imgui.Col_.text, style.MUTED)
    imgui.push_text_wrap_pos(0.0)
    imgui.text_unformatted(text)
    imgui.pop_text_wrap_pos()
    imgui.pop_style_color()


def _health(cost: Cost) -> None:
    """Whether any texel is what no pass should have made."""
    bad = {name: found for name, found in cost.health.items() if found}
    if not bad:
        muted(f"no bad texel in {len(cost.health)} targets")
    for name, found in bad.items():
        style.wrapped(f"{name}: {found.non_finite} texels not finite, {found.negative} negative", style.ERROR)


def _row(name: str, ms: float, total: float) -> None:
    imgui.table_next_row()
    imgui.table_next_column()
    imgui.text_unformatted(name)
    imgui.table_next_column()
    imgui.text_unformatted(f"{ms:8.2f} ms")
    imgui.table_next_column()
    imgui.progress_bar(ms / total if total > 0 else 0.0, imgui.ImVec2(-1.0, 0.8 * imgui.get_font_size()), "")
