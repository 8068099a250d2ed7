"""Rigid motion over time: keyframed translations and rotations along a chain of joints, played in a loop.

Times are seconds of the animation, matrices row-major on column vectors, quaternions (x, y, z, w).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce

import numpy as np
from numpy.typing import ArrayLike

from .model import F64

# Times at which a sweep is looked at, beside the keys: what moves a metre in a period is padded by 2 mm.
SWEEP_SAMPLES = 256
PARALLEL = 1.0 - 1e-10  # cosine above which an arc and its chord agree to float64, and the arc's formula divides by 0


@dataclass(frozen=True, eq=False)
class Track:
    """Values at key times, held before the first and after the last; constant with a single key.

    Three components are metres, joined by straight lines; four are unit quaternions, joined by the shorter arc.
    """

    times: F64  # (k,) s, never falling
    values: F64  # (k, 3) or (k, 4)
    step: bool = False  # keep each value until the next key

    def at(self, times: F64) -> F64:
        """(t, 3 or 4) values at some times."""
        if len(self.times) == 1:
            return np.broadcast_to(self.values, (len(times), self.values.shape[1]))
        first, second, share = self._segments(times)
        a, b, share = self.values[first], self.values[second], share[:, None]
        return a + (b - a) * share if self.values.shape[1] == 3 else _slerp(a, b, share)

    def travel(self, begin: F64, end: F64) -> F64:
        """(t,) m or rad on the way from each time to another between the same two keys; jumps of steps lie at keys."""
        middle = 0.5 * (begin + end)
        first, second, _ = self._segments(middle)
        a, b = self.values[first], self.values[second]
        way = np.linalg.norm(b - a, axis=1) if self.values.shape[1] == 3 else 2.0 * _half_angle(a, b)
        gap = self.times[second] - self.times[first]
        moving = (gap > 0.0) & (middle >= self.times[0]) & (not self.step)
        return way * np.divide(end - begin, gap, out=np.zeros(len(gap)), where=moving)

    def _segments(self, times: F64) -> tuple[np.ndarray, np.ndarray, F64]:
        """Indices of the keys around each time, and the share of the later one."""
        last = len(self.times) - 1
        first = np.clip(np.searchsorted(self.times, times, "right") - 1, 0, last)
        second = np.minimum(first + 1, last)
        gap = self.times[second] - self.times[first]
        share = np.divide(times - self.times[first], gap, out=np.zeros(len(times)), where=gap > 0.0)
        return first, second, np.zeros_like(share) if self.step else np.clip(share, 0.0, 1.0)


def still(value: ArrayLike) -> Track:
    """A track that never changes."""
    return Track(np.zeros(1), np.asarray(value, np.float64)[None])


@dataclass(frozen=True, eq=False)
class Joint:
    """One moving node: translation, rotation and constant scale, in that order, after what stands still above it."""

    base: F64  # (4, 4) this joint's frame at rest to that of the joint above it, or to the world
    translation: Track  # m
    rotation: Track
    scale: F64  # (3,)

    def local(self, times: F64) -> F64:
        """(t, 4, 4) this joint to the one above it."""
        return self.base @ self.pose(times)

    def pose(self, times: F64) -> F64:
        """(t, 4, 4) translation, rotation and scale alone."""
        matrix = np.zeros((len(times), 4, 4))
        still = len(self.rotation.times) == 1
        matrix[:, :3, :3] = (self._first if still else rotation_matrices(self.rotation.at(times))) * self.scale
        matrix[:, :3, 3] = self.translation.at(times)
        matrix[:, 3, 3] = 1.0
        return matrix

    @cached_property
    def _first(self) -> F64:
        """(1, 3, 3) the rotation of the first key."""
        return rotation_matrices(self.rotation.values[:1])


@dataclass(frozen=True, eq=False)
class Motion:
    """How everything that hangs on one joint moves. Compared by identity: what shares a Motion moves as one."""

    joints: tuple[Joint, ...]  # outermost first
    period: float  # s, > 0
    name: str = ""

    def placed(self, times: ArrayLike) -> F64:
        """(t, 4, 4) the innermost joint's space to the world, at times within the period."""
        times = np.atleast_1d(np.asarray(times, np.float64))
        matrix = self.joints[0].local(times)
        for joint in self.joints[1:]:
            matrix = matrix @ joint.local(times)
        return matrix

    def displacement(self, time_s: float) -> F64:
        """(4, 4) where points of the world at time 0 are at `time_s`; the motion repeats every period."""
        return displacements([self], time_s)[0]

    def swept(self, low: F64, high: F64) -> tuple[F64, F64]:
        """(lowest, highest) corner of a box around all that the box `low`..`high` [m, world, time 0] passes through.

        Between two neighbouring times none of its points is farther from where one of them has it than half its way.
        """
        corners = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), -1).reshape(-1, 3)
        inner = np.column_stack([corners, np.ones(8)]) @ self.back.T
        times = self._moments()
        places = inner @ np.swapaxes(self.placed(times)[:, :3], 1, 2)  # (t, 8, 3)
        pads = 0.5 * self._travel(times[:-1], times[1:], float(np.linalg.norm(inner[:, :3], axis=1).max()))
        pad = np.maximum(np.append(pads, 0.0), np.append(0.0, pads))[:, None]
        return (places.min(axis=1) - pad).min(axis=0), (places.max(axis=1) + pad).max(axis=0)

    @cached_property
    def back(self) -> F64:
        """(4, 4) the world at time 0 to the innermost joint's space."""
        return np.linalg.inv(self.placed(0.0)[0])

    def _moments(self) -> F64:
        """Times over one period, ascending: evenly spaced, all keys, and the moment before each, where steps jump."""
        keys = np.concatenate([track.times for j in self.joints for track in (j.translation, j.rotation)])
        even = np.linspace(0.0, self.period, SWEEP_SAMPLES + 1)
        return np.unique(np.clip(np.concatenate([even, keys, np.nextafter(keys, -np.inf)]), 0.0, self.period))

    def _travel(self, begin: F64, end: F64, reach: float) -> F64:
        """(t,) no point within `reach` [m] of the innermost joint goes farther than this in the world, m."""
        way = np.zeros(len(begin))
        for joint in reversed(self.joints):
            largest = float(np.abs(joint.scale).max())
            reach, way = reach * largest, way * largest
            way = way + joint.rotation.travel(begin, end) * reach + joint.translation.travel(begin, end)
            reach += float(np.linalg.norm(joint.translation.values, axis=1).max())
            stretch = float(np.linalg.norm(joint.base[:3, :3], 2))
            reach, way = stretch * reach + float(np.linalg.norm(joint.base[:3, 3])), way * stretch
        return way


def displacements(motions: Sequence[Motion], time_s: float) -> F64:
    """(k, 4, 4) of several motions. Joints that they share are placed once."""
    known: dict[tuple[int, float], F64] = {}

    def local(joint: Joint, time: float) -> F64:
        key = (id(joint), time)
        if key not in known:
            known[key] = joint.local(np.array([time]))[0]
        return known[key]

    chains = [(m, time_s % m.period) for m in motions]
    return np.stack([reduce(np.matmul, (*(local(j, time) for j in m.joints), m.back)) for m, time in chains])


def rotation_matrices(quaternions: F64) -> F64:
    """(t, 3, 3) of unit quaternions (t, 4)."""
    x, y, z, w = quaternions.T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return np.moveaxis(np.array(rows), -1, 0)


def unit_quaternions(values: ArrayLike) -> F64:
    """(k, 4) quaternions at length 1, each with the sign nearer to the one before it; without a length: no rotation."""
    q = np.array(values, np.float64)
    largest = np.abs(q).max(axis=1, keepdims=True)
    q = np.divide(q, largest, out=np.zeros_like(q), where=largest > 0.0)  # so that squares cannot over- or underflow
    q[largest[:, 0] == 0.0] = (0.0, 0.0, 0.0, 1.0)
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    turned = np.einsum("ij,ij->i", q[1:], q[:-1]) < 0.0
    q[1:][np.cumsum(turned) % 2 == 1] *= -1.0
    return q


def _half_angle(a: F64, b: F64) -> F64:
    """(t,) half the angle of the rotation from one unit quaternion to another, rad."""
    return 2.0 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))


def _slerp(a: F64, b: F64, share: F64) -> F64:
    """(t, 4) points at constant speed on the arcs from a to b (Shoemake 1985, "Animating Rotation with Quaternion
    Curves", section 3.3).
    """
    angle = _half_angle(a, b)[:, None]
    straight = np.cos(angle) > PARALLEL
    sine = np.sin(np.where(straight, 1.0, angle))
    weights = (np.where(straight, 1.0 - share, np.sin((1.0 - share) * angle) / sine),
               np.where(straight, share, np.sin(share * angle) / sine))  # fmt: skip
    q = weights[0] * a + weights[1] * b
    return q / np.linalg.norm(q, axis=1, keepdims=True)
