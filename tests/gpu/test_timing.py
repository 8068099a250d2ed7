"""Milliseconds with a source one can believe: the self-test, queries read late, the wall clock, medians."""

from __future__ import annotations

import time

import moderngl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.gpu.timing import AGREEMENT, ENOUGH_MS, GPU_TIMER, KEPT, RING, WALL_CLOCK, Profiler, choose_source, self_test

from .live_objects import live_objects


@pytest.mark.parametrize("query_ms", [0.0, 1e-6, -1.0, float("nan"), float("inf"), 4295.0])
def test_a_lying_query_is_not_used(query_ms: float) -> None:
    """1e-6 ms, one nanosecond, is what Mesa's software rasteriser reports for any compute load."""
    assert choose_source(query_ms, 80.0) == WALL_CLOCK


@given(clock_ms=st.floats(0.1, 1e4), ratio=st.floats(0.01, 100.0))
def test_clocks_that_agree_are_believed(clock_ms: float, ratio: float) -> None:
    expected = GPU_TIMER if 1.0 / AGREEMENT <= ratio <= AGREEMENT else WALL_CLOCK
    if min(abs(ratio - AGREEMENT), abs(ratio - 1.0 / AGREEMENT)) > 1e-9:
        assert choose_source(clock_ms * ratio, clock_ms) == expected


def test_this_device_has_a_source(ctx: moderngl.Context) -> None:
    source, query_ms, clock_ms = self_test(ctx)
    assert source == choose_source(query_ms, clock_ms)
    assert clock_ms >= ENOUGH_MS


def test_the_wall_clock_waits_for_what_it_times(ctx: moderngl.Context) -> None:
    profiler = Profiler(ctx, WALL_CLOCK)
    for _ in range(3):
        with profiler.scope("sleep"):
            time.sleep(0.01)
        with profiler.scope("nothing"):
            pass
        profiler.end_frame()
    times = profiler.median_ms()
    assert list(times) == ["sleep", "nothing"]
    assert times["sleep"] >= 10.0
    assert times["nothing"] < times["sleep"]


def test_disabled_it_does_nothing(ctx: moderngl.Context) -> None:
    for source in (GPU_TIMER, WALL_CLOCK):
        profiler = Profiler(ctx, source)
        profiler.enabled = False
        with profiler.scope("x"):
            pass
        profiler.end_frame()
        profiler.flush()
        assert profiler.median_ms() == {}


class FakeQuery:
    """A query whose result is the frame it was begun in; reading one too early is an error."""

    def __init__(self, context: FakeContext) -> None:
        self._context, self._begun = context, -1

    def __enter__(self) -> None:
        assert not self._context.open, "queries of one kind cannot nest"
        self._context.open, self._begun = True, self._context.frame

    def __exit__(self, *_: object) -> None:
        self._context.open = False

    @property
    def elapsed(self) -> int:
        assert self._context.frame - self._begun >= self._context.lag, "this read would wait for the GPU"
        return self._begun * 1_000_000


class FakeContext:
    """As much of a context as the profiler touches."""

    def __init__(self) -> None:
        self.frame, self.open, self.made, self.lag = 0, False, 0, RING
        self.extra: list[FakeQuery] | None = None

    def query(self, time: bool) -> FakeQuery:
        assert time
        self.made += 1
        return FakeQuery(self)


def run_frames(profiler: Profiler, context: FakeContext, count: int) -> None:
    for _ in range(count):
        with profiler.scope("pass"):
            pass
        profiler.end_frame()
        context.frame += 1


def test_queries_are_read_only_when_the_gpu_is_long_done() -> None:
    context = FakeContext()
    profiler = Profiler(context, GPU_TIMER)  # type: ignore[arg-type]
    run_frames(profiler, context, RING)
    assert profiler.median_ms() == {}, "nothing was waited for"
    run_frames(profiler, context, 3)
    assert profiler.median_ms() == {"pass": 1.0}, "frame 2's time, the latest of three, was read in frame 2 + RING"
    assert context.made == RING, "queries are made once and used again"


def test_flush_reads_what_is_in_flight_in_the_order_it_ran() -> None:
    context = FakeContext()
    profiler = Profiler(context, GPU_TIMER)  # type: ignore[arg-type]
    run_frames(profiler, context, RING + 2)
    context.lag = 0
    profiler.flush()
    assert profiler.median_ms()["pass"] == (RING + 1) / 2


def test_only_the_last_frames_count() -> None:
    context = FakeContext()
    profiler = Profiler(context, GPU_TIMER)  # type: ignore[arg-type]
    run_frames(profiler, context, 3 * KEPT)
    assert profiler.median_ms()["pass"] > KEPT
    profiler.reset()
    assert profiler.median_ms() == {}
    context.lag = 0
    run_frames(profiler, context, RING)
    assert context.made == RING, "moderngl cannot release queries: a new plan uses the old ones"


def test_real_queries_run_and_are_counted(ctx: moderngl.Context) -> None:
    """Whatever this driver's timer says, using it raises no GL error and yields a figure per frame."""
    profiler = Profiler(ctx, GPU_TIMER)
    for _ in range(RING + 1):
        with profiler.scope("a"):
            pass
        with profiler.scope("b"):
            pass
        profiler.end_frame()
    profiler.flush()
    assert set(profiler.median_ms()) == {"a", "b"}


def test_a_scope_that_fails_still_ends(ctx: moderngl.Context) -> None:
    profiler = Profiler(ctx, GPU_TIMER)
    with pytest.raises(ValueError, match="inside"), profiler.scope("x"):
        raise ValueError("inside")
    with profiler.scope("y"):
        pass


def test_queries_of_a_profiler_that_is_gone_serve_the_next(ctx: moderngl.Context) -> None:
    """A window makes renderers and drops them all the time: a split screen, an error map, a search for advice."""
    made = []
    for _ in range(3):
        profiler = Profiler(ctx, GPU_TIMER)
        for name in ("a", "b", "c"):
            with profiler.scope(name):
                pass
        profiler.end_frame()
        profiler.release()
        self_test(ctx)
        made.append(live_objects(ctx)["Query"])
    assert made[0] == made[2]
