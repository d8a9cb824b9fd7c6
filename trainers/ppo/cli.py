"""Trains a mimicking policy: ``python -m trainers.ppo --config configs/mixed.yaml [key.sub=value ...] [--resume]``."""

import time
from pathlib import Path

from configs.errors import InputError
from configs.load import save_config
from trainers.algorithms.policy_file import load_initial_policy
from trainers.algorithms.ppo_config import PpoConfig
from trainers.data.training_motions import prepare_motions
from trainers.ppo.log import PpoLog
from trainers.ppo.run import PpoRun
from trainers.ppo.workers import build_workers, choose_backend
from trainers.runs.checkpoint import load_newest
from trainers.runs.progress import StopSignal
from trainers.runs.run_folder import make_folder, move_aside
from trainers.runs.run_log import commit_of_code, make_console
from trainers.runs.training_cli import run_training


def train(config: PpoConfig, resume: bool) -> Path:
    """Run a training to its end, or until it is asked to stop; return the run's folder."""
    folder = Path(config.runs_dir) / config.name
    log = PpoLog(folder, make_console(), config)
    if resume and load_newest(folder / "checkpoints") is None:
        raise InputError(f"there is no checkpoint to resume in {folder}/checkpoints; start without --resume")
    backend, initial = choose_backend(config), None if resume else load_initial_policy(config)
    make_folder(Path(config.runs_dir))  # errors come before minutes are spent
    motions = prepare_motions(config.data, Path(config.runs_dir) / "cache", log.info)
    if not resume:
        move_aside(folder, log.info)
    make_folder(folder)
    for notice in backend.notices:
        log.info(notice)
    with build_workers(config, motions.training, motions.weights, log.info) as (learner, pool):
        run = PpoRun(config, motions, folder, log, learner, pool, backend.simulator)
        if resume:
            run.resume()
        if initial:
            run.start_from_policy(*initial)
        save_config(config, folder / "config.yaml")
        log.begin(run.clock.samples)
        log.info(f"{len(motions.training.clips)} training clips; held out: {motions.held_out}; code {commit_of_code()}")
        stop = StopSignal(log.info)  # after Ray, which listens to the same signals
        if not resume:
            run.score_zero_residual()
        while not run.is_finished and not stop.is_requested:
            begin = time.monotonic()
            run.iterate()
            stop.record_iteration(time.monotonic() - begin)
        if not run.is_finished:
            run.save()
        run.checkpoints.raise_if_last_failed()
        log.info(f"done: {folder}/best/policy.safetensors" if run.is_finished else f"stopped and saved; go on with --resume: {folder}")
        log.close()
    return folder


def main(arguments: list[str] | None = None, prog: str = "python -m trainers.ppo") -> int:
    """Run the command line; return the exit code."""
    description = "Train a policy that mimics motion under physics."
    return run_training(prog, description, "configs/mixed.yaml", lambda _: PpoConfig, train, arguments)
