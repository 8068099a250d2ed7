"""Every pass of a frame: whether it runs and why, its cost or what leaving it out saves. What just changed flashes."""

from __future__ import annotations

from dataclasses import dataclass

from imgui_bundle import imgui

from ..gpu.purpose import purpose
from . import style
from .costs import muted
from .model import Cost, Request, Shown

FLASH_S = 1.5  # until a change has faded
FLASH = (0.35, 0.62, 0.90)  # the accent


@dataclass(frozen=True)
class Row:
    """One pass as it is listed. `ms`: its cost, or of a pass that does not run its saving; None: never measured."""

    name: str
    shader: str
    runs: bool
    reason: str
    ms: float | None

    @property
    def figure(self) -> str:
        """The milliseconds, signed as they count."""
        if self.ms is None:
            return ""
        return f"{self.ms if self.runs else -self.ms:.{1 if self.ms >= 100.0 else 2}f} ms"

    @property
    def why(self) -> str:
        """The reason, as a list tells it."""
        return self.reason if self.runs else f"skipped: {self.reason}"


def rows_of(cost: Cost, shown: Shown) -> list[Row]:
    """Of one view: first what runs, in order, then what is left out."""
    if cost.plan is None:
        return []
    times, saved = dict(cost.timings), {**cost.before, **shown.full_ms}
    runs = [Row(c.step.name, c.step.shader, True, c.reason, times.get(c.step.name)) for c in cost.plan.calls]
    return runs + [Row(left.name, left.shader, False, left.reason, saved.get(left.name)) for left in cost.plan.skipped]


class EffectsSection:
    """Remembers what ran when it was last asked, and when that changed."""

    def __init__(self) -> None:
        self._ran: dict[tuple[int, str], bool] = {}  # (side of the split screen, pass)
        self._changed_s: dict[tuple[int, str], float] = {}

    @property
    def fading(self) -> bool:
        """Whether a flash is still to be seen: the window draws on meanwhile."""
        return bool(self._changed_s)

    def draw(self, shown: Shown, requests: list[Request]) -> None:
        """Draw the section; what the user wants is added to `requests`."""
        now_s = imgui.get_time()
        listed = [rows_of(cost, shown) for cost in shown.costs]
        self._note(listed, now_s)
        rows = [row for of_side in listed for row in of_side]
        title = f"Active effects: {sum(row.runs for row in rows)} of {len(rows)} passes###effects"
        if not imgui.collapsing_header(title):
            return
        self._measure_button(shown, requests)
        for side, (cost, of_side) in enumerate(zip(shown.costs, listed, strict=True)):
            imgui.text_unformatted(cost.view)
            self._table(side, of_side, now_s)

    def _note(self, listed: list[list[Row]], now_s: float) -> None:
        """See what changed since the last frame. A side that was not shown then has nothing to compare with."""
        ran = {(side, row.name): row.runs for side, rows in enumerate(listed) for row in rows}
        changed = {key: now_s for key, runs in ran.items() if self._ran.get(key, runs) != runs}
        recent = {key: at for key, at in self._changed_s.items() if now_s - at < FLASH_S and key in ran}
        self._ran, self._changed_s = ran, {**recent, **changed}

    def _measure_button(self, shown: Shown, requests: list[Request]) -> None:
        if shown.measuring is not None:
            imgui.progress_bar(shown.measuring, imgui.ImVec2(-1.0, 0.0), "measuring")
            return
        if imgui.button("Measure savings", imgui.ImVec2(-1.0, 0.0)):
            requests.append(Request("measure savings"))
        imgui.set_item_tooltip("Draws this picture with every effect on, to see what each pass left out would cost")

    def _table(self, side: int, rows: list[Row], now_s: float) -> None:
        columns = imgui.TableFlags_.row_bg | imgui.TableFlags_.sizing_stretch_prop
        if not imgui.begin_table(f"effects {side}", 3, columns):
            return
        for name, share in (("pass", 0.41), ("ms", 0.20), ("why", 0.39)):
            imgui.table_setup_column(name, imgui.TableColumnFlags_.none, share)
        told = ""
        for row in rows:
            since_s = now_s - self._changed_s.get((side, row.name), -FLASH_S)
            self._draw_row(row, "as above" if row.why == told else row.why, since_s)
            told = row.why
        imgui.end_table()

    def _draw_row(self, row: Row, why: str, since_s: float) -> None:
        """One line; `since_s`: how long ago it changed. What the pass is for shows under the pointer."""
        imgui.table_next_row()
        if since_s < FLASH_S:
            color = imgui.get_color_u32(imgui.ImVec4(*FLASH, 0.7 * (1.0 - since_s / FLASH_S)))
            imgui.table_set_bg_color(imgui.TableBgTarget_.row_bg1, color)
        imgui.table_next_column()
        corner, width = imgui.get_cursor_screen_pos(), imgui.get_window_width()
        imgui.push_style_color(imgui.Col_.text, style.ACCENT if row.runs else style.MUTED)
        imgui.text_unformatted(row.name)
        imgui.pop_style_color()
        imgui.table_next_column()
        imgui.text_colored(imgui.get_style_color_vec4(imgui.Col_.text) if row.runs else style.MUTED, row.figure)
        imgui.table_next_column()
        muted(why)
        end = imgui.ImVec2(corner.x + width, imgui.get_cursor_screen_pos().y)
        if imgui.is_window_hovered() and imgui.is_mouse_hovering_rect(corner, end, False):
            _tell(f"{row.name}: {purpose(row.shader)}")


def _tell(text: str) -> None:
    """A tooltip of as many lines as it takes."""
    imgui.begin_tooltip()
    imgui.push_text_wrap_pos(style.TOOLTIP_EM * imgui.get_font_size())
    imgui.text_unformatted(text)
    imgui.pop_text_wrap_pos()
    imgui.end_tooltip()
