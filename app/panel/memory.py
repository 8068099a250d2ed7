"""What is held on the GPU: the sum, and under the mouse what each texture holds and what sharing them saves."""

from __future__ import annotations

from imgui_bundle import imgui

from ..frame.memory import frame_memory, memory_sum, mib
from .model import Shown

MOST_LINES = 32  # of the tooltip, which is as high as a small window then


def draw_memory(shown: Shown) -> None:
    """One line, and the table as its tooltip."""
    imgui.text_unformatted(f"GPU memory: {mib(sum(shown.memory.values()))}")
    if imgui.begin_item_tooltip():
        for text in memory_table(shown):
            imgui.text_unformatted(text)
        imgui.end_tooltip()


def memory_table(shown: Shown) -> list[str]:
    """Lines: the largest of what is held, the largest first (targets that share a texture stand together); the rest in
    one; then each view's sum.
    """
    held = sorted(shown.memory.items(), key=lambda item: -item[1])
    lines = [f"{mib(size):>10}  {name}" for name, size in held[:MOST_LINES]]
    if rest := held[MOST_LINES:]:
        lines.append(f"{mib(sum(size for _, size in rest)):>10}  {len(rest)} others")
    drawn = [(cost, cost.plan) for cost in shown.costs if cost.plan is not None]
    return lines + [f"{cost.view}: {memory_sum(frame_memory(plan, cost.size))}" for cost, plan in drawn]
