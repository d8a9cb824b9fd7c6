"""Rows that compare measured with simulated accelerations."""

from pathlib import Path

import numpy as np
import pytest

from datasets.imu.recording import ImuRecording
from datasets.imu.suit_simulation import simulate_suit
from eval.study.suit.acceleration_check import compare_accelerations, compare_recording
from tests.builders import lively


def test_what_was_simulated_with_an_offset_differs_by_it() -> None:
    clip = lively()
    simulated = simulate_suit(clip, 3).accelerations
    rows = compare_recording("twin", ImuRecording(clip, simulated + np.array([3.0, 0.0, 4.0]), ("pelvis", "hand_r")), 3)
    assert [row["body"] for row in rows] == ["pelvis", "hand_r", "all"]
    assert all(row["difference_rms"] == pytest.approx(5.0) for row in rows)  # 3, 4, 5
    same = compare_recording("same", ImuRecording(clip, simulated, ("pelvis",)), 3)[0]
    assert (same["difference_rms"], same["correlation"]) == (0.0, pytest.approx(1.0))
    assert same["real_rms"] == same["simulated_rms"] == pytest.approx(np.sqrt(np.mean(simulated[:, 0] ** 2) * 3))


@pytest.mark.shared_data
def test_real_recordings_are_compared(shared_data: Path) -> None:
    rows = {(row["recording"], row["body"]): row for row in compare_accelerations(shared_data)}
    assert len(rows) == 12 + 8 + 8  # eleven and seven sensors, and all
    assert rows["mvnx", "hand_l"]["correlation"] > 0.7
    assert rows["walk, Vicon's root", "pelvis"]["correlation"] > 0.5
