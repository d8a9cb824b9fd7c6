"""Trainings of a study: program, config and overrides of each, its progress, and the command that starts it."""

import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from configs.errors import InputError
from configs.load import CONFIG_DIR, load_config
from trainers.algorithms.ppo_config import PpoConfig
from trainers.runs.checkpoint import load_newest
from trainers.runs.progress import RunClock
from trainers.supervised.lobstr_config import LobstrConfig
from trainers.supervised.restore_config import RestoreConfig
from trainers.supervised.root_config import RootConfig

Config = TypeVar("Config", PpoConfig, RootConfig, LobstrConfig, RestoreConfig)


@dataclass(frozen=True)
class TrainingProgram(Generic[Config]):
    """A program that trains networks.

    Attributes:
        module: Module that is run.
        config: Class of its config.
        weights_file: Path, in a run's folder, of the best network.
    """

    module: str
    config: type[Config]
    weights_file: str


ROOT_PROGRAM = TrainingProgram("trainers.supervised", RootConfig, "best/model.safetensors")
LOBSTR_PROGRAM = TrainingProgram("trainers.supervised", LobstrConfig, "best/model.safetensors")
RESTORE_PROGRAM = TrainingProgram("trainers.supervised", RestoreConfig, "best/model.safetensors")
PPO_PROGRAM = TrainingProgram("trainers.ppo", PpoConfig, "best/policy.safetensors")


@dataclass(frozen=True)
class Training(Generic[Config]):
    """One run of a program.

    Attributes:
        program: Program that trains.
        config: Name of the file in ``configs/``, without its ending.
        overrides: Overrides of the config, without those of name and folder.
        name: Name of the run.
        runs: Absolute path of the folder of all runs.
    """

    program: TrainingProgram[Config]
    config: str
    overrides: tuple[str, ...]
    name: str
    runs: Path

    @property
    def folder(self) -> Path:
        """Folder of the run."""
        return self.runs / self.name

    @property
    def weights_path(self) -> Path:
        """Path of the best network."""
        return self.folder / self.program.weights_file

    def resolve_config(self) -> Config:
        """Return the whole config.

        Raises:
            InputError: If an override is bad.
        """
        return load_config(self.program.config, self._file, self._typed())

    def clock(self) -> RunClock | None:
        """Return the progress of the run; None if there is none with this config that can be resumed."""
        written = self.folder / "config.yaml"
        newest = load_newest(self.folder / "checkpoints")
        if newest is None or not written.is_file() or not self._is_ours(written):
            return None
        return RunClock(**newest[0]["clock"])

    def _is_ours(self, written: Path) -> bool:
        """Return whether the config of a run is this one's; that of an older version may not even load."""
        try:
            return load_config(self.program.config, written) == self.resolve_config()
        except InputError:
            return False

    def is_done(self) -> bool:
        """Return whether the run is complete."""
        clock = self.clock()
        return clock is not None and clock.progress(self.resolve_config()) >= 1.0 and self.weights_path.is_file()

    def command(self) -> list[str]:
        """Return the command line that starts or resumes the run."""
        resume = ["--resume"] if self.clock() else []
        return [sys.executable, "-m", self.program.module, "--config", str(self._file), *self._typed(), *resume]

    @property
    def _file(self) -> Path:
        return CONFIG_DIR / f"{self.config}.yaml"

    def _typed(self) -> list[str]:
        """Return all overrides, with those of name and folder."""
        return [*self.overrides, f"name={self.name}", f"runs_dir={self.runs}"]


def run_name(row: str, seed: int) -> str:
    """Return the name of the run for a row of a study and a seed."""
    return f"{re.sub(r'[^a-z0-9]+', '_', row.lower())}_{seed}"


def training_cost(training: Training[Any]) -> dict[str, float]:
    """Return the cost of a training: samples, and minutes on one core."""
    clock = training.clock()
    return {"samples": float(clock.samples), "minutes": clock.seconds / 60.0} if clock else {}
