"""Points of a single frame, by hand and against the kinematics of clips."""

from dataclasses import replace

import numpy as np

from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses, centre_of_mass, sole_points
from datasets.motion.pose_points import pose_points
from tests.builders import lively, posed


def test_a_bent_knee_by_hand() -> None:
    # Hip (0, 0.09, -0.03), thigh 0.42 down to the knee at -0.45; the shin, bent back by 90 degrees, lies along -x: ankle at -0.41.
    # The foot's own axes are turned as well: its sole is 0.08 behind the ankle, and the heel 0.06 above it.
    points = pose_points(posed({"shin_l_y": 90.0}, frames=1).local_rotations[0])
    np.testing.assert_allclose(points.joints[BODY_NAMES.index("foot_l")], [-0.41, 0.09, -0.45], atol=1e-12)
    np.testing.assert_allclose(points.soles[0, 0], [-0.49, 0.09, -0.39], atol=1e-12)
    np.testing.assert_allclose(points.soles[1, 0], [-0.06, -0.09, -0.94], atol=1e-12)  # the right leg hangs: 0.03 + 0.42 + 0.41 + 0.08


def test_the_same_as_of_a_clip() -> None:
    clip = replace(lively(), root_position=np.zeros((120, 3)))
    positions, rotations = body_poses(clip)
    expected = zip(positions, sole_points(positions, rotations), centre_of_mass(positions, rotations), strict=True)
    for local_rotations, parts in zip(clip.local_rotations, expected, strict=True):
        for found, should in zip(pose_points(local_rotations), parts, strict=True):
            np.testing.assert_allclose(found, should, atol=1e-12)
