"""Contacts of tracked feet: a height of rest that is learnt, feet that rise, and feet that nothing tells of."""

import numpy as np

from agents.lower_body.tracked_contacts import TrackedContacts
from datasets.motion.humanoid import ANKLE_HEIGHT
from datasets.trackers.joint_features import JointPoses
from datasets.trackers.trackers import FOOT_TRACKERS

ROW = np.array([1])
GUESS = np.array([[False, True]])


def feet(left: float, right: float, seen: bool = True) -> JointPoses:
    """Return feet whose soles are level and so high above the ground [m]."""
    positions = np.zeros((1, 8, 3))
    positions[0, FOOT_TRACKERS, 2] = ANKLE_HEIGHT + np.array([left, right])
    mask = np.isin(np.arange(8), FOOT_TRACKERS)[None] & seen
    return JointPoses(positions, np.tile(np.eye(3), (1, 8, 1, 1)), mask, mask)


def test_a_foot_on_the_ground_touches_it_and_one_above_does_not() -> None:
    contacts = TrackedContacts(2)
    assert contacts.step(ROW, feet(0.0, 0.03), GUESS).tolist() == [[True, False]]
    assert contacts.step(ROW, feet(0.03, 0.0), GUESS).tolist() == [[False, True]]


def test_feet_that_float_and_are_slow_rest_where_they_are() -> None:
    contacts = TrackedContacts(2)
    found = [contacts.step(ROW, feet(0.03, 0.03), GUESS) for _ in range(200)]
    assert not found[0].any()
    # 0.03 m * 0.98^n is within a centimetre once n is 55; the first frame has no speed and teaches nothing.
    assert not found[54].any()
    assert found[56].all()
    assert not contacts.step(ROW, feet(0.06, 0.06), GUESS).any()  # now they are above that
    contacts.reset(ROW)
    assert not contacts.step(ROW, feet(0.03, 0.03), GUESS).any()


def test_feet_that_move_or_are_on_a_step_teach_nothing() -> None:
    contacts = TrackedContacts(2)
    for number in range(100):
        contacts.step(ROW, feet(0.02 * (number % 2), 0.2), GUESS)  # 2 cm a frame is 0.9 m/s
    np.testing.assert_allclose(contacts._rest[1], contacts._rest[0])


def test_what_is_not_tracked_stays_as_it_was_said() -> None:
    assert TrackedContacts(2).step(ROW, feet(0.0, 0.0, seen=False), GUESS).tolist() == GUESS.tolist()
