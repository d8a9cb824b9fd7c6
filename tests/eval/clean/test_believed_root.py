"""Which root a clip keeps in cleaning."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.motion.clip import BodyMotion
from eval.clean import believed_root
from eval.clean.believed_root import locate_root
from eval.clean.notices import root_notices
from tests.builders import posed

FLOATS_M = 0.2


def hopping(speed_m_s: float) -> BodyMotion:
    # Five seconds, 0.2 m over the ground, and off it with a speed at the beginning of each second; forward at 0.1 m/s.
    time = np.arange(300) / 60.0
    rise = np.clip(speed_m_s * (time % 1.0) - 0.5 * 9.81 * (time % 1.0) ** 2, 0.0, None)
    clip = posed({}, frames=300)
    return replace(clip, root_position=clip.root_position + np.stack([0.1 * time, 0.0 * time, FLOATS_M + rise], axis=1))


def test_jumps_that_fall_freely_keep_their_path() -> None:
    captured = hopping(2.0)
    rooted, off_feet, flies = locate_root(captured)
    assert not off_feet
    # Flights last 2 * 2 / 9.81 = 0.41 s, and are over 3 cm from 0.016 to 0.392 s: frames 1 to 23.
    np.testing.assert_array_equal(flies.reshape(5, 60), np.tile(np.isin(np.arange(60), np.arange(1, 24)), (5, 1)))
    np.testing.assert_allclose(rooted.root_position, captured.root_position - [0.0, 0.0, FLOATS_M], atol=1e-9)
    (told,) = root_notices(captured, rooted, off_feet, 0.0)
    assert "landings" in told.text


def test_who_hovers_gets_another_path(monkeypatch: pytest.MonkeyPatch) -> None:
    captured = hopping(0.0)
    guessed = replace(captured, root_position=0.0 * captured.root_position, rooted=False)
    monkeypatch.setattr(believed_root, "reconstruct_missing_root", lambda clip, accelerations: guessed)
    rooted, off_feet, flies = locate_root(captured)
    assert rooted is guessed
    assert not flies.any()
    (told,) = root_notices(captured, rooted, off_feet, 0.0)
    assert "reconstructed" in told.text
