"""The engine's numbers against the clip's own, and worlds that explode."""

import mujoco
import numpy as np
import pytest

from datasets.library.motion_library import MotionLibrary, axis_velocity
from datasets.motion.humanoid import TOTAL_MASS_KG
from envs.physics.mujoco_cpu import CpuPhysics, RecordingPhysics

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
    # a^2 v / 6 with a = w / 60: for a sway at 4 rad/s under 0.1 %. Feet stand on the ground at these rows, so starts are 0.1 mm in it.
    agent, reference = physics.bodies(), library.at(ROWS)
    clip, clean = reference.observed, reference.rewarded  # the same clip
    assert np.allclose(agent.pos, clip.pos - np.array([0.0, 0.0, 1e-4]), atol=1e-5)
    assert np.allclose(agent.rot, clean.rot, atol=1e-5)
    assert np.allclose(agent.com, clip.com - np.array([0.0, 0.0, 1e-4]), atol=1e-5)
    assert np.allclose(agent.lin_vel, clip.lin_vel, atol=5e-3)
    assert np.allclose(axis_velocity(agent.ang_vel, agent.rot), clean.axis_vel, atol=5e-3)
    assert np.allclose(agent.com_vel, clip.com_vel, atol=5e-3)
    assert np.abs(clip.lin_vel).max() > 0.3
    assert np.abs(clean.axis_vel).max() > 0.5


def test_bodies_are_those_of_the_new_state(physics: CpuPhysics, library: MotionLibrary) -> None:
    physics.step(targets(library))
    assert np.allclose(physics.bodies().pos[:, 0], physics.poses()[:, :3], atol=1e-6)


def test_bodies_are_those_of_a_full_forward_pass(physics: CpuPhysics, library: MotionLibrary) -> None:
    # MuJoCo's own pass over the whole model, contacts, motors and sensors included, in the state after some steps. There the root
    # lies at the first three positions and moves with the first three speeds; the last three are its spin in the pelvis' axes.
    for _ in range(3):
        physics.step(targets(library))
    agent = physics.bodies()
    for world, state in enumerate(physics.get_state()):
        data = mujoco.MjData(physics.model)
        mujoco.mj_setState(physics.model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        mujoco.mj_forward(physics.model, data)
        speeds = data.sensordata.reshape(-1, 3)
        assert np.allclose(agent.pos[world], data.xpos[1:], atol=1e-6)
        assert np.allclose(agent.rot[world], data.xmat[1:].reshape(-1, 3, 3), atol=1e-6)
        assert np.allclose(np.concat([agent.lin_vel[world], agent.ang_vel[world]]), speeds[:40], rtol=1e-6, atol=1e-6)
        assert np.allclose([agent.com[world], agent.com_vel[world]], speeds[40:], rtol=1e-6, atol=1e-6)
        assert np.allclose(agent.lin_vel[world, 0], data.qvel[:3], rtol=1e-6, atol=1e-6)
        assert np.allclose(agent.rot[world, 0].T @ agent.ang_vel[world, 0], data.qvel[3:6], rtol=1e-5, atol=1e-5)


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


def test_branches_go_on_exactly_like_their_parents(physics: CpuPhysics, library: MotionLibrary) -> None:
    # Worlds 0 and 3 go on from 2, world 1 from 0, world 2 from itself. What their parents would have done they do, to the bit.
    for _ in range(3):
        physics.step(targets(library))
    parents = np.array([2, 0, 2, 2])
    alone = CpuPhysics(4)
    alone.set_state(physics.get_state())
    physics.branch(parents)
    for mine, theirs in zip(physics.bodies(), alone.bodies(), strict=True):
        assert np.array_equal(mine, theirs[parents])
    for _ in range(5):
        physics.step(targets(library)[parents])
        alone.step(targets(library))
    assert np.array_equal(physics.get_state(), alone.get_state()[parents])
    assert not np.array_equal(physics.get_state()[0], physics.get_state()[1])


def test_filming_changes_no_bit_and_ends_with_the_present(library: MotionLibrary) -> None:
    plain, filmed = CpuPhysics(4), RecordingPhysics(4)
    for one in (plain, filmed):
        one.reset(np.arange(4), library.start_pose[ROWS], library.start_vel[ROWS])
    for _ in range(6):
        plain.step(targets(library))
        filmed.step(targets(library))
        # A control step is two frames of the reference.
        assert len(filmed.substates) == 2
        for shown, now in zip(filmed.substates[1], filmed.motion(), strict=True):
            assert np.array_equal(shown, now)
        assert np.array_equal(filmed.substates[1][2], targets(library))
    assert np.array_equal(plain.get_state(), filmed.get_state())
    for mine, theirs in zip(plain.bodies(), filmed.bodies(), strict=True):
        assert np.array_equal(mine, theirs)


def test_films_frames_are_a_sixtieth_of_a_second_apart(library: MotionLibrary) -> None:
    # A T-pose in the air that rises at 3 m/s: after t its pelvis, above an even more massive body, has risen by about 3 t - g t^2 / 2.
    filmed = RecordingPhysics(1)
    filmed.reset(np.arange(1), library.start_pose[560:561] + np.eye(1, 50, 2), 3.0 * np.eye(1, 49, 2))
    heights = [filmed.poses()[0, 2]]
    for _ in range(3):
        filmed.step(library.at(np.array([560])).observed.hinges)
        heights += [pose[0, 2] for pose, _, _ in filmed.substates]
    time = np.arange(7) / 60.0
    assert np.diff(heights) == pytest.approx(np.diff(3.0 * time - 0.5 * 9.81 * time**2), abs=2e-3)


def test_a_force_on_the_root_acts_until_another_is_told(library: MotionLibrary) -> None:
    # In the air, 72 kg: a world that is held by its weight, 706.32 N, does not fall; one that is not falls by g t^2 / 2, after six steps
    # of 1/30 s 0.5 x 9.81 x 0.04 = 0.196 m; one that is pushed along x by 72 N moves off by 0.5 x 1 x 0.04 = 0.02 m.
    physics = CpuPhysics(3)
    physics.reset(np.arange(3), np.tile(library.start_pose[560] + np.eye(1, 50, 2)[0], (3, 1)), np.zeros((3, 49)))
    wrench = np.zeros((3, 6))
    wrench[0, 2], wrench[2, 0] = 9.81 * TOTAL_MASS_KG, TOTAL_MASS_KG
    physics.set_root_wrench(wrench)
    before = physics.bodies().com
    angles = np.tile(library.at(np.array([560])).observed.hinges, (3, 1))
    for _ in range(6):
        physics.step(angles)
    moved = physics.bodies().com - before
    assert moved[:, 2] == pytest.approx([0.0, -0.196, -0.196], abs=0.01)
    assert moved[:, 0] == pytest.approx([0.0, 0.0, 0.02], abs=2e-3)
    physics.set_root_wrench(np.zeros((3, 6)))
    speed = physics.bodies().com_vel[0, 2]
    physics.step(angles)
    assert physics.bodies().com_vel[0, 2] == pytest.approx(speed - 9.81 / 30.0, abs=0.01)
