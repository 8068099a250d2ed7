"""Frame times: right on known sequences, sure of themselves as often as they say, and whole on a real renderer."""

from __future__ import annotations

import math
from types import SimpleNamespace

import moderngl
import numpy as np
import pytest
from scipy import stats

from app.camera import Camera
from app.errors import UserError
from app.gpu import timing as sources
from app.gpu.context import device_name
from app.gpu.timing import GPU_TIMER, WALL_CLOCK, Profiler
from app.measure import timing
from app.measure.timing import SUM_OF_PASSES, frame_sums, median_interval, time_view, times_of
from app.settings import Settings


def test_known_times_have_known_figures() -> None:
    times = times_of([float(ms) for ms in range(101, 0, -1)])
    assert (times.median, times.p95, times.count) == (51.0, 96.0, 101)
    # The textbook's ranks for n = 101: the normal approximation gives 50.5 -+ 1.96 sqrt(101) / 2 = 40.7 and 60.3.
    assert (times.low, times.high) == (41.0, 61.0)


def test_no_times_and_few_times_claim_nothing() -> None:
    assert all(math.isnan(x) for x in (times_of([]).median, times_of([]).high))
    few, others = times_of([1.0] * 5), times_of([9.0] * 5)
    assert few.median == 1.0
    assert math.isnan(few.low)
    assert not few.differs_from(others)
    assert times_of([1.0] * 6).differs_from(times_of([9.0] * 6))


@pytest.mark.parametrize("count", [6, 16, 33, 200])
def test_the_interval_is_the_binomials(count: int) -> None:
    low, high = median_interval([float(i) for i in range(1, count + 1)])
    assert low + high == count + 1

    def missed(rank: float) -> float:
        return 2 * float(stats.binom.cdf(rank - 1, count, 0.5))

    assert missed(low) <= 0.05 < missed(low + 1)


def test_the_interval_holds_the_median_as_often_as_it_says() -> None:
    """Skewed times, as real ones are. 33 samples cover the median in 1 - 0.035 of all cases."""
    series = np.random.default_rng(3).lognormal(0.0, 0.5, (2000, 33))
    held = sum(low <= 1.0 <= high for low, high in map(median_interval, series.tolist()))
    expected = 1.0 - 2 * float(stats.binom.cdf(10, 33, 0.5))
    assert abs(held / 2000 - expected) < 4 * math.sqrt(expected * (1 - expected) / 2000)


def test_a_frame_is_the_sum_of_its_passes() -> None:
    assert frame_sums({"a": [9.0, 1.0, 2.0], "b": [10.0, 20.0]}) == [11.0, 22.0]
    assert frame_sums({}) == []


def test_a_profiler_keeps_as_many_frames_as_it_is_told(ctx: moderngl.Context) -> None:
    profiler = Profiler(ctx, WALL_CLOCK)
    profiler.keep(100)
    for ms in range(1, 151):
        profiler._keep("pass", float(ms))
    assert profiler.samples_ms() == {"pass": [float(ms) for ms in range(51, 151)]}
    assert profiler.p95_ms()["pass"] == pytest.approx(np.quantile(np.arange(51, 151), 0.95))
    profiler.keep()
    assert profiler.samples_ms() == {}


def test_a_timer_that_lies_is_replaced_by_the_wall_clock(ctx: moderngl.Context) -> None:
    """The whole way from a driver that reports a nanosecond for any load to the source that figures carry."""

    class Lying:
        def __enter__(self) -> None: ...
        def __exit__(self, *_: object) -> None: ...

        elapsed = 1

    liar = SimpleNamespace(
        compute_shader=ctx.compute_shader, buffer=ctx.buffer, finish=ctx.finish, extra=None, query=lambda time: Lying()
    )
    source, query_ms, _ = sources.self_test(liar)
    assert (source, query_ms) == (WALL_CLOCK, 1e-6)
    assert Profiler(liar).source == WALL_CLOCK


class Clock:
    """A renderer and a context whose frames take what the script says, on a clock of their own."""

    def __init__(self, script: dict[str, list[float]], source: str) -> None:
        self.script, self.now_s, self.frame, self.cpu_ms, self.resets = script, 0.0, 0, 0.0, 0
        self.profiler = Scripted(self, source)

    def draw(self, view: str, camera: Camera, settings: Settings, *, time_s: float) -> None:
        for name, series in self.script.items():
            ms = series[self.frame % len(series)]
            self.now_s += ms / 1e3
            if self.profiler.enabled:
                self.profiler.add(name, ms)
        self.cpu_ms = 0.25
        self.frame += 1

    def reset(self) -> None:
        self.frame, self.resets = 0, self.resets + 1

    def finish(self) -> None:
        pass


class Scripted(Profiler):
    """A profiler that is told the times."""

    def __init__(self, clock: Clock, source: str) -> None:
        super().__init__(clock, source)  # type: ignore[arg-type]
        self.add = self._keep


@pytest.mark.parametrize("source", [GPU_TIMER, WALL_CLOCK])
def test_a_script_is_timed_exactly(monkeypatch: pytest.MonkeyPatch, source: str) -> None:
    script = {"one": [100.0, 1.0, 3.0, 2.0, 1.0, 3.0, 2.0], "two": [50.0, 4.0, 4.0, 4.0, 4.0, 4.0, 4.0]}
    clock = Clock(script, source)
    monkeypatch.setattr(timing, "time", SimpleNamespace(perf_counter=lambda: clock.now_s))
    monkeypatch.setattr(timing, "device_name", lambda ctx: "a script")
    times = time_view(clock, clock, "post", Camera(), Settings(), frames=6, warm_up=1)  # type: ignore[arg-type]
    assert times.frame_ms == pytest.approx([5.0, 7.0, 6.0, 5.0, 7.0, 6.0]), "the slow first frame is left out"
    assert times.frame.median == pytest.approx(6.0)
    assert {name: t.median for name, t in times.passes.items()} == {"one": 2.0, "two": 4.0}
    assert (times.cpu.median, times.frames, times.warm_up, times.device) == (0.25, 6, 1, "a script")
    assert (times.source, times.frame_source) == (source, SUM_OF_PASSES if source == GPU_TIMER else WALL_CLOCK)
    assert clock.resets == (1 if source == GPU_TIMER else 2), "passes that wait for each other have frames of their own"
    assert clock.profiler.samples_ms() == {}


@pytest.mark.parametrize("source", [GPU_TIMER, WALL_CLOCK])
@pytest.mark.parametrize("pass_frames", [0, 2])
def test_a_sequel_starts_nothing_afresh_and_times_few_frames_passes(
    monkeypatch: pytest.MonkeyPatch, source: str, pass_frames: int
) -> None:
    clock = Clock({"one": [100.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]}, source)
    monkeypatch.setattr(timing, "time", SimpleNamespace(perf_counter=lambda: clock.now_s))
    monkeypatch.setattr(timing, "device_name", lambda ctx: "a script")
    clock.draw("post", Camera(), Settings(), time_s=0.0)
    times = time_view(
        clock,
        clock,
        "post",
        Camera(),
        Settings(),
        3,
        0,
        fresh=False,
        pass_frames=pass_frames,  # type: ignore[arg-type]
    )
    assert clock.resets == 0
    assert times.frame_ms == pytest.approx([1.0, 2.0, 3.0])
    own = {"one": 4.5} if pass_frames else {}  # with the wall clock frames 4 and 5
    assert {name: t.median for name, t in times.passes.items()} == ({"one": 2.0} if source == GPU_TIMER else own)


def test_nothing_cannot_be_timed() -> None:
    with pytest.raises(UserError, match="0 frames"):
        time_view(None, None, "post", Camera(), Settings(), frames=0)  # type: ignore[arg-type]


def test_a_real_view_is_timed(ctx: moderngl.Context) -> None:
    from ..image.half_plane import SIZE, half_plane

    stage = half_plane(ctx)
    stage.renderer.resize(SIZE)
    times = time_view(ctx, stage.renderer, "post", stage.camera, stage.settings, frames=8, warm_up=2)
    assert list(times.passes) == [call.step.name for call in stage.renderer.plan.calls]
    assert all(t.count == 8 for t in (*times.passes.values(), times.frame, times.cpu))
    assert 0.0 < times.frame.low <= times.frame.median <= times.frame.high
    assert times.device == device_name(ctx)
    assert not stage.renderer.profiler.enabled, "as it was before"
