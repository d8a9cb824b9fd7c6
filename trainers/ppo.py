"""Trains a mimicking policy: ``python -m trainers.ppo --config configs/mixed.yaml [key.sub=value ...] [--resume]``."""

import argparse
import signal
import sys
import time
from collections import deque
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from itertools import count
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from configs.errors import InputError
from configs.load import load_config, save_config
from envs.episode_metrics import TRACKING_METRICS
from trainers.checkpoint import load_newest, save_checkpoint
from trainers.motions import PreparedMotions, prepare_motions
from trainers.play import play, protocol, zero_residual
from trainers.ppo_config import PpoConfig
from trainers.ppo_learner import PpoLearner
from trainers.rollout import Rollout
from trainers.rollout_pool import RolloutPool
from trainers.run_log import RunLog, commit_of_code, make_console

EVALUATED_OFFSETS = 5  # during training each 5th of the protocol's 20 starts is played


@dataclass(frozen=True)
class Clock:
    """How far a run has come.

    Attributes:
        iteration: Rollouts and updates so far.
        samples: Control steps so far.
        seconds: Time spent training, interruptions left out.
        best: Best ``episode_length_ratio`` on the held-out performer so far.
    """

    iteration: int = 0
    samples: int = 0
    seconds: float = 0.0
    best: float = -1.0

    def progress(self, config: PpoConfig) -> float:
        """Return the share of the training that is done, by samples or by the clock, whichever is further."""
        by_clock = self.seconds / (60.0 * config.minutes) if config.minutes else 0.0
        return min(max(self.samples / config.samples, by_clock), 1.0)


class Stop:
    """Becomes true when the user or the system asks the run to end: the iteration is finished and saved first."""

    def __init__(self) -> None:
        """Listen to Ctrl-C and SIGTERM."""
        self.asked = False
        for name in (signal.SIGINT, signal.SIGTERM):
            signal.signal(name, self._ask)

    def _ask(self, number: int, frame: FrameType | None) -> None:
        if self.asked:  # asked twice: at once
            raise KeyboardInterrupt
        self.asked = True


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
    log = RunLog(folder, console)
    recent: deque[dict[str, np.ndarray]] = deque(maxlen=20)
    with RolloutPool(config, motions.training, motions.weights) as pool:
        clock = _resume(folder, learner, pool, log) if resume else Clock()
        _introduce(config, motions, log)
        while clock.progress(config) < 1.0 and not stop.asked:
            begin, progress = time.monotonic(), clock.progress(config)
            rollouts = pool.collect(learner.weights(), learner.sigma(progress))
            collected = time.monotonic()
            diagnostics = learner.update(rollouts, progress)
            samples = sum(rollout.samples for rollout in rollouts)
            spent = time.monotonic() - begin
            clock = replace(clock, iteration=clock.iteration + 1, samples=clock.samples + samples, seconds=clock.seconds + spent)
            recent.append({name: np.concat([r.episodes[name] for r in rollouts]) for name in TRACKING_METRICS})
            speeds = {"total": samples / spent, "collect": samples / (collected - begin)}
            _log_iteration(log, config, clock, rollouts, diagnostics, recent, speeds)
            finished = clock.progress(config) >= 1.0 or stop.asked
            if clock.iteration % config.evaluate_every == 0 or finished:
                clock = _evaluate(config, learner, motions, folder, clock, log)
            if clock.iteration % config.checkpoint_every == 0 or finished:
                _save(folder, learner, pool, clock)
    log.say(f"stopped and saved; go on with --resume: {folder}" if stop.asked else f"done: {folder}/best/policy.safetensors")
    log.close()
    return folder


def move_aside(folder: Path, say: Callable[[str], None]) -> None:
    """Rename the folder of an earlier run of the same name, if there is one: nothing is written over."""
    if folder.exists():
        aside = next(path for n in count(1) if not (path := folder.with_name(f"{folder.name}.{n}")).exists())
        folder.rename(aside)
        say(f"an earlier run was moved to {aside}")


def _resume(folder: Path, learner: PpoLearner, pool: RolloutPool, log: RunLog) -> Clock:
    newest = load_newest(folder / "checkpoints")
    assert newest is not None  # open_folder looked
    tree, path = newest
    learner.set_state(tree["learner"])
    pool.set_state(tree["actors"])
    clock = Clock(**tree["clock"])
    log.say(f"resumed from {path}, {clock.samples / 1e6:.2f} M steps")
    return clock


def _save(folder: Path, learner: PpoLearner, pool: RolloutPool, clock: Clock) -> None:
    tree = {"learner": learner.get_state(), "actors": pool.get_state(), "clock": asdict(clock)}
    save_checkpoint(folder / "checkpoints", clock.iteration, tree)


def _introduce(config: PpoConfig, motions: PreparedMotions, log: RunLog) -> None:
    clips, held = len(motions.training.clips), motions.held_out
    log.say(f"{clips} training clips; held out for model selection: {held}; code {commit_of_code()}")
    rollouts, _ = protocol(motions.holdout, EVALUATED_OFFSETS)
    if len(rollouts.clip):
        zero = play(zero_residual(config.task), motions.holdout, config.task, rollouts, config.collect.threads)
        log.say(f"zero residual on the held-out clips: episode_length_ratio {zero['episode_length_ratio'].mean():.3f}")


def _log_iteration(
    log: RunLog,
    config: PpoConfig,
    clock: Clock,
    rollouts: list[Rollout],
    diagnostics: dict[str, float],
    recent: deque[dict[str, np.ndarray]],
    speeds: dict[str, float],
) -> None:
    metrics = {}
    for name in TRACKING_METRICS:
        values = np.concat([one[name] for one in recent])
        if len(values):
            metrics[name] = float(values.mean())
    values = {f"training/{name}": value for name, value in metrics.items()}
    values |= {name: float(np.mean([r.reward_terms[name] for r in rollouts])) for name in rollouts[0].reward_terms}
    values["reward/total"] = float(np.mean([r.rewards.mean() for r in rollouts]))
    values |= {f"learner/{name}": value for name, value in diagnostics.items()}
    values |= {f"speed/{name}_steps_per_s": value for name, value in speeds.items()}
    values["physics/failures"] = float(sum(r.physics_failures for r in rollouts))
    log.numbers(clock.samples, values)
    done = clock.progress(config)
    left = clock.seconds * (1.0 / done - 1.0)
    log.progress(done, clock.samples, speeds["total"], left, {name: metrics[name] for name in list(metrics)[:4]})


def _evaluate(config: PpoConfig, learner: PpoLearner, motions: PreparedMotions, folder: Path, clock: Clock, log: RunLog) -> Clock:
    """Play the held-out performer's clips and keep the policy if it is the best so far."""
    begin = time.monotonic()
    rollouts, _ = protocol(motions.holdout, EVALUATED_OFFSETS)
    if not len(rollouts.clip):
        rollouts, _ = protocol(motions.training, EVALUATED_OFFSETS)
    found = play(learner.policy.act, motions.holdout, config.task, rollouts, config.collect.threads)
    means = {name: float(values.mean()) for name, values in found.items()}
    log.numbers(clock.samples, {f"holdout/{name}": value for name, value in means.items()})
    score = means["episode_length_ratio"]
    better = score > clock.best
    shown = "  ".join(f"{name} {value:.3f}" for name, value in means.items())
    log.say(f"held out at {clock.samples / 1e6:.2f} M:   {shown}{'   (best)' if better else ''}")
    if better:
        (folder / "best").mkdir(exist_ok=True)
        learner.policy.save(folder / "best" / "policy.safetensors", _card(config, motions, clock, means))
    return replace(clock, best=max(score, clock.best), seconds=clock.seconds + time.monotonic() - begin)


def _card(config: PpoConfig, motions: PreparedMotions, clock: Clock, metrics: dict[str, float]) -> dict[str, Any]:
    return {
        "task": asdict(config.task),
        "motions": config.data.motions,
        "clips": sorted({clip.name for clip in motions.training.clips}),
        "held_out": motions.held_out,
        "holdout_metrics": metrics,
        "samples": clock.samples,
        "hours": clock.seconds / 3600.0,
        "code": commit_of_code(),
    }


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
