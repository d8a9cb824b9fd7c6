"""A clean clip follows the drift of the faulty one, and nothing else of it; paths and turns worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.library.drift_alignment import align_drift
from datasets.motion.clip import BodyMotion
from datasets.motion.rotation import conjugate, from_axis_angle, heading, multiply, rotate, rotation_angle
from tests.builders import STANDING, posed

FRAMES = 600  # 10 s
TIME = np.arange(FRAMES) / 60.0
INNER = slice(120, -120)  # the average, of 0.5 s standard deviation, is cut off at 4 of them: 2 s in which it does not see the ends
X, Y, Z = np.eye(3)


def moving(root: np.ndarray, rotations: np.ndarray | None = None) -> BodyMotion:
    """Return a T-pose whose pelvis moves over the ground by ``root`` (T, 3) [m] and turns by ``rotations`` (T, 4)."""
    still = posed({}, len(root))
    local = still.local_rotations.copy()
    if rotations is not None:
        local[:, 0] = rotations
    return replace(still, root_position=np.array([0.0, 0.0, STANDING]) + root, local_rotations=local)


def walking() -> BodyMotion:
    """Return a clip that goes along x at 1 m/s and sways by 2 cm to the side and 1 cm up, once a second."""
    sway = np.sin(2.0 * np.pi * TIME)
    return moving(np.stack([TIME, 0.02 * sway, 0.01 * sway], axis=1))


def test_another_place_and_another_north_are_taken_over() -> None:
    # The suit thinks that everything happens 2 m ahead, 1 m to the right, 4 cm too high and turned by half a radian.
    clean = walking()
    turn = np.broadcast_to(from_axis_angle(Z, np.array(0.5)), (FRAMES, 4))
    root = rotate(turn, clean.root_position) + np.array([2.0, -1.0, 0.04])
    faulty = replace(moving(np.zeros((FRAMES, 3)), turn), root_position=root)
    found = align_drift(clean, faulty)
    assert found.root_position[:, :2] == pytest.approx(root[:, :2], abs=1e-9)
    assert np.array_equal(found.root_position[:, 2], clean.root_position[:, 2])
    assert np.abs(rotation_angle(multiply(conjugate(found.local_rotations), faulty.local_rotations))).max() < 1e-6


def test_slow_drift_is_taken_over() -> None:
    # 0.1 m/s to the left: a symmetric average of a straight line is the line, so 0.1 t is added.
    clean = walking()
    found = align_drift(clean, replace(clean, root_position=clean.root_position + 0.1 * TIME[:, None] * Y))
    assert found.root_position[INNER] == pytest.approx((clean.root_position + 0.1 * TIME[:, None] * Y)[INNER], abs=1e-9)


def test_slow_turning_of_north_is_taken_over() -> None:
    # Somebody stands; the suit's north turns by 0.05 rad/s.
    clean = moving(np.zeros((FRAMES, 3)))
    found = align_drift(clean, moving(np.zeros((FRAMES, 3)), from_axis_angle(Z, 0.05 * TIME)))
    assert heading(found.local_rotations[:, 0])[INNER] == pytest.approx(0.05 * TIME[INNER], abs=1e-9)
    assert found.root_position == pytest.approx(clean.root_position, abs=1e-12)


def test_slides_quicker_than_a_second_are_not() -> None:
    # 5 cm to and fro three times a second, 8 degrees likewise: an average of 0.5 s leaves exp(-(2 pi 3 x 0.5)^2 / 2) = 5e-20 of them.
    clean, slide = walking(), np.sin(6.0 * np.pi * TIME)
    faulty = moving(clean.root_position - [0, 0, STANDING] + 0.05 * slide[:, None] * Y, from_axis_angle(Z, np.radians(8.0) * slide))
    found = align_drift(clean, faulty)
    assert found.root_position[INNER] == pytest.approx(clean.root_position[INNER], abs=1e-3)
    assert np.abs(heading(found.local_rotations[:, 0])[INNER]).max() < 1e-3


def test_heights_are_the_truths() -> None:
    # A suit that floats by 30 cm, and sinks and rises by 10.
    clean = walking()
    faulty = replace(clean, root_position=clean.root_position + (0.3 + 0.1 * np.sin(0.5 * TIME))[:, None] * Z)
    assert np.array_equal(align_drift(clean, faulty).root_position[:, 2], clean.root_position[:, 2])


def test_bending_down_further_than_a_right_angle_turns_nobody_around() -> None:
    # The pelvis pitches by up to 110 degrees, where its x axis points backwards and its heading has jumped by 180 degrees; the suit is
    # off by 3 degrees about x, which moves the jump. What lies between the two is no turn about the vertical.
    bow = from_axis_angle(Y, np.radians(55.0) * (1.0 - np.cos(0.4 * np.pi * TIME)))
    tilt = np.broadcast_to(from_axis_angle(X, np.radians(3.0)), (FRAMES, 4))
    clean = moving(np.zeros((FRAMES, 3)), bow)
    found = align_drift(clean, moving(np.zeros((FRAMES, 3)), multiply(tilt, bow)))
    assert np.abs(rotation_angle(multiply(conjugate(found.local_rotations), clean.local_rotations))).max() < 1e-6


def test_everything_else_is_the_clean_clips() -> None:
    clean = replace(posed({"forearm_l_z": -60.0}, FRAMES), name="clean", performer="ann", system="optical")
    found = align_drift(clean, moving(0.1 * TIME[:, None] * X))
    assert (found.name, found.performer, found.system, found.fps) == ("clean", "ann", "optical", 60.0)
    assert np.array_equal(found.local_rotations[:, 1:], clean.local_rotations[:, 1:])
