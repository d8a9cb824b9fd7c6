"""Kinematics in torch: the joints of the clip itself, and hinges that turn about their one axis."""

import numpy as np
import torch

from agents.restore.kinematics import correct_rotations, joint_positions, keep_hinges
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import from_axis_angle, multiply
from tests.builders import lively, posed

SHIN, FOREARM, HAND = (BODY_NAMES.index(name) for name in ("shin_l", "forearm_r", "hand_r"))
Z = np.array([0.0, 0.0, 1.0])


def rotations_of(motion: object) -> torch.Tensor:
    """Return the rotations of the bodies in the world, in double precision."""
    return torch.from_numpy(body_poses(motion)[1])  # type: ignore[arg-type]


def test_joints_are_where_forward_kinematics_puts_them() -> None:
    clip = lively()
    positions, rotations = body_poses(clip)
    found = joint_positions(torch.from_numpy(rotations).float())
    assert np.allclose(found.numpy(), positions - positions[:, :1], atol=1e-5)


def test_a_pose_that_the_hinges_can_make_stays() -> None:
    rotations = rotations_of(lively())
    same = (keep_hinges(rotations) * rotations).sum(-1).abs()
    assert torch.allclose(same, torch.ones_like(same), atol=1e-9)


def test_a_knee_keeps_its_flexion_and_loses_what_no_knee_can_do() -> None:
    bent = posed({"shin_l_y": 40.0}, 1)
    rotations = body_poses(bent)[1]
    askew = rotations.copy()
    askew[:, SHIN] = multiply(from_axis_angle(Z, np.array([0.3])), askew[:, SHIN])  # turned about the thigh, as no knee turns
    kept = keep_hinges(torch.from_numpy(askew))[0, SHIN].numpy()
    # Of a turn by 0.3 about z after 40 degrees about y the part about y has tan(half) = tan(20 degrees): the quaternion's w and y
    # are both scaled by cos(0.15).
    assert np.allclose(np.abs(kept), np.abs(rotations[0, SHIN]), atol=1e-9)


def test_a_hand_follows_its_forearm() -> None:
    none = torch.zeros(1, BODY_COUNT, 3, dtype=torch.double)
    none[:, FOREARM, 2] = 0.5  # the elbow bends: z is its hinge
    turned = correct_rotations(rotations_of(posed({}, 1)), none)
    assert np.allclose(turned[0, HAND].numpy(), [np.cos(0.25), 0.0, 0.0, np.sin(0.25)], atol=1e-9)
