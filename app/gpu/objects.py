"""Where the moving objects are: their records for the shaders, and the top of the ray-tracing tree over their boxes."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..bvh.pack import stack_entries
from ..bvh.top import top_depth, top_level, world_boxes
from ..scene.flatten import places
from ..scene.model import F64, Triangles
from .layout import OBJECT
from .records import make_records


class GpuObjects:
    """Owns the records `Objects`, one for what stands still and one for each moving object."""

    def __init__(self, ctx: moderngl.Context, triangles: Triangles, textures: bool) -> None:
        """`triangles` must hold moving objects. They stand where time 0 has them until `place` moves them."""
        self._moving, self._origin = triangles.moving, triangles.origin
        self._records = np.zeros(len(self._moving) + 1, OBJECT)
        self._records["to_world"] = self._records["from_world"] = self._records["to_previous"] = np.eye(4)
        self._half_sizes = np.stack([m.half_size for m in self._moving])
        standing = triangles.positions[triangles.objects == 0]
        self._standing = (standing.min(axis=0), standing.max(axis=0)) if len(standing) else None
        drawn = np.bincount(triangles.objects[triangles.indices[:, 0]], minlength=len(self._records)) > 0
        self._in_tree = np.flatnonzero(drawn).astype(np.uint32)  # what has no triangle has no place in it
        self._times: tuple[float, float] | None = None
        self._places: dict[float, F64] = {}  # of the last two times
        self.records = make_records(ctx, self._records.tobytes(), textures)
        self.place(0.0, 0.0)

    @property
    def time_s(self) -> float:
        """What `place` was last given."""
        assert self._times is not None
        return self._times[0]

    @property
    def stack(self) -> int:
        """Entries that a walk down the top level may have to remember (define TOP_STACK)."""
        return stack_entries(top_depth(len(self._in_tree)))

    def place(self, time_s: float, previous_s: float) -> bool:
        """Move everything to where it is at `time_s`, and was last frame at `previous_s`; True if a record changed."""
        if self._times == (time_s, previous_s):
            return False
        self._places = {time: self._place(time) for time in {time_s, previous_s}}
        now, before = self._places[time_s], self._places[previous_s]
        back = np.linalg.inv(now)
        self._records["to_world"][1:] = np.swapaxes(now, 1, 2)
        self._records["from_world"][1:] = np.swapaxes(back, 1, 2)
        self._records["to_previous"][1:] = np.swapaxes(before @ back, 1, 2)
        self._times = (time_s, previous_s)
        self.records.write(self._records.tobytes())
        return True

    def take_roots(self, roots: tuple[int, ...]) -> None:
        """Remember where each object's tree begins, once it is known. Raises ValueError for another scene's."""
        if len(roots) != len(self._records):
            raise ValueError(f"{len(roots)} trees for {len(self._records)} objects: build them with scene_tree")
        self._records["root"] = roots
        self.records.write(self._records.tobytes())

    def top_nodes(self) -> NDArray[Any]:
        """The first nodes of the ray-tracing tree: the top level over the present boxes."""
        low, high = world_boxes(self._places[self.time_s], self._half_sizes)
        if self._standing is not None:
            low, high = np.vstack([self._standing[0], low]), np.vstack([self._standing[1], high])
        else:
            low, high = np.vstack([low[:1], low]), np.vstack([high[:1], high])  # never used: it is not in the tree
        return top_level(low[self._in_tree], high[self._in_tree], self._in_tree, len(self._moving))

    def release(self) -> None:
        self.records.release()

    def _place(self, time_s: float) -> F64:
        """(k, 4, 4) of all objects, about the scene's origin; a time already known is not computed again."""
        known = self._places.get(time_s)
        if known is None:
            known = places(self._moving, time_s)
            known[:, :3, 3] -= self._origin
        return known
