"""Restoration of whole clips: known constants come out, windows fade into one another, and any length will do."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from agents.restore.model import RestoreModel, RestorePrediction
from agents.restore.restore import restore_poses
from agents.restore.spec import PATCH_FRAMES, RestoreSpec
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES
from datasets.motion.kinematics import body_poses, resample_to
from datasets.motion.rotation import from_rotation_vector, multiply
from tests.builders import lively

CHEST = BODY_NAMES.index("chest")
WINDOW = 40


class Told(RestoreModel):
    """Network that says of each window in turn what the test tells it to: the chest's pitch, its deviation, and a contact."""

    def __init__(self, pitches: list[float], stds: list[float]) -> None:
        """Take what to say of each window [rad]."""
        super().__init__(RestoreSpec(window=WINDOW, channels=2, dilations=(1,), pooled_blocks=()))
        self.pitches, self.stds = pitches, stds

    def forward(self, rotations: torch.Tensor, mask: torch.Tensor) -> RestorePrediction:
        """Return what was told."""
        windows, frames = mask.shape
        steps = frames // PATCH_FRAMES
        constant, log_std = torch.zeros(windows, BODY_COUNT, 3), torch.zeros(windows, BODY_COUNT, 3)
        constant[:, CHEST, 1], log_std[:] = torch.tensor(self.pitches), torch.tensor(self.stds).log()[:, None, None]
        contacts = torch.full((windows, frames, 6), -50.0)
        contacts[0] = 50.0
        nothing = torch.zeros(windows, steps, BODY_COUNT, 3)
        return RestorePrediction(constant, log_std, nothing, nothing[..., 0], contacts, torch.zeros(windows, frames, 3))


def pitched(clip: BodyMotion, angle: float) -> BodyMotion:
    """Return the clip with a chest that is pitched by an angle [rad] in its own frame, while head and arms keep their directions."""
    turn = np.broadcast_to(from_rotation_vector(np.array([0.0, angle, 0.0])), clip.local_rotations[:, 0].shape)
    local = clip.local_rotations.copy()
    local[:, CHEST] = multiply(local[:, CHEST], turn)
    for body in (BODY_NAMES.index(name) for name in ("head", "collar_l", "collar_r")):
        local[:, body] = multiply(turn * [1.0, -1.0, -1.0, -1.0], local[:, body])
    return replace(clip, local_rotations=local)


@pytest.mark.parametrize("frames", [1, 2, 31, 60])
def test_a_known_misalignment_is_taken_out(frames: int) -> None:
    truth = lively().cut(40, 40 + frames)
    restored = restore_poses(Told([-0.2], [1e-4]), pitched(truth, 0.2))
    assert np.allclose(body_poses(restored.motion)[0], body_poses(truth)[0], atol=1e-6)
    assert np.allclose(restored.constant[CHEST], [0.0, -0.2, 0.0])
    assert np.allclose(restored.constant_std, 1e-4)
    assert restored.contacts.shape == (frames, 6)
    assert restored.root.shape == (frames, 3)


def test_constants_of_windows_count_by_their_precision() -> None:
    # 60 frames at 30 Hz are windows of 40 from 0 and from 20 on; the second is ten times as sure, so it weighs 100 to 1.
    clip = resample_to(lively(), 119, 60.0)
    restored = restore_poses(Told([0.202, 0.0], [1e-3, 1e-4]), clip)
    assert restored.constant[CHEST, 1] == pytest.approx(0.202 / 101, rel=0.002)  # nearly nothing is shrunk


def test_constants_are_shrunk_where_they_are_not_sure() -> None:
    # A component as large as its standard deviation keeps 1 / 1.1 of its length; one that is ten times as large all but a thousandth.
    for std, kept in ((0.2, 0.2 / 1.1), (0.02, 0.2 / 1.001)):
        restored = restore_poses(Told([0.2], [std]), lively().cut(40, 60))
        assert restored.constant[CHEST, 1] == pytest.approx(kept)


def test_windows_fade_into_one_another() -> None:
    clip = resample_to(lively(), 119, 60.0)
    stands = restore_poses(Told([0.0, 0.0], [0.1, 0.1]), clip).contacts[:, 0]
    assert np.allclose(stands[:39], 1.0)  # 20 frames at 30 Hz are the first window's alone
    assert np.allclose(stands[-38:], 0.0, atol=1e-6)
    # Frame 30 at 30 Hz is the 30th of the first window, with 10 frames to its end, and the 10th of the second: 10 to 11.
    assert stands[60] == pytest.approx(10.0 / 21.0)


def test_the_root_path_is_not_touched() -> None:
    clip = lively()
    assert np.array_equal(restore_poses(Told([0.1] * 2, [0.1] * 2), clip).motion.root_position, clip.root_position)


def test_windows_without_a_seen_frame_are_not_asked() -> None:
    # Of the windows from 0 and from 20 on, at 30 Hz, only the second sees the last two seconds at 60 Hz; what it says of them stands alone.
    clip = resample_to(lively(), 119, 60.0)
    restored = restore_poses(Told([0.2], [1e-4]), clip, np.arange(119) >= 80)
    assert restored.constant[CHEST, 1] == pytest.approx(0.2)
    assert not restored.contacts[:79].any()
    assert np.allclose(restored.contacts[81:], 1.0)
