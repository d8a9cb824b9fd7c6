"""The studio's benchmark on a clip of two seconds: what it measures, and of which clips."""

import json
from pathlib import Path

import numpy as np
import pytest

from configs.errors import InputError
from datasets.formats.bvh import write_bvh
from eval.benchmark.studio import CONTACT, FIRST, OPEN, PREVIEW, WHOLE, benchmark_studio, measure_studio, there_and_back
from eval.clean import preview
from eval.clean.pipeline import CleaningPipeline
from tests.builders import as_bvh
from tests.eval.clean.clean_parts import standing


def test_a_long_clip_goes_there_and_back() -> None:
    clip = as_bvh(standing(4))  # at 60 fps
    long = there_and_back(clip, 11 / 60)
    assert np.array_equal(long.values, clip.values[[0, 1, 2, 3, 3, 2, 1, 0, 0, 1, 2]])


def test_every_wait_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(preview, "MIN_CLIP_S", 8.0)  # a long clip has nine seconds here
    rounds: list[int] = []
    speed = measure_studio(as_bvh(standing(300)), CleaningPipeline(None), 1, lambda: rounds.append(1), long_s=9.0)
    found = json.loads(json.dumps(speed.summary()))
    assert (found["benchmark"], found["unit"], found["rounds"], len(rounds)) == ("studio", "seconds of clip/s", 1, 2)
    short, long = "5 s", "0.15 min"
    assert set(found["memory_bytes"]) == {"before", short, long}
    assert {f"{clip}, {what}" for clip in (short, long) for what in (OPEN, FIRST, f"{CONTACT}, {WHOLE}")} < set(found["seconds"])
    assert f"{long}, {CONTACT}, {PREVIEW}" in found["seconds"]
    assert f"{short}, {CONTACT}, {PREVIEW}" not in found["seconds"]  # it is solved whole as quickly
    assert found["rows"][f"{long}, {CONTACT}, {PREVIEW}"]["limit"] == f"{short}, {CONTACT}, {WHOLE}"
    for name, seconds in found["seconds"].items():
        assert seconds > 0.0
        if not name.endswith(PREVIEW):
            assert found["rows"][name]["rate"] == pytest.approx((5.0 if name.startswith(short) else 9.0) / seconds)


def test_a_file_is_long_enough(tmp_path: Path) -> None:
    write_bvh(tmp_path / "clip.bvh", as_bvh(standing(300)))
    with pytest.raises(InputError, match=r"clip\.bvh lasts 5\.0 s, should be 10 or more"):
        benchmark_studio(str(tmp_path / "clip.bvh"), 1)
