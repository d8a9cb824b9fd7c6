"""The engine's numbers against the clip's own, and worlds that explode."""

import numpy as np
import pytest

from datasets.motion_library import MotionLibrary, axis_velocity
from envs.physics_cpu import CpuPhysics

ROWS = np.array([50, 200, 300, 520])


@pytest.fixture
def physics(library: MotionLibrary) -> CpuPhysics:
    physics = CpuPhysics(4)
    physics.reset(np.arange(4), library.start_pose[ROWS], library.start_vel[ROWS])
    return physics


def targets(library: MotionLibrary) -> np.ndarray:
    return library.at(ROWS).observed.hinges


def test_bodies_stand_and_move_as_in_the_clip(physics: CpuPhysics, library: MotionLibrary) -> None:
    # The clip's bodies come from its own kinematics, velocities from central differences over 1/60 s, whose error is about
    # a^2 v / 6 with a = w / 60: for a sway at 4 rad/s under 0.1 %. No foot is in the ground at these rows, so nothing was lifted.
    agent, reference = physics.bodies(), library.at(ROWS)
    clip, clean = reference.observed, reference.rewarded  # the same clip
    assert np.allclose(agent.pos, clip.pos, atol=1e-5)
    assert np.allclose(agent.rot, clean.rot, atol=1e-5)
    assert np.allclose(agent.com, clip.com, atol=1e-5)
    assert np.allclose(agent.lin_vel, clip.lin_vel, atol=5e-3)
    assert np.allclose(axis_velocity(agent.ang_vel, agent.rot), clean.axis_vel, atol=5e-3)
    assert np.allclose(agent.com_vel, clip.com_vel, atol=5e-3)
    assert np.abs(clip.lin_vel).max() > 0.3
    assert np.abs(clean.axis_vel).max() > 0.5


def test_bodies_are_those_of_the_new_state(physics: CpuPhysics, library: MotionLibrary) -> None:
    physics.step(targets(library))
    assert np.allclose(physics.bodies().pos[:, 0], physics.poses()[:, :3], atol=1e-6)


def test_bodies_of_some_worlds(physics: CpuPhysics) -> None:
    for part, whole in zip(physics.bodies(np.array([1, 3])), physics.bodies(), strict=True):
        assert np.array_equal(part, whole[[1, 3]])


def test_threads_change_no_bit(library: MotionLibrary) -> None:
    states = []
    for threads in (1, 2):
        physics = CpuPhysics(4, threads)
        physics.reset(np.arange(4), library.start_pose[ROWS], library.start_vel[ROWS])
        for _ in range(10):
            physics.step(targets(library))
        states.append(physics.get_state())
    assert np.array_equal(*states)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e9, 1e200])
def test_exploded_world_is_reported_and_spoils_nothing(physics: CpuPhysics, library: MotionLibrary, bad: float) -> None:
    undisturbed = CpuPhysics(4)
    undisturbed.set_state(physics.get_state())
    physics._qvel[1, 20] = bad
    assert physics.step(targets(library)).tolist() == [False, True, False, False]
    assert not undisturbed.step(targets(library)).any()
    others = [0, 2, 3]
    assert np.array_equal(physics.get_state()[others], undisturbed.get_state()[others])
    assert all(np.isfinite(array).all() for array in physics.bodies())
    assert np.isfinite(physics.get_state()).all()


def test_nothing_of_an_explosion_outlives_a_reset(physics: CpuPhysics, library: MotionLibrary) -> None:
    fresh = CpuPhysics(4)
    fresh.reset(np.arange(4), library.start_pose[ROWS], library.start_vel[ROWS])
    for _ in range(3):
        physics.step(targets(library))
    physics._qpos[2, 9] = np.nan
    assert physics.step(targets(library))[2]
    physics.reset(np.arange(4), library.start_pose[ROWS], library.start_vel[ROWS])
    for _ in range(5):
        physics.step(targets(library))
        fresh.step(targets(library))
    assert np.array_equal(physics.get_state(), fresh.get_state())


def test_state_continues_exactly_elsewhere(physics: CpuPhysics, library: MotionLibrary) -> None:
    physics.step(targets(library))
    other = CpuPhysics(4)
    other.set_state(physics.get_state())
    for mine, theirs in zip(physics.bodies(), other.bodies(), strict=True):
        assert np.array_equal(mine, theirs)
    for _ in range(5):
        physics.step(targets(library))
        other.step(targets(library))
    assert np.array_equal(physics.get_state(), other.get_state())
