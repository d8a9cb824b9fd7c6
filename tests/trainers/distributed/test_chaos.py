"""A training to which everything happens that can happen to one, in a random order with a seed: it recovers each time.

In the suite there is what nothing else tests: a collector that hangs, and all of them killed.
``python -m pytest -m slow tests/trainers/distributed/test_chaos.py`` does one of everything, and fifty kills.
"""

import os
import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from configs.source_code import PROJECT_ROOT
from tests.trainers.processes import alive, descendants
from tests.trainers.run_comparison import final_state
from trainers.runs.checkpoint import load_newest

COLLECTOR = "ray::CpuCollector"
PATIENCE = 120.0  # s in which a run has to recover
ROLLOUT = 32  # samples: 4 worlds, 8 steps


class Run:
    """A small run that is never let alone."""

    def __init__(self, folder: Path, seed: int) -> None:
        """Choose a folder and an order of things to come; nothing is started yet."""
        self.folder, self.random = folder, random.Random(seed)
        self.process: subprocess.Popen[str] | None = None
        self.starts = 0
        self.doomed: list[int] = []  # processes that should be gone by the end

    @property
    def checkpoints(self) -> Path:
        """Folder of the run's checkpoints."""
        return self.folder / "small" / "checkpoints"

    def iteration(self) -> int:
        """Return that of the newest checkpoint."""
        return max((int(path.stem) for path in self.checkpoints.glob("*.safetensors")), default=0)

    def samples(self) -> int:
        """Return those of the newest whole checkpoint."""
        newest = load_newest(self.checkpoints)
        return int(newest[0]["clock"]["samples"]) if newest else 0

    def start(self, **environment: str) -> None:
        """Start the run, or go on with it, and wait until it has come further."""
        resume = ["--resume"] if self.samples() else []
        overlap = f"collect.overlap={self.random.choice(('true', 'false'))}"
        command = [sys.executable, "-m", "tests.trainers.small_run", str(self.folder), "samples=100000000", overlap, *resume]
        with (self.folder / f"log.{self.starts}").open("w") as log:
            told = {**os.environ, **environment}
            self.process = subprocess.Popen(command, cwd=PROJECT_ROOT, stdout=log, stderr=subprocess.STDOUT, text=True, env=told)
        self.starts += 1

    def said(self) -> str:
        """Return what the run has said since its last start."""
        return (self.folder / f"log.{self.starts - 1}").read_text()

    def wait_for(self, iteration: int) -> None:
        """Wait until there is a checkpoint of an iteration."""
        assert self.process
        end = time.monotonic() + PATIENCE
        while self.iteration() < iteration:
            assert self.process.poll() is None, f"it ended with {self.process.returncode}:\n{self.said()}"
            assert time.monotonic() < end, f"no checkpoint of iteration {iteration} within {PATIENCE:g} s:\n{self.said()}"
            time.sleep(0.05)

    def collectors(self) -> list[int]:
        """Return the processes that collect."""
        assert self.process
        return descendants(self.process.pid, COLLECTOR)

    def everything(self) -> list[int]:
        """Return all processes of the run."""
        assert self.process
        return [self.process.pid, *descendants(self.process.pid)]

    def end(self, by: signal.Signals) -> None:
        """End the run by a signal, and go on with it from just where its newest whole checkpoint is."""
        assert self.process
        self.doomed += self.everything()
        self.process.send_signal(by)
        code = self.process.wait(PATIENCE)
        if by != signal.SIGKILL:
            assert code == 0, self.said()
            assert "stopped and saved" in self.said()
        self.go_on()

    def go_on(self, **environment: str) -> None:
        """Go on from just where the newest whole checkpoint is."""
        samples, iteration = self.samples(), self.iteration()
        self.start(**environment)
        self.wait_for(iteration + 1)
        assert f"at {samples:,} samples" in self.said()  # nothing between is lost, nothing is counted again

    def do(self, event: str) -> None:
        """Let something happen, and wait until the run has recovered from it."""
        time.sleep(self.random.uniform(0.0, 0.5))
        before = self.iteration()
        EVENTS[event](self)
        self.wait_for(max(before, self.iteration()) + 2)
        self.wait_until_full()

    def kill(self, collectors: int) -> None:
        """Kill some collectors at once."""
        self.wait_until_full()  # on a busy machine a slow one may just have been given up as hung
        for pid in self.random.sample(self.collectors(), collectors):
            os.kill(pid, signal.SIGKILL)

    def hang(self) -> None:
        """Let a collector be there and do nothing."""
        os.kill(self.random.choice(self.collectors()), signal.SIGSTOP)

    def wait_until_full(self) -> None:
        """Wait until both collectors are there again."""
        end = time.monotonic() + PATIENCE
        while len([pid for pid in self.collectors() if not stopped(pid)]) < 2:
            assert time.monotonic() < end, f"no two collectors within {PATIENCE:g} s:\n{self.said()}"
            time.sleep(0.1)

    def spoil(self) -> None:
        """Kill the run and change a byte of the newest checkpoint: it goes on from the one before."""
        assert self.process
        self.doomed += self.everything()
        self.process.kill()
        self.process.wait()
        newest = max(self.checkpoints.glob("*.safetensors"))
        held = bytearray(newest.read_bytes())
        held[-1 - self.random.randrange(100)] ^= 255
        newest.write_bytes(held)
        iteration = self.iteration()
        samples = self.samples()
        self.start()
        self.wait_for(iteration + 1)
        assert f"checkpoint {newest} is broken" in self.said()
        assert f"at {samples:,} samples" in self.said()

    def fill_the_disk(self) -> None:
        """Let the system refuse everything that the run writes for a while."""
        assert self.process
        resource.prlimit(self.process.pid, resource.RLIMIT_FSIZE, (16384, resource.RLIM_INFINITY))
        end = time.monotonic() + PATIENCE
        while "no checkpoint could be written" not in self.said() and time.monotonic() < end:
            time.sleep(0.1)
        resource.prlimit(self.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))

    def end_the_job(self) -> None:
        """Start the run anew in a scheduler's job that ends soon: it saves and ends before."""
        assert self.process
        self.doomed += self.everything()
        self.process.terminate()
        self.process.wait(PATIENCE)
        self.go_on(SLURM_JOB_END_TIME=str(round(time.time()) + 85))  # a minute is left to saving
        assert self.process.wait(PATIENCE) == 0, self.said()
        assert "the scheduler's job is about to end" in self.said()
        self.go_on()


EVENTS: dict[str, Callable[[Run], None]] = {
    "kill a collector": lambda run: run.kill(1),
    "kill all collectors": lambda run: run.kill(2),
    "hang a collector": Run.hang,
    "kill the run": lambda run: run.end(signal.SIGKILL),
    "interrupt": lambda run: run.end(signal.SIGINT),
    "terminate": lambda run: run.end(signal.SIGTERM),
    "spoil a checkpoint": Run.spoil,
    "fill the disk": Run.fill_the_disk,
    "end the job": Run.end_the_job,
}


def stopped(pid: int) -> bool:
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] in "TZ"


def live_through(events: list[str], folder: Path, seed: int) -> Run:
    run = Run(folder, seed)
    run.start()
    try:
        run.wait_for(2)
        for event in events:
            before = run.samples()
            run.do(event)
            assert run.samples() > before or event == "spoil a checkpoint"
        assert run.process
        run.doomed += run.everything()
        run.process.terminate()
        assert run.process.wait(PATIENCE) == 0, run.said()
    finally:
        left = run.everything()
        for pid in left:
            if alive([pid]):
                os.kill(pid, signal.SIGKILL)
    return run


def check(run: Run) -> None:
    """Check what must be true of a run that was lived through."""
    state = final_state(run.folder / "small")
    assert state["clock"]["samples"] % ROLLOUT == 0  # whole rollouts
    assert not list(run.checkpoints.glob(".*.tmp"))
    end = time.monotonic() + 75.0  # Ray's own two helpers of a killed run try for a minute to report that it is gone, and then go
    while alive(run.doomed) and time.monotonic() < end:
        time.sleep(0.5)
    assert alive(run.doomed) == []  # no orphans


def test_collectors_that_hang_or_are_gone(tmp_path: Path) -> None:
    check(live_through(["hang a collector", "kill all collectors"], tmp_path, 0))


@pytest.mark.slow
def test_one_of_everything(tmp_path: Path) -> None:
    events = list(EVENTS)
    random.Random(0).shuffle(events)
    events.sort(key=lambda event: event not in ("kill the run", "spoil a checkpoint"))  # first, so that their minute is over at the end
    check(live_through(events, tmp_path, 0))


@pytest.mark.slow
def test_fifty_kills(tmp_path: Path) -> None:
    kills = ("kill a collector", "kill all collectors", "kill the run")
    check(live_through(random.Random(1).choices(kills, k=50), tmp_path, 1))
