"""Trains a mimicking policy: ``python -m trainers.ppo --config configs/mixed.yaml [key.sub=value ...] [--resume]``."""

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from itertools import count
from pathlib import Path

from configs.errors import InputError
from configs.load import load_config, save_config
from trainers.checkpoint import load_newest, save_checkpoint
from trainers.model_selection import ModelSelection
from trainers.motions import prepare_motions
from trainers.ppo_config import PpoConfig
from trainers.ppo_learner import PpoLearner
from trainers.progress import Clock, Stop
from trainers.rollout_pool import RolloutPool
from trainers.run_log import RunLog, commit_of_code, make_console


def train(config: PpoConfig, resume: bool) -> Path:
    """Run a training to its end, or until it is asked to stop; return the run's folder."""
    stop = Stop()
    console = make_console()
    folder = Path(config.runs_dir) / config.name
    if resume and load_newest(folder / "checkpoints") is None:
        raise InputError(f"there is no checkpoint to resume in {folder}/checkpoints; start without --resume")
    motions = prepare_motions(config.data, Path(config.runs_dir) / "cache", console.print)
    if not resume:
        move_aside(folder, console.print)
    folder.mkdir(parents=True, exist_ok=True)
    save_config(config, folder / "config.yaml")
    learner = PpoLearner(config)
    selection = ModelSelection(config, motions, folder)
    with RunLog(folder, console, config) as log, RolloutPool(config, motions.training, motions.weights) as pool:
        clock = _resume(folder, learner, pool, log) if resume else Clock()
        log.say(f"{len(motions.training.clips)} training clips; held out: {motions.held_out}; code {commit_of_code()}")
        log.score("zero residual", 0, selection.zero_residual())
        while clock.progress(config) < 1.0 and not stop.asked:
            begin, progress = time.monotonic(), clock.progress(config)
            rollouts = pool.collect(learner.weights(), learner.sigma(progress))
            collected = time.monotonic()
            diagnostics = learner.update(rollouts, progress)
            spent = time.monotonic() - begin
            samples = sum(rollout.samples for rollout in rollouts)
            clock = replace(clock, iteration=clock.iteration + 1, samples=clock.samples + samples, seconds=clock.seconds + spent)
            log.iteration(clock, rollouts, diagnostics, {"total": samples / spent, "collect": samples / (collected - begin)})
            finished = clock.progress(config) >= 1.0 or stop.asked
            if finished or clock.iteration % config.evaluate_every == 0:
                clock = _evaluate(selection, learner, clock, log)
            if finished or clock.iteration % config.checkpoint_every == 0:
                _save(folder, learner, pool, clock)
        log.say(f"stopped and saved; go on with --resume: {folder}" if stop.asked else f"done: {folder}/best/policy.safetensors")
    return folder


def move_aside(folder: Path, say: Callable[[str], None]) -> None:
    """Rename the folder of an earlier run of the same name, if there is one: nothing is written over."""
    if folder.exists():
        aside = next(path for n in count(1) if not (path := folder.with_name(f"{folder.name}.{n}")).exists())
        folder.rename(aside)
        say(f"an earlier run was moved to {aside}")


def _evaluate(selection: ModelSelection, learner: PpoLearner, clock: Clock, log: RunLog) -> Clock:
    """Score the policy on the held-out clips and keep it if it is the best so far."""
    begin = time.monotonic()
    score = selection.score(learner.policy.act)
    better = score["episode_length_ratio"] > clock.best
    log.score("held out" + (", best" if better else ""), clock.samples, score)
    clock = replace(clock, best=max(score["episode_length_ratio"], clock.best), seconds=clock.seconds + time.monotonic() - begin)
    if better:
        selection.keep(learner.policy, score, clock)
    return clock


def _resume(folder: Path, learner: PpoLearner, pool: RolloutPool, log: RunLog) -> Clock:
    newest = load_newest(folder / "checkpoints")
    assert newest is not None  # train looked
    tree, path = newest
    learner.set_state(tree["learner"])
    pool.set_state(tree["actors"])
    clock = Clock(**tree["clock"])
    log.say(f"resumed from {path}, {clock.samples / 1e6:.2f} M steps")
    return clock


def _save(folder: Path, learner: PpoLearner, pool: RolloutPool, clock: Clock) -> None:
    tree = {"learner": learner.get_state(), "actors": pool.get_state(), "clock": asdict(clock)}
    save_checkpoint(folder / "checkpoints", clock.iteration, tree)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m trainers.ppo", description="Train a policy that mimics motion under physics.")
    parser.add_argument("--config", type=Path, required=True, help="YAML file, such as configs/mixed.yaml")
    parser.add_argument("--resume", action="store_true", help="go on from the newest checkpoint of the run")
    parser.add_argument("overrides", nargs="*", metavar="key.sub=value", help="change the config, such as learner.epochs=4")
    options = parser.parse_intermixed_args(arguments)
    try:
        train(load_config(PpoConfig, options.config, options.overrides), options.resume)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
