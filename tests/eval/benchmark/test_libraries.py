"""The benchmark of RL libraries: what counts as a rollout and as an update, what it writes, and what is left out."""

from functools import partial
from pathlib import Path

import pytest

from datasets.formats.bvh import write_bvh
from datasets.library.motion_library import MotionLibrary
from datasets.retarget.humanoid_bvh import to_humanoid_bvh
from eval.benchmark import libraries
from eval.benchmark.libraries import measure_libraries
from eval.benchmark.peers.library_trainings import LIBRARIES, LibraryTraining, library_training, read_example
from eval.benchmark.timing.worker_process import TrainingProcess
from tests.envs.states import swaying

# Three rollouts of 2 worlds, of 3, 4 and 5 steps, and an update of two optimiser's steps after each.
EXAMPLE = """
import numpy as np, torch
from datasets.library.motion_library import MotionLibrary
from envs.vector_env import AdaptMimicVectorEnv
from tests.builders import posed

env = AdaptMimicVectorEnv(MotionLibrary.from_clips([posed({}, 60)]), 2)
env.reset(seed=0)
weight = torch.nn.Parameter(torch.zeros(1))
optimizer = torch.optim.Adam([weight])
for steps in (3, 4, 5):
    for _ in range(steps):
        env.step(np.zeros((2, 20)))
    for _ in range(2):
        (weight**2).sum().backward()
        optimizer.step()
print("not to be seen")
"""


def test_rollouts_and_updates_take_turns(capfd: pytest.CaptureFixture[str]) -> None:
    with TrainingProcess("example", partial(library_training, EXAMPLE)) as process:
        turns = [process.call(call) for _ in range(2) for call in (LibraryTraining.collect, LibraryTraining.update)]
        assert turns == [6, 6, 8, 8]
        assert process.call(LibraryTraining.collect) == 10
        with pytest.raises(RuntimeError):  # after the last update there is no step
            process.call(LibraryTraining.update)
    printed = capfd.readouterr()
    assert "the example came to its end" in printed.err
    assert "not to be seen" not in printed.out


def test_benchmark_writes_its_figures_and_says_what_is_left_out(library: MotionLibrary, clip: str) -> None:
    found = measure_libraries(library, clip, ["CleanRL"], rounds=1)
    figures = found.summary()
    assert (figures["benchmark"], figures["unit"], set(figures["peers"])) == ("libraries", "control steps/s", {"CleanRL"})
    rows = figures["rows"]
    assert rows["CleanRL"]["limit"] == "vector env, 1 thread"
    assert rows["CleanRL"]["ratio"] == pytest.approx(rows["CleanRL"]["rate"] / rows["vector env, 1 thread"]["rate"])
    # One round: as many steps collected and learnt from take the time of both.
    both = 1.0 / (1.0 / rows["CleanRL"]["rate"] + 1.0 / rows["CleanRL, update"]["rate"])
    assert figures["training"]["CleanRL"] == pytest.approx(both)
    assert "RLlib is not installed and left out: pip install 'ray[rllib]'" in found.notes
    assert not any("CleanRL is not installed" in str(note) for note in found.notes)


def test_libraries_that_are_not_installed_are_not_started(monkeypatch: pytest.MonkeyPatch, clip: str) -> None:
    asked: list[list[str]] = []
    monkeypatch.setattr(libraries, "missing_libraries", lambda: ["RLlib", "TorchRL"])
    monkeypatch.setattr(libraries, "measure_libraries", lambda _library, _motions, names, *_: asked.append(names))
    libraries.benchmark_libraries(clip, 1)
    assert asked == [["Stable-Baselines3", "CleanRL", "rsl_rl"]]


@pytest.mark.parametrize("library_name", LIBRARIES)
def test_examples_take_steps_and_motions(library_name: str) -> None:
    code = read_example(library_name, 4096, "clips/walk.bvh")
    assert "4096" in code
    assert "\"envs:AdaptMimic-v0\", motions='clips/walk.bvh'" in code
    assert "motions" not in read_example(library_name, 4096)


@pytest.fixture
def clip(tmp_path: Path) -> str:
    write_bvh(tmp_path / "sway.bvh", to_humanoid_bvh(swaying("sway", 120, 0.0)))
    return str(tmp_path / "sway.bvh")


@pytest.fixture
def library() -> MotionLibrary:
    return MotionLibrary.from_clips([swaying("sway", 120, 0.0)])
