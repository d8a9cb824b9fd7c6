"""Loads of the feet: half of 706.3 N each, or all of it."""

import numpy as np
import pytest

from datasets.library.motion_library import MotionLibrary
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import TOTAL_MASS_KG
from envs.physics.inverse_dynamics import with_feed_forward
from envs.physics.mujoco_cpu import RecordingPhysics
from eval.metrics.ground_reaction import contacts_from_loads, foot_loads
from tests.builders import STANDING, posed

WEIGHT = 9.81 * TOTAL_MASS_KG


def loads_of(motion: BodyMotion, steps: int = 15) -> np.ndarray:
    """Return the loads of the feet [N] in the last ten frames of so many control steps in a pose, shape (10, 2)."""
    library = with_feed_forward(MotionLibrary.from_clips([motion]))
    assert library.feed_forward is not None
    physics, film = RecordingPhysics(1), []
    physics.reset(np.arange(1), library.start_pose[2:3], np.zeros((1, 49)))
    for _ in range(steps):
        physics.step(library.at(np.array([2])).observed.hinges + library.feed_forward[2:3])
        film += physics.substates
    poses, velocities, targets = (np.concat(parts[-10:]) for parts in zip(*film, strict=True))
    return foot_loads(poses, velocities, targets)


def test_who_stands_carries_half_on_each_foot() -> None:
    assert loads_of(posed({}, 5)) == pytest.approx(np.full((10, 2), 0.5 * WEIGHT), rel=0.05)


def test_on_one_foot_it_carries_all() -> None:
    # The left leg leans in by 6 degrees, so that its foot is under the centre of mass; the right foot is lifted behind.
    angles = {"thigh_l_x": -6.0, "foot_l_x": 6.0, "thigh_r_y": -50.0, "shin_r_y": 100.0}
    found = loads_of(posed(angles, 5, 0.03 + 0.83 * np.cos(np.radians(6.0)) + 0.08))
    assert found[:, 0] == pytest.approx(np.full(10, WEIGHT), rel=0.1)
    assert not found[:, 1].any()


def test_in_the_air_nothing_is_carried() -> None:
    assert not loads_of(posed({}, 5, STANDING + 1.0), steps=5).any()


def test_what_counts_as_a_contact() -> None:
    # 0.05 of 706.32 N are 35.316 N.
    assert contacts_from_loads(np.array([[35.31, 35.32], [0.0, 700.0]])).tolist() == [[False, True], [False, True]]
