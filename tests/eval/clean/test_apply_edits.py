"""What edits do to arrays, by numbers worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.motion.clip import BodyMotion, Motion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import conjugate, from_axis_angle, multiply
from datasets.motion.skeleton import Skeleton
from eval.clean.apply_edits import (
    LIFTED,
    STANDS,
    UNSAID,
    correct_misalignments,
    edited_contacts,
    frames_in_span,
    frames_kept,
    frames_of_quality,
    frames_without,
    keep_recorded,
    said_contacts,
    share_beside,
    spans_of_frames,
)
from eval.clean.edits import ContactEdit, MisalignmentEdit, SpanEdit
from tests.builders import posed

Z = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("span", "first_s", "frames"),
    [
        ((0.5, 1.0), 0.0, (5, 10)),  # at 10 fps frame 5 is at 0.5 s, and frame 10 is at 1 s, which is not before 1 s
        ((0.51, 1.01), 0.0, (6, 11)),
        ((0.5 + 1e-9, 1.0 - 1e-9), 0.0, (5, 10)),  # what rounding does
        ((0.0, 9.0), 0.0, (0, 20)),
        ((2.5, 3.0), 2.0, (5, 10)),  # a clip that begins at 2 s
        ((0.0, 1.0), 2.0, (0, 0)),
        ((9.0, 10.0), 0.0, (20, 20)),
    ],
)
def test_frames_of_a_span(span: tuple[float, float], first_s: float, frames: tuple[int, int]) -> None:
    found = frames_in_span(*span, 20, 10.0, first_s)
    assert (found.start, found.stop) == frames


def test_later_contacts_win_over_earlier_ones() -> None:
    edits = (ContactEdit("left", 0.2, 0.8, True), ContactEdit("left", 0.4, 0.6, False), ContactEdit("right", 0.0, 0.1, False))
    said = said_contacts(edits, 10, 10.0)
    s, u, no = STANDS, UNSAID, LIFTED
    assert said[:, 0].tolist() == [u, u, s, s, no, no, s, s, u, u]
    assert said[:, 1].tolist() == [no, *[u] * 9]
    found = np.tile([False, True], (10, 1))
    edited = edited_contacts(found, said)
    assert edited[:, 0].tolist() == [False, False, True, True, False, False, True, True, False, False]
    assert edited[:, 1].tolist() == [False, *[True] * 9]


def test_later_spans_win_over_earlier_ones() -> None:
    spans = (
        SpanEdit(0.0, 0.5, keep=True),
        SpanEdit(0.3, 0.7, without=("physics",), quality="best"),
        SpanEdit(0.6, 0.8, quality="fast"),
    )
    assert spans_of_frames(spans, 10, 10.0).tolist() == [0, 0, 0, 1, 1, 1, 2, 2, -1, -1]
    assert np.flatnonzero(frames_kept(spans, 10, 10.0)).tolist() == [0, 1, 2]
    assert np.flatnonzero(frames_without("physics", spans, 10, 10.0)).tolist() == [3, 4, 5]
    assert not frames_without("restore", spans, 10, 10.0).any()
    of_quality = frames_of_quality(spans, 10, 10.0)
    assert {quality: np.flatnonzero(labels).tolist() for quality, labels in of_quality.items()} == {"best": [3, 4, 5], "fast": [6, 7]}


def test_shares_fall_beside_labelled_frames() -> None:
    # Within 3 frames, so by quarters: 3 u^2 - 2 u^3 at 3/4, 1/2, 1/4 are 27/32, 1/2, 5/32.
    labels = np.array([0, 0, 0, 0, 1, 1, 0, 0, 0, 0], dtype=bool)
    assert share_beside(labels, 3.0) == pytest.approx([0, 5 / 32, 1 / 2, 27 / 32, 1, 1, 27 / 32, 1 / 2, 5 / 32, 0])
    assert not share_beside(np.zeros(4, dtype=bool), 3.0).any()


def one_joint(heights: np.ndarray, degrees: np.ndarray) -> Motion:
    """Return a clip of one joint at 8 fps, at heights [m] (T,) and turned about z by angles (T,)."""
    skeleton = Skeleton(("root",), (-1,), np.zeros((1, 3)))
    turns = from_axis_angle(np.tile(Z, (len(degrees), 1)), np.radians(degrees))
    return Motion(skeleton, (heights[:, None] * Z)[:, None], turns[:, None], 8.0, "one")


def test_kept_frames_have_the_recorded_numbers_and_fade_on_both_sides() -> None:
    # A quarter of a second is two frames: thirds, of which 3 u^2 - 2 u^3 is 20/27 and 7/27.
    recorded, cleaned = one_joint(np.linspace(1.0, 2.0, 9), np.full(9, 40.0)), one_joint(np.zeros(9), np.zeros(9))
    kept = np.isin(np.arange(9), [4, 5])
    found = keep_recorded(cleaned, recorded, kept)
    assert np.array_equal(found.local_positions[kept], recorded.local_positions[kept])
    assert np.array_equal(found.local_rotations[kept], recorded.local_rotations[kept])
    assert np.array_equal(found.local_positions[[0, 1, 8]], cleaned.local_positions[[0, 1, 8]])
    assert np.array_equal(found.local_rotations[[0, 1, 8]], cleaned.local_rotations[[0, 1, 8]])
    assert found.local_positions[[2, 3, 6, 7], 0, 2] == pytest.approx([1.25 * 7 / 27, 1.375 * 20 / 27, 1.75 * 20 / 27, 1.875 * 7 / 27])
    angles = 2.0 * np.degrees(np.arctan2(found.local_rotations[:, 0, 3], found.local_rotations[:, 0, 0]))
    # Half angles of 20 degrees blended as chords: tan of the half angle is s sin 20 / (1 - s + s cos 20).
    expected = [2.0 * np.degrees(np.arctan2(s * 0.34202, 1.0 - s + s * 0.93969)) for s in (7 / 27, 20 / 27)]
    assert angles[[2, 3]] == pytest.approx(expected, abs=1e-3)


def test_a_misaligned_foot_is_turned_back_and_nothing_else() -> None:
    # The true foot points ahead; its sensor says 8 degrees to the left, in the foot's own frame.
    truth = posed({"thigh_l_y": -30.0}, 3)
    faulty = turned_body(truth, "foot_l", 8.0)
    found = correct_misalignments(faulty, [MisalignmentEdit("foot_l", (0.0, 0.0, 8.0))])
    assert found.root_position == pytest.approx(truth.root_position)
    same = np.abs(np.sum(body_poses(found)[1] * body_poses(truth)[1], axis=-1))  # cosines of half the angles between them
    assert np.delete(same, BODY_NAMES.index("toe_l"), axis=1) == pytest.approx(1.0)
    # The toe stays as it was said to be in the world: its own sensor is not the foot's.
    toe = BODY_NAMES.index("toe_l")
    assert body_poses(found)[1][:, toe] == pytest.approx(body_poses(faulty)[1][:, toe])


def turned_body(clip: BodyMotion, body: str, degrees: float) -> BodyMotion:
    """Return a clip with a body turned about its own z axis; what hangs on it turns along."""
    local, index = clip.local_rotations.copy(), BODY_NAMES.index(body)
    local[:, index] = multiply(local[:, index], np.broadcast_to(from_axis_angle(Z, np.radians(degrees)), local[:, index].shape))
    return replace(clip, local_rotations=local)


def test_a_shin_stays_on_its_hinge() -> None:
    # A shin that is wrong by 10 degrees about its hinge.
    clip = posed({"shin_l_y": 40.0}, 2)
    found = correct_misalignments(clip, [MisalignmentEdit("shin_l", (0.0, 10.0, 0.0))])
    knee = found.local_rotations[:, BODY_NAMES.index("shin_l")]
    assert np.degrees(2.0 * np.arctan2(knee[:, 2], knee[:, 0])) == pytest.approx(30.0, abs=1e-4)
    assert np.abs(knee[:, [1, 3]]).max() < 1e-9
    foot = BODY_NAMES.index("foot_l")
    turned = multiply(conjugate(body_poses(clip)[1][:, foot]), body_poses(found)[1][:, foot])
    assert np.abs(turned[:, 0]) == pytest.approx(1.0)  # the foot stays as it is in the world
