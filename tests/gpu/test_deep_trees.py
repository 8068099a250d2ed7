"""Trees made to be deep, walked on the GPU with the stack that they were given."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest

from app.bvh.oracle import brute_force
from tests.cpu.test_bvh_depth import PATHOLOGICAL

from .rays import Mesh
from .test_traverse import as_float32, assert_none_invented, assert_none_lost

RAYS = 400


@pytest.mark.parametrize("name", PATHOLOGICAL)
def test_deep_trees_lose_no_hit(ctx: moderngl.Context, name: str) -> None:
    """Rays at triangles of every size and place, and through all that is nested: along the axes from its middle."""
    rng = np.random.default_rng(31)
    corners = PATHOLOGICAL[name].astype(np.float32).astype(float)
    mesh = Mesh.of(ctx, corners)
    aimed = corners[rng.integers(0, len(corners), RAYS)]
    targets = np.einsum("ri,rij->rj", rng.dirichlet([1, 1, 1], RAYS), aimed)
    size = np.maximum(np.ptp(aimed, axis=1).max(axis=1, keepdims=True), 1e-6)
    directions = rng.normal(size=(RAYS, 3))
    directions[: RAYS // 4] = np.eye(3)[rng.integers(0, 3, RAYS // 4)]
    origins = targets - directions * size * rng.choice([0.5, 30.0], (RAYS, 1))
    origins, directions = as_float32(origins, directions * size)
    result = mesh.trace(origins, directions, t_max=1e6)
    truth = brute_force(origins, directions, corners, t_max=1e6)
    assert_none_invented(mesh, origins, directions, result)
    assert_none_lost(mesh, origins, directions, result, truth.t, truth.triangle)
    if name != "one point":
        assert result.hit.mean() > 0.2
    mesh.release()
