"""The env's benchmark on a few worlds: what it writes, that its limit does the same work, and what it refuses."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from configs.errors import InputError
from datasets.library.motion_library import MotionLibrary
from envs.vector_env import AdaptMimicVectorEnv
from eval.benchmark import cli as benchmark
from eval.benchmark.env import measure_envs
from eval.benchmark.peers.bare_mujoco import BareBatch, BareStep, ControlRecorder
from eval.benchmark.root import RootTask, measure_root
from tests.envs.states import swaying


@pytest.fixture(scope="module")
def library() -> MotionLibrary:
    return MotionLibrary.from_clips([swaying("sway", 60, 0.3), swaying("walk", 90, 0.5)])


def recorded(library: MotionLibrary, worlds: int) -> ControlRecorder:
    """Return what an env did in 30 steps that ended some of its episodes."""
    env = AdaptMimicVectorEnv(library, worlds)
    env.physics = recorder = ControlRecorder(worlds, 1)
    env.reset(seed=0)
    recorder.restart_recording()
    rng = np.random.default_rng(0)
    ended = 0
    for _ in range(30):
        _, _, terminated, truncated, _ = env.step(rng.uniform(-1, 1, (worlds, 20)))
        ended += int((terminated | truncated).sum())
    assert ended > 0
    return recorder


def test_bare_mujoco_goes_the_same_way(library: MotionLibrary) -> None:
    many, one = recorded(library, 5), recorded(library, 1)
    for bare, steps in ((BareBatch(many, 5, 2), 150), (BareStep(one), 30)):
        for _ in range(2):  # it raises if it ends elsewhere
            bare.prepare()
            assert bare.run() == steps


def test_another_way_is_noticed(library: MotionLibrary) -> None:
    recorder = recorded(library, 2)
    recorder.targets[-1] = recorder.targets[-1] + 0.01
    bare = BareBatch(recorder, 2, 1)
    bare.prepare()
    with pytest.raises(RuntimeError, match="did not end in the env's states"):
        bare.run()


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")  # of Python 3.12: Gymnasium's processes are forked
def test_benchmark_writes_its_figures(
    library: MotionLibrary, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def small(motions: str, rounds: int, after_round: benchmark.Callable[[], None]) -> benchmark.BenchmarkResult:
        assert motions == "synthetic"
        return measure_envs(library, rounds, worlds=4, peer_worlds=2, steps=3, after_round=after_round)

    monkeypatch.setitem(benchmark.BENCHMARKS, "env", small)
    assert benchmark.main(["env", "--rounds", "2", "--json", str(tmp_path / "env.json")]) == 0
    found = json.loads((tmp_path / "env.json").read_text())
    assert (found["benchmark"], found["unit"], found["rounds"]) == ("env", "control steps/s", 2)
    assert found["ours"] > 0.0
    assert found["limit"] > 0.0
    assert set(found["peers"]) == {"AsyncVectorEnv 2", "SyncVectorEnv 2"}
    assert set(found["ratios"]) == {"limit", *found["peers"]}
    assert {name: row["limit"] for name, row in found["rows"].items()} == {
        "vector env, 1 thread": "bare MuJoCo, 1 thread",
        "bare MuJoCo, 1 thread": None,
        "exact contacts, 1 thread": "vector env, 1 thread",
        "vector env, 2 threads": "bare MuJoCo, 2 threads",
        "bare MuJoCo, 2 threads": None,
        "single env": "bare mj_step",
        "bare mj_step": None,
        "AsyncVectorEnv 2": None,
        "SyncVectorEnv 2": None,
    }
    assert all(row["rate"] > 0.0 for row in found["rows"].values())
    assert "control steps/s" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["env", "--rounds", "0"], "error: --rounds is 0, should be 1 or more"),
        (["env", "--json", "/nowhere/at/all.json"], "error: --json /nowhere/at/all.json: there is no folder /nowhere/at"),
        (["env", "--motions", "/nowhere"], "error: /nowhere: no such file or folder"),
    ],
)
def test_bad_arguments_end_with_one_line(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert benchmark.main(arguments) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error


def test_unknown_benchmark_names_those_that_exist(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as exit_:
        benchmark.main(["speed"])
    assert exit_.value.code == 2
    assert "env" in capsys.readouterr().err


@pytest.mark.usefixtures("three_threads")
def test_root_benchmark_writes_its_figures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def small(motions: str, rounds: int, after_round: benchmark.Callable[[], None]) -> benchmark.BenchmarkResult:
        assert motions == "synthetic"
        clip = replace(swaying("sway", 80, 0.3), fps=100.0)
        return measure_root(RootTask(clip, np.zeros((80, 19, 3)), 70), rounds, after_round)

    monkeypatch.setitem(benchmark.BENCHMARKS, "root", small)
    threads = torch.get_num_threads()
    assert benchmark.main(["root", "--rounds", "1", "--json", str(tmp_path / "root.json")]) == 0
    assert torch.get_num_threads() == threads
    found = json.loads((tmp_path / "root.json").read_text())
    assert (found["benchmark"], found["unit"], found["rounds"]) == ("root", "frames/s", 1)
    assert found["ours"] == found["rows"]["Root3D stream"]["rate"]
    assert set(found["peers"]) == {"Root3D in plain PyTorch", "foot contacts"}
    assert {name: row["limit"] for name, row in found["rows"].items() if row["limit"]} == {
        "Root3D stream": "Root3D network, unrolled",
        "planar stream": "planar network, a window a call",
        "Root3D, whole clip": "Root3D network, in batches",
        "planar, whole clip": "planar network, in batches",
    }
    assert all(row["rate"] > 0.0 for row in found["rows"].values())
    assert "frames/s" in capsys.readouterr().out


def test_root_benchmark_needs_a_window_of_motion() -> None:
    clip = replace(swaying("sway", 40, 0.3), fps=100.0)
    with pytest.raises(InputError, match="40 frames at 100 Hz is too short for planar_unet, which needs 64"):
        measure_root(RootTask(clip, np.zeros((40, 19, 3)), 40), 1)
