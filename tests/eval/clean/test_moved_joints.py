"""Joints that were moved far: spans, joints and stages of clips whose changes are known."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.rotation import from_rotation_vector, multiply
from eval.clean.moved_joints import MovedSpan, find_moved_spans, moved_notice
from tests.builders import posed


def turned(clip: BodyMotion, body: str, degrees: float, frames: slice) -> BodyMotion:
    """Return the clip with a body turned about its z axis in some frames."""
    local = clip.local_rotations.copy()
    turn = from_rotation_vector(np.array([0.0, 0.0, np.radians(degrees)]))
    local[frames, BODY_NAMES.index(body)] = multiply(local[frames, BODY_NAMES.index(body)], turn)
    return replace(clip, local_rotations=local)


def test_a_hand_that_physics_moved_is_told() -> None:
    # A T-pose's upper arm turned by 10 degrees carries the wrist, 0.28 + 0.25 = 0.53 m away, by 2 x 0.53 sin 5 = 92.4 mm, the elbow by
    # 48.8 mm. Restoring turns it by 2 degrees in all frames, 18.5 mm; physics by 8 more in frames 60 to 89.
    recorded = posed({}, 180)
    restored = turned(recorded, "upper_arm_l", 2.0, slice(None))
    simulated = turned(restored, "upper_arm_l", 8.0, slice(60, 90))
    (span,) = find_moved_spans(recorded, {"restoring": restored, "physics": simulated})
    assert (span.start_s, span.stop_s) == pytest.approx((1.0, 89 / 60))
    assert (span.body, span.stage) == ("hand_l", "physics")
    assert span.distance_mm == pytest.approx(92.4, abs=0.1)
    (later,) = find_moved_spans(recorded, {"restoring": restored, "physics": simulated}, 2.5)  # after a rest pose
    assert (later.start_s, later.stop_s) == pytest.approx((3.5, 2.5 + 89 / 60))
    assert moved_notice((span,)) == "Moved by more than 50 mm: left hand by 92 mm at 1.0 to 1.5 s (physics)."


def test_who_is_carried_is_not_moved() -> None:
    recorded = posed({}, 60)
    carried = replace(recorded, root_position=recorded.root_position + np.array([3.0, 0.0, 0.0]))
    assert find_moved_spans(recorded, {"planting": carried}) == ()


def test_spans_near_each_other_are_one() -> None:
    # Frames 20 to 29 and 50 to 59 are a third of a second apart, frames 120 to 129 a second further.
    recorded = moved = posed({}, 180)
    for start in (20, 50, 120):
        moved = turned(moved, "upper_arm_r", 10.0, slice(start, start + 10))
    spans = find_moved_spans(recorded, {"physics": moved})
    assert np.allclose([(span.start_s, span.stop_s) for span in spans], [(20 / 60, 59 / 60), (2.0, 129 / 60)])


def test_the_notice_tells_the_farthest_and_counts_the_others() -> None:
    spans = tuple(MovedSpan(float(second), second + 0.5, "foot_r", 60.0 + second, "restoring") for second in range(6))
    notice = moved_notice(spans)
    assert notice.startswith("Moved by more than 50 mm: right foot by 65 mm at 5.0 to 5.5 s (restoring), right foot by 64 mm")
    assert notice.endswith("and 2 more spans.")
