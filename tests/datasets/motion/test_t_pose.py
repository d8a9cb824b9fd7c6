"""The standing humanoid's lengths, added up by hand."""

import pytest

from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.t_pose import PELVIS_HEIGHT, STANDING_HEIGHT, T_POSE_POSITIONS


def test_heights_and_reach() -> None:
    assert pytest.approx(0.03 + 0.42 + 0.41 + 0.08) == PELVIS_HEIGHT  # hip, thigh, shin, ankle over the sole
    assert pytest.approx(0.94 + 0.10 + 0.17 + 0.27 + 0.13 + 0.10) == STANDING_HEIGHT  # spine, chest, head, its ball's centre and radius
    # collar, upper arm, forearm and hand sideways; spine, chest and collar upwards
    assert T_POSE_POSITIONS[BODY_NAMES.index("hand_l")] == pytest.approx([0.0, 0.03 + 0.15 + 0.28 + 0.25, 0.94 + 0.10 + 0.17 + 0.20])
    assert T_POSE_POSITIONS[BODY_NAMES.index("toe_r")] == pytest.approx([0.13, -0.09, 0.02])
