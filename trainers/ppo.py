"""Trains a mimicking policy: ``python -m trainers.ppo --config configs/mixed.yaml [key.sub=value ...] [--resume]``."""

import sys
import time
from dataclasses import asdict, replace
from pathlib import Path

from configs.errors import InputError
from configs.load import save_config
from trainers.checkpoint import load_newest, save_checkpoint
from trainers.command_line import run_training
from trainers.model_selection import ModelSelection
from trainers.motions import PreparedMotions, prepare_motions
from trainers.ppo_config import PpoConfig
from trainers.ppo_learner import PpoLearner
from trainers.ppo_log import PpoLog
from trainers.progress import Clock, Stop
from trainers.rollout_pool import RolloutPool
from trainers.run_folder import make_folder, move_aside
from trainers.run_log import commit_of_code, make_console


def train(config: PpoConfig, resume: bool) -> Path:
    """Run a training to its end, or until it is asked to stop; return the run's folder."""
    console = make_console()
    folder = Path(config.runs_dir) / config.name
    if resume and load_newest(folder / "checkpoints") is None:
        raise InputError(f"there is no checkpoint to resume in {folder}/checkpoints; start without --resume")
    make_folder(Path(config.runs_dir))  # before minutes are spent
    motions = prepare_motions(config.data, Path(config.runs_dir) / "cache", console.print)
    if not resume:
        move_aside(folder, console.print)
    make_folder(folder)
    learner = PpoLearner(config, motions.training)
    selection = ModelSelection(config, motions, folder)
    with RolloutPool(config, motions.training, motions.weights) as pool:
        clock = _resume(folder, learner, pool, motions) if resume else Clock()
        save_config(config, folder / "config.yaml")
        log = PpoLog(folder, console, config, clock)
        log.say(f"{len(motions.training.clips)} training clips; held out: {motions.held_out}; code {commit_of_code()}")
        if not resume:
            log.score("zero residual", 0, selection.zero_residual())
        stop = Stop(log.say)  # after Ray, which listens to the same signals
        while clock.progress(config) < 1.0 and not stop.asked:
            begin, progress = time.monotonic(), clock.progress(config)
            rollouts = pool.collect(learner.weights(), learner.sigma(progress), config.collect.assist * max(1.0 - 2.0 * progress, 0.0))
            collected = time.monotonic()
            diagnostics = learner.update(rollouts, progress)
            spent = time.monotonic() - begin
            samples = sum(rollout.samples for rollout in rollouts)
            clock = replace(clock, iteration=clock.iteration + 1, samples=clock.samples + samples, seconds=clock.seconds + spent)
            log.iteration(clock, rollouts, diagnostics, {"total": samples / spent, "collect": samples / (collected - begin)})
            if clock.progress(config) >= 1.0 or clock.iteration % config.evaluate_every == 0:
                clock = _evaluate(selection, learner, clock, log)
            if stop.asked or clock.progress(config) >= 1.0 or clock.iteration % config.checkpoint_every == 0:
                _save(folder, learner, pool, motions, clock)
        finished = clock.progress(config) >= 1.0
        log.say(f"done: {folder}/best/policy.safetensors" if finished else f"stopped and saved; go on with --resume: {folder}")
        log.close()
    return folder


def _evaluate(selection: ModelSelection, learner: PpoLearner, clock: Clock, log: PpoLog) -> Clock:
    """Score the policy on the held-out clips and keep it if it is the best so far."""
    begin = time.monotonic()
    score = selection.score(learner.policy.act)
    better = score["episode_length_ratio"] > clock.best
    log.score("held out" + (", best" if better else ""), clock.samples, score)
    clock = replace(clock, best=max(score["episode_length_ratio"], clock.best), seconds=clock.seconds + time.monotonic() - begin)
    if better:
        selection.keep(learner.policy, score, clock)
    return clock


def _resume(folder: Path, learner: PpoLearner, pool: RolloutPool, motions: PreparedMotions) -> Clock:
    """Put learner and collectors into the state of the newest checkpoint; return its clock."""
    newest = load_newest(folder / "checkpoints")
    assert newest is not None  # train looked
    tree, path = newest
    if tree["motions"] != motions.identity or tree["learner"]["network"].keys() != learner.weights().keys():
        raise InputError(f"{path} was trained on other motion or with another network; resume with the config and the clips of then")
    learner.set_state(tree["learner"])
    pool.set_state(tree["actors"])
    return Clock(**tree["clock"])


def _save(folder: Path, learner: PpoLearner, pool: RolloutPool, motions: PreparedMotions, clock: Clock) -> None:
    tree = {"learner": learner.get_state(), "actors": pool.get_state(), "clock": asdict(clock), "motions": motions.identity}
    save_checkpoint(folder / "checkpoints", clock.iteration, tree)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    description = "Train a policy that mimics motion under physics."
    return run_training("trainers.ppo", description, "configs/mixed.yaml", lambda _: PpoConfig, train, arguments)


if __name__ == "__main__":
    sys.exit(main())
