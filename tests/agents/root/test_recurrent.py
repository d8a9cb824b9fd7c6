"""The recurrent root model by hand: features of a patch, feet that stand, flight, and the velocity from patch to patch."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
import torch

from agents.root.model import RootModel
from agents.root.recurrent.patches import patch_features
from agents.root.recurrent.velocity_filter import PatchMotion, PatchSteps, patch_displacements, patch_steps, patch_velocities
from agents.root.recurrent_path import patch_motion
from agents.root.spec import RootSpec
from datasets.imu.root_features import STANCE_BODIES, USUAL_TOE_OFFSET, root_frames
from datasets.imu.sensor_model import SENSOR_BODIES
from datasets.motion.humanoid import BODY_NAMES
from tests.builders import posed

HAND, FOREARM = BODY_NAMES.index("hand_l"), SENSOR_BODIES.index(BODY_NAMES.index("forearm_r"))
ANKLE_L, TOE_L, ANKLE_R, TOE_R = range(4)
SURE = 30.0  # logit whose probability is 1 to 13 digits


def outputs(stands: int = ANKLE_L, support: float = SURE, gain: float = SURE) -> np.ndarray:
    """Return the network's outputs of a patch (1, 12) that trust one point and add nothing."""
    found = np.zeros((1, 12))
    found[0, stands] = SURE
    found[0, 10:] = support, gain
    return found


def motion(acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0), heading: float = 0.0) -> PatchMotion:
    """Return a patch in which all points are equally low; the left ankle goes back by 1 cm a frame, the right one ahead by 2.

    The centre of mass goes up by 1 mm a frame as seen from the pelvis.
    """
    frames = np.arange(5.0)
    points, centre = np.zeros((1, 5, 4, 3)), np.zeros((1, 5, 3))
    points[0, :, ANKLE_L, 0], points[0, :, ANKLE_R, 0], centre[0, :, 2] = -0.01 * frames, 0.02 * frames, 0.001 * frames
    points[..., [ANKLE_L, ANKLE_R], 2], points[..., [TOE_L, TOE_R], 2] = -0.9 + 0.083, -0.9 + 0.03
    return PatchMotion(points, centre, np.array([acceleration]), np.array([heading]))


def displacements(found: np.ndarray, seen: PatchMotion, velocity: tuple[float, float, float]) -> np.ndarray:
    """Return how the pelvis moves in a patch [m], shape (4, 3), that begins with a ``velocity`` [m/s]."""
    return patch_displacements(patch_steps(found, seen), np.array([velocity]))[0]


def test_features_are_joints_velocities_and_accelerations_as_the_pelvis_sees_them() -> None:
    joints, felt = np.zeros((1, 8, 20, 3)), np.zeros((1, 8, 19, 3))
    joints[0, :, HAND] = [[1.0, 0.01 * frame if frame < 4 else 0.04 + 0.02 * (frame - 4), 0.5] for frame in range(8)]
    felt[0, 2, FOREARM], felt[0, 6, FOREARM] = (4.0, 0.0, 0.0), (0.0, 0.0, 8.0)  # one sample of four
    seen = patch_features(joints, np.array([pi / 2]), felt).reshape(-1, 3)  # who faces y has x on the right
    assert seen.shape == (98, 3)
    assert seen[HAND] == pytest.approx([0.0, -1.0, 0.5])
    assert seen[20 + HAND] == pytest.approx([1.0, 0.0, 0.0])  # 1 cm a frame of 10 ms
    assert seen[40 + HAND] == pytest.approx([2.0, 0.0, 0.0])
    assert seen[60 + FOREARM] == pytest.approx([0.0, -1.0, 0.0])
    assert seen[79 + FOREARM] == pytest.approx([0.0, 0.0, 2.0])
    assert [RootSpec("gru").bodies[at] for at in (HAND, 20 + HAND, 40 + HAND)] == [HAND] * 3
    assert [RootSpec("gru").bodies[at] for at in (60 + FOREARM, 79 + FOREARM)] == [BODY_NAMES.index("forearm_r")] * 2
    assert RootSpec("gru").features == 3 * 98
    assert RootSpec("gru", accelerations=False).features == 3 * 60


def test_the_pelvis_moves_about_the_point_that_stands() -> None:
    for stands, step in ((ANKLE_L, 0.01), (ANKLE_R, -0.02), (TOE_R, 0.0)):
        moved = displacements(outputs(stands), motion(), (5.0, 5.0, 5.0))  # however fast it was
        assert moved == pytest.approx(np.outer(np.arange(1, 5), [step, 0.0, 0.0]), abs=1e-9)


def test_points_are_those_of_the_feet() -> None:
    assert [BODY_NAMES[body] for body in STANCE_BODIES] == ["foot_l", "toe_l", "foot_r", "toe_r"]


def test_a_foot_that_rolls_over_a_lower_toe_carries_the_pelvis_farther() -> None:
    """Somebody whose toes lie 3 cm below the usual ones, while the left foot comes to point down within a patch.

    That turn takes the 3 cm from below the toe to behind it: as the toe stands, the pelvis goes 3 cm farther ahead and rises 3 cm less.
    """
    turns = np.linspace(0.0, 0.5 * pi, 5)
    standing = posed({}, frames=5)
    local = standing.local_rotations.copy()
    local[:, BODY_NAMES.index("foot_l")] = np.stack([np.cos(turns / 2), 0.0 * turns, np.sin(turns / 2), 0.0 * turns], axis=1)
    usual = replace(standing, local_rotations=local, fps=100.0)
    lower = replace(usual, toe_offsets=np.array([USUAL_TOE_OFFSET] * 2) + np.array([0.0, 0.0, -0.03]))
    seen = [patch_motion(root_frames(clip), np.zeros(1, dtype=int), accelerations=False) for clip in (usual, lower)]
    paths = [displacements(outputs(TOE_L), one, (0.0, 0.0, 0.0)) for one in seen]
    # The humanoid's toe goes from (0.13, -0.06) ahead of and above the ankle to (-0.06, -0.13): the pelvis the other way.
    assert paths[0][3] == pytest.approx([0.19, 0.0, 0.07], abs=1e-6)
    assert paths[1][3] == pytest.approx([0.19 + 0.03, 0.0, 0.07 - 0.03], abs=1e-6)


def test_the_added_velocity_is_the_pelvis_own() -> None:
    found = outputs(TOE_L)
    found[0, 4:7] = 0.5, 0.0, 0.1  # m/s ahead and up, of somebody who faces y
    moved = displacements(found, motion(heading=pi / 2), (0.0, 0.0, 0.0))
    assert moved[3] == pytest.approx([0.0, 0.02, 0.004])  # in 40 ms


def test_in_the_air_the_centre_of_mass_flies() -> None:
    moved = displacements(outputs(support=-SURE), motion(acceleration=(0.0, 0.0, -10.0)), (1.0, 0.0, 2.0))
    # After 40 ms: 1 x 0.04 ahead; 2 x 0.04 - 10 x 0.04 x 0.04 / 2 up; less the 4 mm by which the centre of mass rises in the pelvis' eyes.
    assert moved[3] == pytest.approx([0.04, 0.0, 0.08 - 0.008 - 0.004])


def test_an_added_acceleration_stands_for_the_one_that_nobody_measured() -> None:
    found = outputs(support=-SURE)
    found[0, 9] = -10.0
    measured = displacements(outputs(support=-SURE), motion(acceleration=(0.0, 0.0, -10.0)), (1.0, 0.0, 2.0))
    assert displacements(found, motion(), (1.0, 0.0, 2.0)) == pytest.approx(measured)


def test_the_velocity_after_a_patch() -> None:
    falls, felt = motion(acceleration=(2.0, 0.0, -9.81)), motion(acceleration=(2.0, 0.0, 1.0))
    in_air, on_feet, hanging = (patch_steps(outputs(support=way), seen) for way, seen in ((-SURE, falls), (SURE, felt), (-SURE, felt)))
    velocity = np.array([[3.0, 0.0, 1.0]])
    assert in_air.keep * velocity + in_air.gained == pytest.approx(np.array([[3.08, 0.0, 1.0 - 0.3924]]), abs=1e-5)
    # Whom no foot carries and who feels more than four fifths of his weight hangs: 40 ms are 0.08 of the half second of the fading.
    assert hanging.keep * velocity + hanging.gained == pytest.approx(np.array([[3.08, 0.0, 1.04 * np.exp(-0.08)]]), abs=1e-5)
    # The left ankle says 1 m/s on average, the centre of mass rises by 0.1 m/s; half of the 0.08 m/s is gained after the middle.
    assert on_feet.keep * velocity + on_feet.gained == pytest.approx(np.array([[1.04, 0.0, 0.12]]))
    assert on_feet.by_feet == pytest.approx(np.array([[0.96, 0.0, 0.08]]))


def test_velocities_go_from_patch_to_patch() -> None:
    nothing = np.zeros((3, 4, 3))
    keep, gained = np.array([[0.5] * 3, [1.0] * 3, [0.0] * 3]), np.array([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [9.0, 9.0, 9.0]])
    steps = PatchSteps(nothing, nothing[..., :1], keep, gained, np.array([[4.0, 0.0, 0.0], [7.0, 7.0, 7.0], [7.0, 7.0, 7.0]]))
    assert patch_velocities(steps).tolist() == [[4.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 2.0, 0.0]]


def test_torch_and_numpy_agree() -> None:
    rng = np.random.default_rng(0)
    found = rng.normal(size=(6, 12))
    seen = PatchMotion(rng.normal(size=(6, 5, 4, 3)), rng.normal(size=(6, 5, 3)), rng.normal(size=(6, 3)), rng.normal(size=6))
    steps = patch_steps(found, seen)
    same = patch_steps(torch.from_numpy(found), PatchMotion(*(torch.from_numpy(part) for part in seen)))
    path = patch_displacements(steps, patch_velocities(steps))
    np.testing.assert_allclose(patch_displacements(same, patch_velocities(same)).numpy(), path, atol=1e-6)


def test_the_network_does_not_see_what_comes_later() -> None:
    torch.manual_seed(0)
    model, features = RootModel(RootSpec("gru")).eval(), torch.randn(1, 10, 294)
    with torch.inference_mode():
        whole, begun = model.predict_outputs(features), model.predict_outputs(features[:, :6])
    np.testing.assert_allclose(whole[:, :6].numpy(), begun.numpy(), atol=1e-6)
