"""Misalignments in words: which way, by how much, how sure; checked on figures that really stand like that."""

import numpy as np
import pytest

from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import from_rotation_vector, multiply, rotate
from eval.clean.misalignments import find_misalignments, misalignment_notice
from tests.builders import posed

SURE = np.radians(np.full((BODY_COUNT, 3), 1.0))
# Body, axis and degrees of a turn of what the suit captured; the words; a point of the body and the way that it has moved by the turn.
CASES = [
    ("foot_l", 2, -7.0, "left foot toed in by 7 degrees (±1)", (1.0, 0.0, 0.0), (0.0, -1.0, 0.0)),
    ("foot_r", 2, -7.0, "right foot toed out by 7 degrees (±1)", (1.0, 0.0, 0.0), (0.0, -1.0, 0.0)),
    ("foot_l", 1, 6.0, "left foot pitched down by 6 degrees (±1)", (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)),
    ("foot_l", 0, 6.0, "left foot rolled in by 6 degrees (±1)", (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    ("chest", 1, 8.0, "chest leaning forward by 8 degrees (±1)", (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)),
    ("pelvis", 0, 8.0, "pelvis tilted to the right by 8 degrees (±1)", (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)),
    ("head", 2, -8.0, "head turned to the right by 8 degrees (±1)", (1.0, 0.0, 0.0), (0.0, -1.0, 0.0)),
    ("thigh_l", 0, 5.0, "left thigh swung out by 5 degrees (±1)", (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    ("thigh_r", 0, 5.0, "right thigh swung in by 5 degrees (±1)", (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    ("shin_r", 1, 9.0, "right shin swung back by 9 degrees (±1)", (0.0, 0.0, -1.0), (-1.0, 0.0, 0.0)),
    ("upper_arm_l", 0, 5.0, "left upper arm raised by 5 degrees (±1)", (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    ("upper_arm_r", 0, 5.0, "right upper arm lowered by 5 degrees (±1)", (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)),
    ("forearm_l", 2, 5.0, "left forearm swung back by 5 degrees (±1)", (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)),
    ("forearm_r", 2, 5.0, "right forearm swung forward by 5 degrees (±1)", (0.0, -1.0, 0.0), (1.0, 0.0, 0.0)),
]


@pytest.mark.parametrize(("body", "axis", "degrees", "words", "point", "way"), CASES)
def test_the_words_say_where_a_body_has_gone(
    body: str, axis: int, degrees: float, words: str, point: tuple[float, ...], way: tuple[float, ...]
) -> None:
    turn = np.zeros((BODY_COUNT, 3))
    turn[BODY_NAMES.index(body), axis] = np.radians(degrees)
    (found,) = find_misalignments(-turn, SURE)  # what corrects the captured body turns it back
    assert str(found) == words
    true = body_poses(posed({}, 1))[1][0]
    captured = multiply(true, from_rotation_vector(turn))[BODY_NAMES.index(body)]
    assert np.dot(rotate(captured, np.array(point)) - point, way) > 0.05


def test_small_and_unsure_misalignments_are_not_told() -> None:
    turn = np.zeros((BODY_COUNT, 3))
    turn[BODY_NAMES.index("chest"), 1] = np.radians(3.0)  # small
    turn[BODY_NAMES.index("foot_l"), 2] = np.radians(7.0)  # not twice as large as its deviation
    unsure = SURE.copy()
    unsure[BODY_NAMES.index("foot_l")] = np.radians(4.0)
    turn[BODY_NAMES.index("shin_l"), 2] = np.radians(20.0)  # a knee does not turn like this, whatever the sensor says
    assert find_misalignments(turn, unsure) == ()


def test_the_notice_names_the_largest_and_counts_the_others() -> None:
    turn = np.zeros((BODY_COUNT, 3))
    for degrees, body in enumerate(("pelvis", "spine", "chest", "head", "foot_l", "foot_r", "toe_l", "toe_r"), start=5):
        turn[BODY_NAMES.index(body), 1] = np.radians(degrees)
    notice = misalignment_notice(find_misalignments(-turn, SURE))
    assert notice.startswith("Segments were misaligned and have been corrected: right toe pitched down by 12 degrees (±1), left toe")
    assert notice.endswith("chest leaning forward by 7 degrees (±1), and 2 more.")
    assert misalignment_notice(()) == "The poses of a suit were corrected; no single segment was clearly misaligned."
