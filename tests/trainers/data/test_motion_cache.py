"""Prepared motion comes back as it was, however its arrays lie in memory."""

from pathlib import Path

import numpy as np

from datasets.library.motion_library import ClipInfo
from trainers.data.motion_cache import read_prepared, write_prepared


def test_arrays_with_their_axes_in_another_order_come_back(tmp_path: Path) -> None:
    clips = (ClipInfo("one", "ann", "optical", "walk", 0, 5),)
    turned = np.arange(30.0).reshape(2, 3, 5).transpose(2, 0, 1)  # last axis first in memory
    write_prepared(tmp_path / "cache" / "one.safetensors", clips, {"turned": turned}, 45.0)
    prepared = read_prepared(tmp_path / "cache" / "one.safetensors")
    assert prepared is not None
    assert prepared[0] == clips
    assert np.array_equal(prepared[1]["turned"], turned)
    assert prepared[2] == 45.0


def test_a_broken_cache_is_none(tmp_path: Path) -> None:
    (tmp_path / "one.safetensors").write_bytes(b"broken")
    assert read_prepared(tmp_path / "one.safetensors") is None
