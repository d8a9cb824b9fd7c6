"""The restoring stage: it leaves what is clean, corrects what is not, and its contacts do not flicker."""

import numpy as np
import pytest
import torch

from agents.restore.model import RestorePrediction
from datasets.cleanup.off_feet_spans import OffFeetSpan
from eval.clean import restored_poses
from eval.clean.restored_poses import restore_clip
from tests.agents.restore.test_restore import Told, pitched
from tests.builders import lively


class Flickering(Told):
    """Network that says that all feet stand, but for a single frame."""

    def forward(self, rotations: torch.Tensor, mask: torch.Tensor) -> RestorePrediction:
        """Return what was told."""
        said = super().forward(rotations, mask)
        contacts = torch.full_like(said.contacts, 50.0)
        contacts[:, 10] = -50.0
        return said._replace(contacts=contacts)


def test_a_clip_that_is_hardly_misaligned_stays_the_very_clip(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(restored_poses, "MIN_MEAN_MISALIGNMENT_DEG", 0.9)
    clip = lively().cut(40, 80)
    left = restore_clip(Told([0.3], [0.1]), clip)  # 17 degrees of one body are 0.86 on average over 20
    assert left.motion is clip
    assert left.contacts is None
    assert left.misalignments == ()


def test_poses_that_no_strap_explains_stay_the_very_clip() -> None:
    """1 rad of one body, 57 degrees, is 2.9 on average over 20, beyond the limit of a clean clip."""
    clip = lively().cut(40, 80)
    left = restore_clip(Told([1.0], [0.1]), clip)
    assert left.motion is clip
    assert (left.contacts, left.misalignments, left.unknown_poses) == (None, (), True)


def test_who_lies_is_neither_judged_nor_corrected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(restored_poses, "MIN_MEAN_MISALIGNMENT_DEG", 0.8)
    truth = lively(moving=180).cut(40, 220)  # three seconds, of which the first one lies
    faulty = pitched(truth, 0.3)
    restored = restore_clip(Flickering([-0.3], [0.02]), faulty, [OffFeetSpan(0, 60, "lies")])
    assert np.array_equal(restored.motion.local_rotations[:60], faulty.local_rotations[:60])
    assert np.allclose(restored.motion.local_rotations[91:], truth.local_rotations[91:], atol=2e-4)  # half a second later
    assert restored.contacts is not None
    assert not restored.contacts[:58].any()
    assert restored.contacts[62:].all()


def test_who_sits_is_corrected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(restored_poses, "MIN_MEAN_MISALIGNMENT_DEG", 0.8)
    truth = lively().cut(40, 80)
    restored = restore_clip(Flickering([-0.3], [0.02]), pitched(truth, 0.3), [OffFeetSpan(0, 40, "sits or is held")])
    assert np.allclose(restored.motion.local_rotations, truth.local_rotations, atol=2e-4)


def test_who_lies_all_the_while_stays_the_very_clip() -> None:
    clip = lively().cut(40, 80)
    left = restore_clip(Told([0.3], [0.1]), clip, [OffFeetSpan(0, 40, "sits or is held and lies")])
    assert left.motion is clip
    assert (left.contacts, left.unknown_poses) == (None, True)


def test_without_a_network_nothing_is_done() -> None:
    clip = lively()
    assert restore_clip(None, clip).motion is clip


def test_a_misaligned_clip_is_corrected_and_told_of(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(restored_poses, "MIN_MEAN_MISALIGNMENT_DEG", 0.8)  # 17 degrees of one body are 0.86 on average over 20
    truth = lively().cut(40, 80)
    restored = restore_clip(Flickering([-0.3], [0.02]), pitched(truth, 0.3))
    assert np.allclose(restored.motion.local_rotations, truth.local_rotations, atol=2e-4)  # of 0.3 rad a thousandth is shrunk
    (found,) = restored.misalignments
    assert str(found) == "chest leaning forward by 17 degrees (±1)"
    assert restored.contacts is not None
    assert restored.contacts.all()  # a gap of a thirtieth of a second is none
