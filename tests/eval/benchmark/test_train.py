"""The benchmark of training: the rules of its race, its processes, and what it writes after trainings of a few steps."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import monotonic, sleep
from typing import Any, Self

import numpy as np
import pytest

from configs.errors import InputError
from configs.source_code import PROJECT_ROOT
from datasets.library.motion_library import MotionLibrary
from eval.benchmark import cli as benchmark
from eval.benchmark import train as benchmark_train
from eval.benchmark.peers.trainings import PeerEnvs, TrainingTask, our_training, peer_training, policy_length_ratio, training_length_ratio
from eval.benchmark.timing.process_tree import tree_memory_bytes
from eval.benchmark.timing.time_to_score import Contestant, Evaluation, TimeToScore
from eval.benchmark.timing.worker_process import TrainingProcess
from eval.benchmark.train import LIMIT, OURS, PEER, choose_two_clips, measure_train, median_of
from tests.envs.states import swaying
from tests.eval.benchmark.timing.words_held import add, die, fill, words_of
from trainers.algorithms.ppo_config import CollectConfig, LearnerConfig, NetworkConfig, PpoConfig
from trainers.evaluation.evaluation_protocol import zero_residual

MIB = 2**20


@pytest.fixture(scope="module")
def task() -> TrainingTask:
    config = PpoConfig(
        network=NetworkConfig(hidden=(8,)),
        collect=CollectConfig(actors=0, envs=4, threads=2, horizon=4),
        learner=LearnerConfig(epochs=2, minibatch=8, threads=2),
    )
    return TrainingTask(config, choose_two_clips(MotionLibrary.from_clips([swaying("sway", 150, 0.3), swaying("glide", 150, 0.5)])))


class Clock:
    """Stands still unless told how long something took."""

    def __init__(self) -> None:
        """Begin at zero."""
        self.now = 0.0

    def __call__(self) -> float:
        """Return the time [s]."""
        return self.now

    def runner(self, name: str, seconds: float, scores: list[float]) -> Contestant:
        """Return one whose iterations of 10 samples take ``seconds``, whose scorings take an hour and give these scores."""
        coming = iter(scores)

        def train() -> int:
            self.now += seconds
            return 10

        def score() -> float:
            self.now += 3600.0
            return next(coming)

        return Contestant(name, train, score)


def test_who_has_trained_least_goes_next_until_it_is_steadily_there() -> None:
    clock, order = Clock(), []
    quick, slow = clock.runner("quick", 4.0, [0.1, 0.2, 0.9, 0.7, 0.9]), clock.runner("slow", 15.0, [0.7, 0.9, 0.81])
    race = TimeToScore(target_score=0.8, max_minutes=10.0, evaluation_interval_s=10.0)
    race.run([quick, slow], lambda runner: order.append(runner.name), clock)
    # Laps of quick are three iterations, 12 s; those of slow one iteration, 15 s. Their clocks before each lap:
    # (0, 0) quick, (12, 0) slow, (12, 15) quick, (24, 15) slow, (24, 30) quick, (36, 30) slow: 0.7, 0.9 and 0.81 are 0.803 on average;
    # quick goes on alone: (0.2 + 0.9 + 0.7) / 3 = 0.6 after 48 s, (0.9 + 0.7 + 0.9) / 3 = 0.83 after 60 s.
    assert order == ["quick", "slow", "quick", "slow", "quick", "slow", "quick", "quick"]
    assert [lap.samples for lap in quick.evaluations] == [30, 60, 90, 120, 150]
    assert [lap.minutes for lap in quick.evaluations] == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])
    assert slow.evaluations == [Evaluation(0.25, 10, 0.7), Evaluation(0.5, 20, 0.9), Evaluation(0.75, 30, 0.81)]
    assert race.first_reached(slow) == slow.evaluations[1]
    assert race.first_sustained(slow) == slow.evaluations[2]
    result = race.result(quick)
    assert {name: result[name] for name in ("minutes", "samples", "minutes_steady", "samples_steady", "best")} == {
        "minutes": pytest.approx(0.6),
        "samples": 90,
        "minutes_steady": pytest.approx(1.0),
        "samples_steady": 150,
        "best": 0.9,
    }


def test_who_does_not_get_there_in_time_is_said_so() -> None:
    clock = Clock()
    runner = clock.runner("late", 15.0, [0.4, 0.85, 0.5, 0.3, 0.9])
    race = TimeToScore(target_score=0.8, max_minutes=1.0, evaluation_interval_s=15.0)
    race.run([runner], lambda _: None, clock)
    result = race.result(runner)
    assert (result["minutes"], result["minutes_steady"], result["best"]) == (0.5, None, 0.85)
    assert [lap["samples"] for lap in result["curve"]] == [10, 20, 30, 40]  # four laps are a minute


def test_a_median_takes_who_never_arrived_for_the_last() -> None:
    assert median_of([3.0, None, 2.0]) == 3.0
    assert median_of([None, None, 2.0]) is None
    assert median_of([4.0, 2.0]) == 3.0


def test_a_process_keeps_what_it_made_and_says_when_it_died() -> None:
    with TrainingProcess("words", partial(words_of, "one")) as process:
        assert process.call(partial(add, "two")) == ["one", "two"]
        assert process.call(partial(add, "three")) == ["one", "two", "three"]
        bare = process.peak_memory(partial(add, "four"))  # bytes
        if bare:  # where the system tells
            assert 0.95 * 300 * MIB < process.peak_memory(partial(fill, 300 * MIB)) - bare < 1.05 * 300 * MIB
        process.pause()
        process._tell(partial(add, "five"))
        assert not process._pipe.poll(0.3)
        process.go_on()
        assert process._answer() == ["one", "two", "three", "four", "five"]
        with pytest.raises(RuntimeError, match="the process of words ended by itself"):
            process.call(die)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux wakes a process whose parent died")
def test_nobody_stands_still_for_ever_when_the_benchmark_is_killed(tmp_path: Path) -> None:
    program = """
if __name__ == "__main__":
    import os, signal
    from functools import partial
    from eval.benchmark.timing.worker_process import TrainingProcess
    from tests.eval.benchmark.timing.words_held import add, words_of
    process = TrainingProcess("words", partial(words_of, "one"))
    process.call(partial(add, "two"))
    process.pause()
    print(process._id, flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
"""
    (tmp_path / "killed.py").write_text(program)
    environment = {**os.environ, "PYTHONPATH": str(PROJECT_ROOT)}
    killed = subprocess.run([sys.executable, tmp_path / "killed.py"], stdout=subprocess.PIPE, text=True, check=False, env=environment)
    assert killed.returncode == -9
    assert int(killed.stdout) > 0
    left = Path("/proc") / killed.stdout.strip() / "cmdline"  # empty, or no more, once the process has ended
    deadline = monotonic() + 10.0
    while left.exists() and left.read_text() and monotonic() < deadline:
        sleep(0.05)
    assert not (left.exists() and left.read_text())


@pytest.mark.skipif(not Path("/proc/self/smaps_rollup").exists(), reason="the system does not tell how much memory a process holds")
def test_memory_is_that_of_a_process_and_its_children() -> None:
    program = "import subprocess, sys; held = bytearray(b'x') * (30 * 2**20); "
    child = program + "print(flush=True); sys.stdin.read()"
    both = program + f"subprocess.run([sys.executable, '-c', {child!r}])"
    with subprocess.Popen([sys.executable, "-c", both], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdout.readline()  # both hold 30 MiB now
        assert 60 * MIB < tree_memory_bytes(process.pid) < 120 * MIB  # and an interpreter each
        process.stdin.close()
    assert tree_memory_bytes(process.pid) == 0


@pytest.mark.parametrize("make", [our_training, partial(peer_training, envs=PeerEnvs("DummyVecEnv", 4))])
def test_an_iteration_is_a_batch(task: TrainingTask, make: Callable) -> None:
    with make(task) as training:
        assert [training.iterate(), training.iterate()] == [16, 16]  # 4 worlds or envs, 4 steps each
        actions = training.act(np.zeros((3, 273), dtype=np.float32))
        assert actions.shape == (3, 20)
        assert 0.0 < training_length_ratio(training) <= 1.0


def test_the_pair_is_two_walks_or_what_comes_first() -> None:
    clips = [swaying(name, frames, 0.3) for name, frames in (("a", 130), ("b", 119), ("c", 130), ("d", 140), ("e", 150))]
    kinds = ["stand", "walk", "walk", "run", "walk"]
    library = MotionLibrary.from_clips([replace(clip, kind=kind) for clip, kind in zip(clips, kinds, strict=True)])
    assert [clip.name for clip in choose_two_clips(library).clips] == ["c", "e"]  # b is shorter than two seconds
    assert [clip.name for clip in choose_two_clips(library.select([True, False, True, True, False])).clips] == ["a", "c"]
    with pytest.raises(InputError, match="two clips of 120 frames or more are learnt, the motion source has 1"):
        choose_two_clips(library.select([True, True, False, False, False]))


def write_figures(task: TrainingTask, peer_envs: tuple[PeerEnvs, ...], file: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Run the benchmark on a task for a moment; return what it wrote."""

    def small(motions: str, rounds: int, after_round: Callable[[], None]) -> benchmark.BenchmarkResult:
        assert motions == "synthetic"
        return measure_train(
            task, rounds, TimeToScore(target_score=2.0, max_minutes=0.0005, evaluation_interval_s=0.01), (0, 7), peer_envs, after_round
        )

    monkeypatch.setitem(benchmark.BENCHMARKS, "train", small)
    assert benchmark.main(["train", "--rounds", "1", "--json", str(file)]) == 0
    return json.loads(file.read_text())


class Here:
    """Stands for a process, so that nothing has to be started."""

    def __init__(self, name: str, make: Callable[[], AbstractContextManager[Any]]) -> None:
        """Make it."""
        self._made = make()

    def call(self, task: Callable[[Any], Any]) -> Any:
        """Do it."""
        return task(self._held)

    def peak_memory(self, task: Callable[[Any], Any]) -> int:
        """Do it; return a number of bytes."""
        task(self._held)
        return 3 * MIB

    def pause(self) -> None:
        """Do nothing."""

    go_on = pause

    def __enter__(self) -> Self:
        """Enter what was made."""
        self._held = self._made.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        """Leave it."""
        self._made.__exit__(None, None, None)


def test_benchmark_writes_its_figures(
    task: TrainingTask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(benchmark_train, "TrainingProcess", Here)
    monkeypatch.setattr(benchmark_train, "_with_actors", lambda task, actors, threads: task)
    found = write_figures(task, (PeerEnvs("DummyVecEnv", 4), PeerEnvs("DummyVecEnv", 2)), tmp_path / "train.json", monkeypatch)
    assert (found["benchmark"], found["unit"], found["rounds"]) == ("train", "samples/s", 1)
    assert set(found["ratios"]) == {"limit", PEER}
    assert found["ours"] == found["rows"][OURS]["rate"]
    assert {name: row["limit"] for name, row in found["rows"].items()} == {
        OURS: LIMIT,
        "ours, Ray, 1 actor of 2": LIMIT,
        "ours, Ray, 2 actors of 1": LIMIT,
        PEER: LIMIT,
        LIMIT: None,
    }
    assert found["clips"] == ["sway", "glide"]
    assert found["zero_residual"] == policy_length_ratio(zero_residual(task.config.task), task)
    assert set(found["peer_envs"]) == {"DummyVecEnv 4", "DummyVecEnv 2"}
    assert found["memory_mib"] == dict.fromkeys(found["rows"], 3.0)
    for arrived in found["to_goal"].values():  # nobody lasts twice as long as the reference
        assert arrived["minutes"] is None
        assert [run["seed"] for run in arrived["runs"]] == [0, 7]
        for run in arrived["runs"]:
            assert run["minutes_steady"] is None
            assert run["best"] == max(lap["score"] for lap in run["curve"]) <= 1.0
            assert run["curve"][-1]["minutes"] >= 0.0005
    told = capsys.readouterr()
    assert "0.0005" in told.out  # not within so many minutes
    assert f"seed 7, {PEER}: " in told.err


@pytest.mark.slow
def test_benchmark_with_processes_of_its_own(task: TrainingTask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = write_figures(task, (PeerEnvs("SubprocVecEnv", 2),), tmp_path / "train.json", monkeypatch)
    assert all(row["rate"] > 0.0 for row in found["rows"].values())
    assert set(found["to_goal"]) == {OURS, PEER}


def test_who_lacks_the_peer_is_told_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(benchmark_train, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"stable-baselines3, which is not installed: pip install '\.\[benchmark\]'"):
        benchmark_train.benchmark_train("synthetic", 1)
