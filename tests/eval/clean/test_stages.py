"""The stages of cleaning: what is put right, what is left alone, and how performed parts come back into a clip."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from datasets.cleanup.off_feet_spans import OffFeetSpan
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import body_poses, lowest_point_heights
from datasets.motion.rotation import from_axis_angle, multiply
from eval.clean import stages as module
from eval.clean.quality import Simulator
from eval.clean.simulate_clip import SimulatedClip
from eval.clean.stages import frame_mask, repair_kinematically, simulate_grounded_spans
from tests.builders import STANDING, posed
from tests.eval.clean.clean_parts import simulator, standing

X, Y, Z = np.eye(3)


def lowest(motion: BodyMotion) -> np.ndarray:
    """Return the height [m] of the lowest point of a body in each frame, shape (T,)."""
    return lowest_point_heights(*body_poses(motion)).min(axis=1)


def at_heights(heights: np.ndarray) -> BodyMotion:
    """Return a T-pose whose soles are at the given heights [m], shape (T,)."""
    still = posed({}, len(heights))
    return replace(still, root_position=still.root_position + heights[:, None] * Z)


def climbing() -> np.ndarray:
    """Return heights of 6 s: 5 cm of floating, between the second and the fourth second on a box of 45 cm, up and down in half a second."""
    time = np.arange(360) / 60.0
    return 0.05 + 0.45 * np.interp(time, [2.0, 2.5, 3.5, 4.0], [0.0, 1.0, 1.0, 0.0])


def test_a_floating_clip_is_put_on_the_ground() -> None:
    assert lowest(repair_kinematically(at_heights(np.full(120, 0.05)), [])) == pytest.approx(0.0, abs=1e-3)


def test_what_is_elsewhere_keeps_its_height_above_the_ground() -> None:
    # The floating goes, before, after and while somebody is on a box, and the box stays: it is not levelled.
    heights = climbing()
    found = lowest(repair_kinematically(at_heights(heights), [OffFeetSpan(105, 255, "climbs")]))
    assert found[:100] == pytest.approx(0.0, abs=2e-3)
    assert found[-100:] == pytest.approx(0.0, abs=2e-3)
    assert found[165:195] == pytest.approx(0.45, abs=2e-3)


def test_all_of_it_elsewhere_is_left_at_its_height() -> None:
    heights = np.full(120, 0.45)
    assert lowest(repair_kinematically(at_heights(heights), [OffFeetSpan(0, 120, "sits")])) == pytest.approx(0.45, abs=1e-9)


def test_jitter_goes_and_limbs_come_apart() -> None:
    # Hanging arms tremble by 2 degrees at 20 Hz, of which 0.00124 stay (see test_steady), and the forearm is pressed into the hip.
    trembling = posed({}, 240)
    swing = np.radians(2.0) * np.sin(2.0 * np.pi * 20.0 * np.arange(240) / 60.0 + 0.3)
    local = trembling.local_rotations.copy()
    local[:, 5] = from_axis_angle(X, np.radians(-90.0) + swing)  # upper_arm_l
    found = repair_kinematically(replace(trembling, local_rotations=local), [])
    angles = 2.0 * np.arctan2(found.local_rotations[:, 5, 1], found.local_rotations[:, 5, 0])
    assert np.abs(np.diff(angles[60:-60])).max() < np.radians(0.02)
    assert angles[120] > np.radians(-90.0) + 0.03  # away from the hip


def test_frames_inside_spans() -> None:
    assert frame_mask([OffFeetSpan(1, 3, "sits"), OffFeetSpan(4, 5, "lies")], 6).tolist() == [False, True, True, False, True, False]
    assert frame_mask([], 2).tolist() == [False, False]


def bent(clip: BodyMotion, drift: float) -> SimulatedClip:
    """Return a performance on the left foot, all trusted: the left elbow bent by 30 degrees more, the way along x ``drift`` [m] longer."""
    local = clip.local_rotations.copy()
    local[:, 6] = multiply(local[:, 6], np.broadcast_to(from_axis_angle(Z, np.radians(30.0)), local[:, 6].shape))
    root = clip.root_position + np.linspace(0.0, drift, len(clip))[:, None] * X + [7.0, 7.0, 0.0]  # begins anywhere
    contacts = np.tile([True, False], (len(clip), 1))
    return SimulatedClip(
        replace(clip, root_position=root, local_rotations=local), contacts, np.ones(len(clip)), [0, 20], np.full(len(clip), 0.02)
    )


@pytest.fixture
def performed(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, tuple[bool, bool]]]:
    """Let parts be performed as ``bent``, with 0.2 m of drift; return what was asked for: frames, and what they join."""
    asked = []

    def stand_in(_: Simulator, clip: BodyMotion, joins: tuple[bool, bool], __: Callable[[int], None]) -> SimulatedClip:
        asked.append((len(clip), joins))
        return bent(clip, 0.2)

    monkeypatch.setattr(module, "simulate_clip", stand_in)
    return asked


def test_only_level_ground_is_performed(performed: list[tuple[int, tuple[bool, bool]]]) -> None:
    # 100 frames of standing, 80 of sitting, 120 of standing.
    clip = posed({}, 300)
    found = simulate_grounded_spans(simulator(), clip, [OffFeetSpan(100, 180, "sits")])
    assert performed == [(100, (False, True)), (120, (True, False))]
    ground = np.ones(300, dtype=bool)
    ground[100:180] = False
    assert np.array_equal(found.confidence, ground.astype(float))
    assert np.array_equal(found.contacts, np.stack([ground, np.zeros(300, dtype=bool)], axis=1))
    assert np.array_equal(found.motion.local_rotations[100:180], clip.local_rotations[100:180])
    assert found.motion.local_rotations[ground, 6] == pytest.approx(np.tile([np.cos(np.pi / 12), 0, 0, np.sin(np.pi / 12)], (220, 1)))
    assert found.segment_starts == [0, 20, 180, 200]


def test_contacts_that_are_known_count_in_performed_frames_too(performed: list[tuple[int, tuple[bool, bool]]]) -> None:
    # The performance stands on the left foot, but it is the right one that keeps still in the clip; nobody stands while somebody sits.
    known = np.tile([False, True], (300, 1))
    found = simulate_grounded_spans(simulator(), posed({}, 300), [OffFeetSpan(100, 180, "sits")], known)
    assert len(performed) == 2
    assert not found.contacts[:, 0].any()
    assert found.contacts[:, 1].tolist() == [True] * 100 + [False] * 80 + [True] * 120


def test_what_follows_a_performance_is_carried_along(performed: list[tuple[int, tuple[bool, bool]]]) -> None:
    # The clip stands still; the first part drifts by 0.2 m, so the second is from there, and drifts by another 0.2. Heights stay.
    found = simulate_grounded_spans(simulator(), posed({}, 300), [OffFeetSpan(100, 180, "sits")]).motion.root_position
    assert len(performed) == 2
    assert found[:100, 0] == pytest.approx(np.linspace(0.0, 0.2, 100))
    assert found[100:180, 0] == pytest.approx(0.2)
    assert found[180:, 0] == pytest.approx(np.linspace(0.2, 0.4, 120))
    assert found[:, 1] == pytest.approx(0.0)
    assert found[:, 2] == pytest.approx(STANDING)


def test_what_is_too_short_is_not_performed_but_stands_by_its_looks(performed: list[tuple[int, tuple[bool, bool]]]) -> None:
    # 59 frames before and 61 after somebody sits.
    found = simulate_grounded_spans(simulator(), posed({}, 200), [OffFeetSpan(59, 139, "sits")])
    assert performed == [(61, (True, False))]
    assert not found.confidence[:139].any()
    assert found.contacts[:59].all()  # of a T-pose on the ground
    assert not found.contacts[59:139].any()
    assert found.contacts[139:].tolist() == [[True, False]] * 61


def test_without_a_policy_physics_is_left_out() -> None:
    clip = posed({}, 90)
    found = simulate_grounded_spans(None, clip, [])
    assert found.motion is clip
    assert found.contacts.all()
    assert (found.confidence.any(), found.segment_starts) == (False, [])


def test_a_search_follows_what_is_repaired() -> None:
    # Somebody who stands, sits down in the air for half a second, and stands: before and after the span nothing jumps.
    clip = standing(200)
    sits = [OffFeetSpan(70, 100, "sits")]
    found = simulate_grounded_spans(simulator(), repair_kinematically(clip, sits), sits)
    assert (len(found.motion), found.contacts.shape, found.confidence.shape) == (200, (200, 2), (200,))
    assert not found.confidence[70:100].any()
    assert found.confidence[[69, 100]] == pytest.approx(0.0, abs=0.05)
    assert found.confidence[[0, 40, 140]] == pytest.approx(1.0, abs=0.05)
    assert not found.contacts[70:100].any()
    assert found.contacts[20:50].all()
    steps = np.linalg.norm(np.diff(body_poses(found.motion)[0], axis=0), axis=-1)
    assert steps.max() < 0.02  # m: hands swing by 0.2 rad x 3 / s x 0.25 m / 60 = 2.5 mm a frame
