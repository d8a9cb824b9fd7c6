"""The benchmark of worlds on a few of them: what it measures and writes, and what its meters read."""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import torch

from configs.source_code import PROJECT_ROOT
from datasets.library.motion_library import MotionLibrary
from envs.torch_env import AdaptMimicTorchEnv
from eval.benchmark import cli as benchmark
from eval.benchmark import worlds as benchmark_worlds
from eval.benchmark.timing import world_memory
from eval.benchmark.timing.device_memory import synchronize, used_memory_bytes
from eval.benchmark.timing.world_memory import memory_per_world_kib as each_world
from eval.benchmark.worlds import BareWarpPhysics, BenchmarkSizes, measure_worlds
from tests.trainers.conftest import standing
from trainers.runs.device import device_name

CPU, CUDA = torch.device("cpu"), torch.device("cuda")
SIZES = BenchmarkSizes({4: 3, 8: 2}, native_worlds=5, native_steps=2)
pytest.importorskip("mujoco_warp")


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    """Let torch use one thread: two that wait for each other on a busy machine take ten times as long."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.fixture(scope="module")
def library() -> MotionLibrary:
    return MotionLibrary.from_clips([standing("one", "ann"), standing("two", "bob", 130)])


class Counting(AdaptMimicTorchEnv):
    """An env whose actions are noted."""

    taken: list[np.ndarray]

    def step(self, actions: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor, dict]:
        """Note and step."""
        type(self).taken.append(actions.numpy())
        return super().step(actions)


def test_measured_are_so_many_worlds(library: MotionLibrary, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(world_memory, "AdaptMimicTorchEnv", Counting)  # not the training's
    Counting.taken = []
    rounds = []
    speed = measure_worlds(library, 1, SIZES, CPU, lambda: rounds.append(1))
    assert torch.get_num_threads() == 1  # learners left it as it was
    assert len(rounds) == 2  # the first is thrown away
    # One world is built so that all is loaded, then 4 and 8; each takes a step for its memory, and two blocks of 3 and of 2 steps.
    steps = {worlds: [actions for actions in Counting.taken if len(actions) == worlds] for worlds in (1, 4, 8)}
    assert {worlds: len(found) for worlds, found in steps.items()} == {1: 1, 4: 1 + 2 * 3, 8: 1 + 2 * 2}
    for found in (steps[4][1:], steps[8][1:]):
        assert 0.05 < np.abs(found).max() <= 0.1  # of the largest of 2 * 8 * 20 uniform numbers nothing else is likely
    assert [(one.name, one.limit) for one in speed.cases] == [
        ("torch env, 4 worlds", "bare mujoco-warp, 4 worlds"),
        ("bare mujoco-warp, 4 worlds", ""),
        ("training, 4 worlds", "torch env, 4 worlds"),
        ("torch env, 8 worlds", "bare mujoco-warp, 8 worlds"),
        ("bare mujoco-warp, 8 worlds", ""),
        ("training, 8 worlds", "torch env, 8 worlds"),
        ("native env, 5 worlds, all cores", ""),
    ]
    done = []
    for one in speed.cases:
        one.prepare()
        done.append(one.run())
    # 3 steps of 4 worlds and 2 of 8; rollouts of 16 steps; 2 steps of 5 native worlds.
    assert done == [12, 12, 64, 16, 16, 128, 10]


def test_it_writes_its_figures(
    library: MotionLibrary, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(benchmark_worlds, "load_motion_library", lambda motions: {"somewhere": library}[motions])
    monkeypatch.setattr(benchmark_worlds, "resolve_device", lambda name: {"auto": CPU}[name])
    monkeypatch.setitem(benchmark_worlds.SIZES, "cpu", SIZES)
    monkeypatch.setenv("COLUMNS", "100")
    assert benchmark.main(["worlds", "--motions", "somewhere", "--rounds", "1", "--json", str(tmp_path / "worlds.json")]) == 0
    found = json.loads((tmp_path / "worlds.json").read_text())
    assert (found["benchmark"], found["unit"], found["rounds"]) == ("worlds", "control steps/s", 1)
    assert found["ours"] == found["rows"]["torch env, 8 worlds"]["rate"]
    assert found["limit"] == found["rows"]["bare mujoco-warp, 8 worlds"]["rate"]
    assert set(found["peers"]) == {"native env, 5 worlds, all cores"}
    assert all(row["rate"] > 0.0 for row in found["rows"].values())
    assert (found["device"], found["device_name"]) == ("cpu", device_name(CPU))
    assert set(found["memory_mib"]) == {"4", "8"}
    out = capsys.readouterr().out
    assert "mjlab" in out
    assert device_name(CPU) in out
    assert max(map(len, out.splitlines())) <= 100


def test_bare_physics_takes_the_same_step_again_and_again(library: MotionLibrary) -> None:
    env = AdaptMimicTorchEnv(library, 2)
    env.reset(seed=0)
    once, often = BareWarpPhysics(2, CPU), BareWarpPhysics(2, CPU)
    once.initial_state = often.initial_state = env.physics.get_state()
    once.repeat_step(1)
    often.repeat_step(3)
    found = once.get_state()["qpos"]
    assert not torch.equal(found, once.initial_state["qpos"])
    assert torch.equal(found, often.get_state()["qpos"])


def test_one_more_world_is_what_more_worlds_take_each() -> None:
    # From 4 to 12 worlds 2 MiB = 2048 KiB, 256 each; from 12 to 44 worlds 1 MiB = 1024 KiB, 32 each. The first 10 MiB are the motions'.
    assert each_world({4: 10.0, 12: 12.0, 44: 13.0}) == [256.0, 32.0]


def test_memory_of_a_process_grows_by_what_it_holds() -> None:
    # In a process of its own: of the tests' the system may take memory away meanwhile, and children of other tests count, too.
    code = """
import numpy as np, torch
from eval.benchmark.timing.device_memory import used_memory_bytes
before = used_memory_bytes(torch.device("cpu"))
held = np.ones(8 * 2**20)  # of 8 bytes: 64 MiB
print(before, used_memory_bytes(torch.device("cpu")))
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=PROJECT_ROOT, capture_output=True, text=True, check=True)
    before, after = map(int, done.stdout.split())
    if not before:
        pytest.skip("this system does not tell the memory of a process")
    assert (after - before) / 2**20 == pytest.approx(64.0, abs=4.0)


def test_a_card_is_waited_for_and_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    waited = []
    monkeypatch.setattr(torch.cuda, "synchronize", waited.append)
    monkeypatch.setattr(torch.cuda, "mem_get_info", lambda device: {CUDA: (30, 100)}[device])
    synchronize(CPU)
    assert waited == []
    synchronize(CUDA)
    assert waited == [CUDA]
    assert used_memory_bytes(CUDA) == 70  # of 100 bytes 30 are free
