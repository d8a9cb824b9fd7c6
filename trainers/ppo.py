"""Trains a mimicking policy: ``python -m trainers.ppo --config configs/mixed.yaml [key.sub=value ...] [--resume]``."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from configs.errors import InputError
from configs.load import save_config
from trainers.checkpoint import load_newest
from trainers.command_line import run_training
from trainers.motions import PreparedMotions, prepare_motions
from trainers.ppo_config import PpoConfig
from trainers.ppo_learner import PpoLearner
from trainers.ppo_log import PpoLog
from trainers.ppo_run import PpoRun
from trainers.progress import Stop
from trainers.ray_cluster import RayCluster
from trainers.ray_pool import RayPool
from trainers.remote_learner import RemoteLearner
from trainers.rollout_pool import LocalPool
from trainers.run_folder import make_folder, move_aside
from trainers.run_log import commit_of_code, make_console


def train(config: PpoConfig, resume: bool) -> Path:
    """Run a training to its end, or until it is asked to stop; return the run's folder."""
    folder = Path(config.runs_dir) / config.name
    log = PpoLog(folder, make_console(), config)
    if resume and load_newest(folder / "checkpoints") is None:
        raise InputError(f"there is no checkpoint to resume in {folder}/checkpoints; start without --resume")
    make_folder(Path(config.runs_dir))  # before minutes are spent
    motions = prepare_motions(config.data, Path(config.runs_dir) / "cache", log.say)
    if not resume:
        move_aside(folder, log.say)
    make_folder(folder)
    with _run(config, motions, folder, log) as run:
        if resume:
            run.resume()
        save_config(config, folder / "config.yaml")
        log.begin(run.clock.samples)
        log.say(f"{len(motions.training.clips)} training clips; held out: {motions.held_out}; code {commit_of_code()}")
        stop = Stop(log.say)  # after Ray, which listens to the same signals
        if not resume:
            run.score_zero_residual()
        while not run.over and not stop.asked:
            begin = time.monotonic()
            run.iterate()
            stop.took(time.monotonic() - begin)
        if not run.over:
            run.save()
        run.checkpoints.check()
        log.say(f"done: {folder}/best/policy.safetensors" if run.over else f"stopped and saved; go on with --resume: {folder}")
        log.close()
    return folder


@contextmanager
def _run(config: PpoConfig, motions: PreparedMotions, folder: Path, log: PpoLog) -> Iterator[PpoRun]:
    """Give a run its learner and its collectors, in this process or as Ray's actors."""
    if config.collect.actors == 0:
        pool = LocalPool(config, motions.training, motions.weights)
        yield PpoRun(config, motions, folder, log, PpoLearner(config, motions.training), pool)
        return
    with RayCluster(config, motions.training, motions.weights) as cluster:
        remote = bool(config.ray.address)
        learner = RemoteLearner(config, cluster) if remote else PpoLearner(config, motions.training)  # first: it needs its cores
        yield PpoRun(config, motions, folder, log, learner, RayPool(config, cluster, log.say, fetch=not remote))


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    description = "Train a policy that mimics motion under physics."
    return run_training("trainers.ppo", description, "configs/mixed.yaml", lambda _: PpoConfig, train, arguments)


if __name__ == "__main__":
    sys.exit(main())
