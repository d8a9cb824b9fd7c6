"""Six-point tracking: legs that reach for the feet, and feet that get lost."""

import numpy as np
import pytest

from datasets.motion.rotation import conjugate, multiply, rotation_angle, to_matrix
from datasets.trackers.lower_body import leg_rotations, toe_positions
from datasets.trackers.trackers import TrackerPoses, tracker_poses
from eval.study.lobstr import six_point_baseline as lobstr_six_point
from eval.study.lobstr.six_point_baseline import find_foot_strikes, foot_poses, occlude_feet, solve_legs_ik
from tests.builders import posed


def test_legs_that_bend_straight_ahead_are_found_again() -> None:
    clip = posed({"thigh_l_y": -40.0, "shin_l_y": 60.0, "foot_l_y": 10.0, "thigh_r_y": 10.0, "shin_r_y": 25.0, "foot_r_y": -20.0}, frames=2)
    legs, true = solve_legs_ik(tracker_poses(clip), foot_poses(clip)), leg_rotations(clip.local_rotations)
    assert np.degrees(rotation_angle(multiply(conjugate(true), legs))).max() < 1e-4
    assert np.abs(toe_positions(to_matrix(legs)) - toe_positions(to_matrix(true))).max() < 1e-6


def test_contacts_strike_where_they_begin() -> None:
    contacts = np.array([[True, False], [False, True], [True, True], [True, False]])
    assert find_foot_strikes(contacts).tolist() == [[False, False], [False, True], [True, False], [False, False]]


@pytest.fixture
def feet() -> TrackerPoses:
    """Return feet that move by a metre a frame, for an hour at 45 Hz."""
    frames = 45 * 3600
    positions = np.zeros((frames, 2, 3))
    positions[..., 0] = np.arange(frames)[:, None]
    return TrackerPoses(positions, np.tile([1.0, 0.0, 0.0, 0.0], (frames, 2, 1)))


def test_feet_are_hidden_as_often_as_it_is_said_and_then_keep_still(feet: TrackerPoses) -> None:
    # Six times a minute for 0.9 s in the mean: at any instant 6 * 0.9 / 60 = 0.09 spans are open in the mean, so 1 - exp(-0.09) are hidden.
    none = np.zeros((len(feet.positions), 2), dtype=bool)
    seen, hidden = occlude_feet(feet, none, np.random.default_rng(0))
    assert hidden.mean() == pytest.approx(0.0861, abs=0.008)
    assert np.array_equal(seen.positions[~hidden], feet.positions[~hidden])
    within = hidden[1:] & hidden[:-1]
    steps = np.linalg.norm(np.diff(seen.positions, axis=0), axis=-1)[within]
    assert np.mean(steps == 0.0) > 0.95  # the rest is where one span runs into another
    first = np.flatnonzero(hidden[:, 0] & ~np.roll(hidden[:, 0], 1))
    off = np.linalg.norm(seen.positions[first, 0] - feet.positions[first - 1, 0], axis=1)
    assert np.mean(off == 0.0) == pytest.approx(0.5, abs=0.15)  # about 350 spans
    assert off.max() <= 0.5
    assert off[off > 0.0].min() >= 0.1


def test_a_strike_shakes_a_tracker_for_a_moment(feet: TrackerPoses, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lobstr_six_point, "HIDDEN_PER_MINUTE", 0.0)
    short = TrackerPoses(feet.positions[:40], feet.rotations[:40])
    strikes = np.zeros((40, 2), dtype=bool)
    strikes[10, 1] = True
    seen, hidden = occlude_feet(short, strikes, np.random.default_rng(1))
    off = np.linalg.norm(seen.positions - short.positions, axis=-1)
    assert not hidden.any()
    assert not off[:, 0].any()
    assert not off[:10, 1].any()
    assert 0.0 < off[10, 1] < 0.15
    assert off[12, 1] == pytest.approx(off[10, 1] / np.e)  # two frames later a third
    assert off[-1, 1] < 1e-6
