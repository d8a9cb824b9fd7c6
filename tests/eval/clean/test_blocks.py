"""A clip cleaned whole and in blocks of a few frames is the same."""

import numpy as np
import pytest

from datasets.formats.bvh import Bvh
from datasets.motion import frame_blocks
from eval.clean.pipeline import CleaningPipeline
from eval.clean.report_data import collect_report_data
from eval.clean.result import CleaningResult
from tests.builders import as_bvh, lively
from tests.eval.clean.clean_parts import simulator, standing


@pytest.mark.parametrize("fps", [60.0, 30.0])
def test_blocks_change_nothing(fps: float, monkeypatch: pytest.MonkeyPatch) -> None:
    bvh = as_bvh(standing(75, fps))
    (whole, told), (parts, said) = cleaned(bvh, 4096, monkeypatch), cleaned(bvh, 7, monkeypatch)
    same(whole, parts, told, said)
    assert told.confidence.mean() > 0.5  # it was simulated


def test_blocks_change_nothing_of_what_moves_far(monkeypatch: pytest.MonkeyPatch) -> None:
    bvh = as_bvh(lively())
    (whole, told), (parts, said) = cleaned(bvh, 4096, monkeypatch, False), cleaned(bvh, 7, monkeypatch, False)
    same(whole, parts, told, said)
    assert told.moved


def cleaned(bvh: Bvh, block: int, patch: pytest.MonkeyPatch, physics: bool = True) -> tuple[Bvh, CleaningResult]:
    """Return a clip cleaned in blocks of so many frames."""
    patch.setattr(frame_blocks, "BLOCK_FRAMES", block)
    return CleaningPipeline(simulator() if physics else None).clean(bvh, "clip")


def same(one: Bvh, other: Bvh, told: CleaningResult, said: CleaningResult) -> None:
    """Check that two cleaned clips, and what is reported of them, are equal but for rounding."""
    np.testing.assert_allclose(one.values, other.values, atol=2e-6)
    np.testing.assert_array_equal(told.contacts, said.contacts)
    np.testing.assert_allclose(told.confidence, said.confidence, atol=1e-9)
    assert (told.moved, told.overlaps, told.notices, told.read_as) == (said.moved, said.overlaps, said.notices, said.read_as)
    reports = [collect_report_data(result)["artefacts"] for result in (told, said)]
    assert reports[0]["before"] == pytest.approx(reports[1]["before"])
    assert reports[0]["after"] == pytest.approx(reports[1]["after"])
