"""A memory of poses: nothing is looked for twice, other inputs are other poses, the oldest are forgotten."""

import numpy as np
import pytest

from envs.physics import self_collision
from envs.physics.overlap_memory import OverlapMemory
from envs.physics.self_collision import find_overlaps, remove_self_penetration
from tests.envs.physics.test_self_collision import hand_on_the_breastbone


def test_what_was_found_once_is_not_looked_for_again() -> None:
    asked: list[float] = []

    def total(*given: np.ndarray) -> float:
        asked.append(sum(float(one.sum()) for one in given))
        return asked[-1]

    memory, one, two = OverlapMemory(2), np.array([1.0, 2.0]), np.array([3.0])
    assert [memory.result(total, one), memory.result(total, one), memory.result(total, one, two)] == [3.0, 3.0, 6.0]
    assert asked == [3.0, 6.0]
    memory.result(total, one)
    memory.result(total, two)  # a third: what was not asked for longest, the two together, is forgotten
    memory.result(total, one)
    assert asked == [3.0, 6.0, 3.0]
    memory.result(total, one, two)
    assert asked == [3.0, 6.0, 3.0, 6.0]


def test_a_clip_whose_poses_are_known_is_parted_as_without_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    clip, memory = hand_on_the_breastbone(), OverlapMemory(10_000)
    fresh = remove_self_penetration(clip)
    first = remove_self_penetration(clip, memory)
    listed = find_overlaps(clip, memory=memory)

    def refuse(*_: object) -> None:
        raise AssertionError("searched again")

    monkeypatch.setattr(self_collision.mujoco, "mj_collision", refuse)
    again = remove_self_penetration(clip, memory)
    assert find_overlaps(clip, memory=memory) == listed
    for one in (first, again):
        assert np.array_equal(one.local_rotations, fresh.local_rotations)
    assert not np.array_equal(fresh.local_rotations, clip.local_rotations)
