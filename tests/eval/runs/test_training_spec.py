"""Trainings of a study: the command line, no repetition, stopping together, and refused input."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from configs.errors import InputError
from eval.runs import training_pool
from eval.runs.training_pool import train_all
from eval.runs.training_spec import ROOT_PROGRAM, Training
from tests.eval.study.root.root_study_parts import leave
from trainers.runs.run_log import make_console
from trainers.supervised.root_config import RootConfig

RootTraining = Training[RootConfig]


@pytest.fixture
def training(tmp_path: Path) -> RootTraining:
    """Return a training of 1000 windows."""
    return Training(ROOT_PROGRAM, "planar", ("samples=1000", "data.kinds=[run,walk]"), "one", tmp_path / "runs")


def runs(monkeypatch: pytest.MonkeyPatch, program: Callable[[RootTraining], str]) -> None:
    """Let trainings run a program of Python in place of ``trainers.supervised``."""
    monkeypatch.setattr(Training, "command", lambda training: [sys.executable, "-c", program(training)])


def test_a_training_is_started_as_a_user_would_and_goes_on_where_it_was(training: RootTraining) -> None:
    command = training.command()
    assert command[1:4] == ["-m", "trainers.supervised", "--config"]
    assert Path(command[4]).name == "planar.yaml"
    assert command[5:] == ["samples=1000", "data.kinds=[run,walk]", "name=one", f"runs_dir={training.runs}"]
    leave(training, 500)
    assert training.command()[-1] == "--resume"
    assert not training.is_done()
    leave(training, 1000)
    assert training.is_done()
    assert not replace(training, overrides=("samples=1000",)).is_done()  # another config: not this training


def test_done_trainings_are_not_repeated(training: RootTraining, monkeypatch: pytest.MonkeyPatch) -> None:
    runs(monkeypatch, lambda _: "raise SystemExit(3)")
    leave(training, 1000)
    train_all([training], make_console())


def test_what_a_training_refuses_is_passed_on(training: RootTraining, monkeypatch: pytest.MonkeyPatch) -> None:
    runs(monkeypatch, lambda _: "import sys; print('preparing'); print('error: no such motion', file=sys.stderr); sys.exit(2)")
    with pytest.raises(InputError, match=r"^training one: no such motion$"):
        train_all([training], make_console())


def test_a_training_that_fails_stops_the_others_which_save_themselves(
    training: RootTraining, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(training_pool, "available_cores", lambda: 2)
    waits = (
        "import pathlib, signal, sys, time\n"
        f"def save(*_): pathlib.Path({str(tmp_path / 'saved')!r}).touch(); sys.exit(0)\n"
        "signal.signal(signal.SIGTERM, save)\n"
        f"pathlib.Path({str(tmp_path / 'ready')!r}).touch()\n"
        "time.sleep(60)"
    )
    fails = (
        "import pathlib, sys, time\n"
        f"while not pathlib.Path({str(tmp_path / 'ready')!r}).exists(): time.sleep(0.05)\n"
        "print(' 4.0%'); print('broken'); sys.exit(1)"
    )
    runs(monkeypatch, lambda one: fails if one.name == "one" else waits)
    with pytest.raises(RuntimeError, match=r"training one ended with exit code 1, see .*one\.log: broken"):
        train_all([training, replace(training, name="two")], make_console())
    assert (tmp_path / "saved").exists()
