"""glsl/lib/work_list.glsl: the groups cover the list, and each item belongs to one invocation."""

from __future__ import annotations

import moderngl
import numpy as np

from .harness import call_glsl

LIST = "lib/work_list.glsl"
GUARANTEED_GROUPS = 65535  # OpenGL 4.3, GL_MAX_COMPUTE_WORK_GROUP_COUNT


def test_groups_cover_every_list_within_the_guaranteed_limit(ctx: moderngl.Context) -> None:
    row = 64 * 32768
    items = np.array([0, 1, 63, 64, 65, row - 1, row, row + 1, 7680 * 4320, 2**31], np.uint32)
    groups = call_glsl(ctx, LIST, "uvec2 groups_over(uint items)", items).astype(np.int64)
    assert groups.max() <= GUARANTEED_GROUPS
    covered = groups[:, 0] * groups[:, 1] * 64
    assert (covered >= items).all()
    assert ((groups[:, 1] - 1) * row < np.maximum(items, 1)).all()  # no empty row


def test_items_of_successive_groups_follow_each_other(ctx: moderngl.Context) -> None:
    item = np.concatenate([np.arange(4096), 64 * 32768 + np.arange(4096)])
    group = np.stack([item // 64 % 32768, item // 64 // 32768], -1)
    found = call_glsl(ctx, LIST, "uint item_of(uvec2 group, uint lane)", group, item % 64)
    np.testing.assert_array_equal(found, item)
