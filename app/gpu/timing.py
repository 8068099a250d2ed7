"""Milliseconds per pass, from a source that was tested first.

GPU time queries are read a few frames late so that nothing waits. Some drivers return nonsense (a software rasteriser
reports a nanosecond for a tenth of a second of compute), so at start-up a known load is timed both ways; where they
disagree the wall clock around a finished pass is used instead, and every figure is shown with its source.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

import moderngl
import numpy as np

GPU_TIMER = "GPU timer"
WALL_CLOCK = "wall clock after glFinish"

RING = 4  # frames until a query is read: more than any driver queues
KEPT = 64  # frames whose times are kept, for the median
AGREEMENT = 2.0  # the two clocks may differ by this factor on the test load: launch overhead, not nonsense
ENOUGH_MS = 2.0  # the test load is grown until the wall clock sees this much: well above its own granularity

_LOAD = """#version 430 core
layout(local_size_x = 64) in;
layout(std430) buffer Result { float result[]; };
uniform uint rounds;
void main() {
    float x = float(gl_GlobalInvocationID.x);
    for (uint i = 0u; i < rounds; ++i) x = fract(sin(x) * 43758.5 + float(i));
    result[gl_GlobalInvocationID.x] = x;
}"""


def spare_queries(ctx: moderngl.Context) -> list[moderngl.Query]:
    """Queries of the context that nobody uses: moderngl cannot release one, so none is thrown away."""
    if ctx.extra is None:
        ctx.extra = []
    return ctx.extra  # type: ignore[no-any-return]


def take_query(ctx: moderngl.Context) -> moderngl.Query:
    """A spare query, or a new one."""
    spare = spare_queries(ctx)
    return spare.pop() if spare else ctx.query(time=True)


def choose_source(timed_by_query_ms: float, timed_by_clock_ms: float) -> str:
    """GPU_TIMER if the query is believable beside the wall clock, else WALL_CLOCK."""
    believable = timed_by_clock_ms / AGREEMENT <= timed_by_query_ms <= timed_by_clock_ms * AGREEMENT
    return GPU_TIMER if believable else WALL_CLOCK


def self_test(ctx: moderngl.Context) -> tuple[str, float, float]:
    """(source to use, query ms, wall-clock ms) of one known compute load."""
    shader = ctx.compute_shader(_LOAD)
    result = ctx.buffer(reserve=64 * 256 * 4)
    result.bind_to_storage_buffer(0)
    query = take_query(ctx)
    rounds = 64
    try:
        while True:
            shader["rounds"] = rounds
            ctx.finish()
            begin = time.perf_counter()
            with query:
                shader.run(256)
            ctx.finish()
            clock_ms = (time.perf_counter() - begin) * 1e3
            if clock_ms >= ENOUGH_MS or rounds >= 1 << 20:
                query_ms = query.elapsed / 1e6
                return choose_source(query_ms, clock_ms), query_ms, clock_ms
            rounds *= 4
    finally:
        spare_queries(ctx).append(query)
        shader.release()
        result.release()


class Profiler:
    """Times the passes of each frame. Costs nothing while `enabled` is False; with the wall clock each pass is finished
    before the next.
    """

    def __init__(self, ctx: moderngl.Context, source: str | None = None) -> None:
        self._ctx = ctx
        self.source = source or self_test(ctx)[0]
        self.enabled = True
        self._frame = 0
        self._queries: dict[str, list[moderngl.Query | None]] = {}
        self._kept: dict[str, deque[float]] = {}
        self._length = KEPT
        self.before_ms: dict[str, float] = {}  # by pass, when it last ran under another plan

    def forget(self) -> None:
        """Nothing measured so far says anything: another scene, or another size."""
        self.reset()
        self.before_ms.clear()

    @contextmanager
    def scope(self, name: str) -> Iterator[None]:
        """Time what runs inside under `name`. Scopes do not nest."""
        if not self.enabled:
            yield
        elif self.source == GPU_TIMER:
            ring = self._queries.setdefault(name, [None] * RING)
            slot = self._frame % RING
            if (query := ring[slot]) is None:
                query = ring[slot] = take_query(self._ctx)
            else:
                self._keep(name, query.elapsed / 1e6)
            with query:
                yield
        else:
            begin = time.perf_counter()
            yield
            self._ctx.finish()
            self._keep(name, (time.perf_counter() - begin) * 1e3)

    def end_frame(self) -> None:
        self._frame += 1

    def reset(self) -> None:
        """Begin anew: the plan changed. What the passes took before stays in `before_ms`."""
        self.before_ms |= self.median_ms()
        unused = [query for ring in self._queries.values() for query in ring if query is not None]
        self._queries.clear()
        self._kept.clear()
        if unused:
            spare_queries(self._ctx).extend(unused)

    def keep(self, frames: int = KEPT) -> None:
        """Forget all times, and from now on keep so many frames': a benchmark wants every one of its own."""
        self.flush()
        self.reset()
        self._length = frames

    def flush(self) -> None:
        """Read the queries still in flight (waits for the GPU): so that short runs have figures too."""
        for name, ring in self._queries.items():
            for frame in range(self._frame, self._frame + RING):  # oldest first
                if (query := ring[frame % RING]) is not None:
                    self._keep(name, query.elapsed / 1e6)
                    ring[frame % RING] = None
                    spare_queries(self._ctx).append(query)

    def release(self) -> None:
        """Leave the queries to whoever needs some next."""
        self.reset()

    def median_ms(self) -> dict[str, float]:
        """Median milliseconds by pass name over the frames kept, in the order first run."""
        return {name: float(np.median(times)) for name, times in self._kept.items() if times}

    def p95_ms(self) -> dict[str, float]:
        """What 95 % of the frames kept were no slower than, by pass name."""
        return {name: float(np.quantile(times, 0.95)) for name, times in self._kept.items() if times}

    def samples_ms(self) -> dict[str, list[float]]:
        """Milliseconds of each frame kept, oldest first, by pass name."""
        return {name: list(times) for name, times in self._kept.items() if times}

    def _keep(self, name: str, ms: float) -> None:
        self._kept.setdefault(name, deque(maxlen=self._length)).append(ms)
