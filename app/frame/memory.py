"""What a frame's targets and blocks take on the GPU, in bytes, known from its plan and size alone."""

from __future__ import annotations

from dataclasses import dataclass

from .lifetimes import Format, Slot, lifetimes, own_slots, shared_slots
from .pipeline import read_after
from .records import Buffer, FramePlan, Target
from .targets import BUFFERS

_BYTES = {"f1": 1, "f2": 2, "f4": 4, "depth": 4}  # of a component
Size = tuple[int, int]

MOST_REMEMBERED = 256  # plans: as many as there are views and targets, each still and moving
_SLOTS: dict[object, tuple[Slot, ...]] = {}


@dataclass(frozen=True)
class FrameMemory:
    """Bytes of a frame. `shared`: (targets, bytes) of each texture, those that hold several targets included."""

    targets: dict[str, int]  # of each by itself, histories included
    shared: tuple[tuple[tuple[str, ...], int], ...]
    blocks: dict[str, int]

    @property
    def total(self) -> int:
        """What the frame takes."""
        return sum(count for _, count in self.shared) + sum(self.blocks.values())

    @property
    def unshared(self) -> int:
        """What it would take if each target had storage of its own."""
        return sum(self.targets.values()) + sum(self.blocks.values())


def frame_slots(plan: FramePlan, share: bool) -> tuple[Slot, ...]:
    """The textures of a plan: as few as will do, or one for each value. Remembered: while a camera flies, plans change
    in their reasons alone.
    """
    calls = tuple((call.step.name, call.reads, call.writes, call.in_place) for call in plan.calls)
    key = calls, plan.output, share
    if key not in _SLOTS:
        if len(_SLOTS) >= MOST_REMEMBERED:
            _SLOTS.clear()
        _SLOTS[key] = (shared_slots if share else own_slots)(lifetimes(plan, read_after(plan)))
    return _SLOTS[key]


def frame_blocks(plan: FramePlan) -> tuple[str, ...]:
    """The storage blocks of a plan, sorted."""
    return tuple(sorted({name for call in plan.calls for name in (*call.step.fills, *call.step.takes)}))


def frame_memory(plan: FramePlan, size: Size) -> FrameMemory:
    """What a plan takes at a full resolution (width, height)."""
    alone: dict[str, int] = {}
    for slot in frame_slots(plan, share=False):
        name = slot.names[0]
        alone[name] = alone.get(name, 0) + format_bytes(slot.format, size)
    shared = tuple((slot.names, format_bytes(slot.format, size)) for slot in frame_slots(plan, share=True))
    return FrameMemory(alone, shared, {name: buffer_bytes(BUFFERS[name], size) for name in frame_blocks(plan)})


def memory_lines(plan: FramePlan, size: Size) -> list[str]:
    """The same as text: what each texture holds, what each target takes, and the sums."""
    memory = frame_memory(plan, size)
    lines = [f"{mib(count):>10}  {', '.join(names)}" for names, count in sorted(memory.shared, key=lambda s: -s[1])]
    lines += [f"{mib(count):>10}  {name} (block)" for name, count in memory.blocks.items()]
    return [*lines, memory_sum(memory)]


def memory_sum(memory: FrameMemory) -> str:
    """The sums in a sentence."""
    saved = 1.0 - memory.total / memory.unshared
    return (
        f"{mib(memory.total)} in {len(memory.shared)} textures for {len(memory.targets)} targets; "
        f"{mib(memory.unshared)} if none were shared ({100.0 * saved:.0f} % less)"
    )


def mib(count: int) -> str:
    """Bytes as MiB."""
    return f"{count / 2**20:.1f} MiB"


def scaled(size: Size, scale: int) -> Size:
    """Size at 1/scale, rounded up so that every full-resolution pixel is covered."""
    return -(-size[0] // scale), -(-size[1] // scale)


def texels(target: Target | Format, size: Size) -> Size:
    """Width and height of a target at a full resolution."""
    return target.fixed or scaled(size, target.scale)


def format_bytes(format: Format, size: Size) -> int:
    """Bytes of one texture at a full resolution."""
    width, height = texels(format, size)
    return width * height * format.components * _BYTES[format.dtype]


def buffer_bytes(buffer: Buffer, size: Size) -> int:
    """Bytes of a storage block at a full resolution."""
    width, height = scaled(size, buffer.scale)
    return buffer.header + buffer.bytes_per_pixel * width * height
