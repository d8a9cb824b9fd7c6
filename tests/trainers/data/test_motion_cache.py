"""Cache of prepared motion: what was written comes back, and is prepared anew only where it must be."""

from pathlib import Path

import numpy as np
import pytest

from datasets.library.motion_library import ClipInfo
from trainers.data.motion_cache import PreparedClips, prepare_cached, read_prepared, write_prepared
from trainers.data.motion_config import SourceConfig


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


def test_it_is_prepared_once_for_all_settings_but_those_ignored(tmp_path: Path) -> None:
    times: list[int] = []

    def prepare() -> PreparedClips:
        times.append(len(times))
        return (ClipInfo("one", "ann", "optical", "walk", 0, 5),), {"x": np.zeros(5)}, 45.0

    def prepared(config: SourceConfig) -> PreparedClips:
        return prepare_cached(config, ("holdout",), "trainers.data.motion_cache", tmp_path, prepare, lambda _: None)

    first, again = prepared(SourceConfig()), prepared(SourceConfig(holdout="ann"))
    assert times == [0]
    assert (first[0], first[2]) == (again[0], again[2])
    prepared(SourceConfig(seed=1))
    assert times == [0, 1]


def test_a_setting_that_is_not_there_cannot_be_ignored(tmp_path: Path) -> None:
    with pytest.raises(KeyError, match="hold_out"):
        prepare_cached(SourceConfig(), ("hold_out",), "trainers.data.motion_cache", tmp_path, lambda: pytest.fail(), lambda _: None)
