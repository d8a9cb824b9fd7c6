"""The live benchmark on a tiny network: what it writes, and that its peer does the same job."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from agents.lower_body.model import LowerBodyModel
from agents.lower_body.spec import LowerBodySpec
from agents.lower_body.stream import LowerBodyStream
from datasets.motion.clip import BodyMotion
from datasets.trackers.trackers import TrackerPoses, tracker_poses
from eval.benchmark import live as benchmark_live
from eval.benchmark.live import LIMIT, OURS, WINDOWED, WindowStream, measure_live
from tests.envs.states import swaying


@pytest.fixture
def clip() -> BodyMotion:
    moved = swaying("sway", 100, 0.3)
    return BodyMotion(moved.root_position, moved.local_rotations, 45.0, "sway")


@pytest.fixture
def model() -> LowerBodyModel:
    torch.manual_seed(0)
    return LowerBodyModel(LowerBodySpec(hidden=16)).eval()


def test_a_windows_last_frame_is_the_same_network(model: LowerBodyModel, clip: BodyMotion) -> None:
    """A state that is carried from the first frame on is that of a window until more than a window was seen."""
    joints = tracker_poses(clip)
    carried, windowed = LowerBodyStream(model, 1), WindowStream(model, 1)
    said = []
    for number in range(45):
        frame = TrackerPoses(joints.positions[number : number + 1], joints.rotations[number : number + 1])
        said = [stream.push(np.array([0]), frame)[0] for stream in (carried, windowed)]
    for one, other in zip(*said, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-5)


def test_benchmark_writes_its_figures(model: LowerBodyModel, clip: BodyMotion, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(benchmark_live, "FRAMES_PER_ROUND", 4)
    model.save(tmp_path / "model.safetensors", {})
    rounds: list[int] = []
    speed = measure_live(tmp_path / "model.safetensors", clip, 2, lambda: rounds.append(1), users=3)
    found = json.loads(json.dumps(speed.summary()))
    assert (found["benchmark"], found["unit"], found["rounds"], len(rounds)) == ("live", "frames/s", 2, 3)
    assert list(found["rows"]) == [OURS, "3 users", "3 users, sockets", WINDOWED, LIMIT, "network step, 3 users"]
    assert set(found["peers"]) == {WINDOWED}
    for name in (OURS, "3 users", "3 users, sockets", WINDOWED):
        assert 0.0 < found["rows"][name]["median_ms"] <= found["rows"][name]["p99_ms"]
        assert len(speed.latencies_s[name]) == 8  # two rounds of four calls; the first round is thrown away
    assert "median_ms" not in found["rows"][LIMIT]
    assert found["rows"]["3 users, sockets"]["limit"] == "network step, 3 users"
