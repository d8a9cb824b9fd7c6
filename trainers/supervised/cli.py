"""Supervised trainings: ``python -m trainers.supervised --config configs/root3d.yaml [key.sub=value ...] [--resume]``."""

import json
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import torch

from configs.errors import InputError
from configs.load import former_key, save_config
from trainers.runs.checkpoint import Checkpoints, load_newest
from trainers.runs.progress import RunClock, StopSignal
from trainers.runs.run_folder import make_folder, move_aside
from trainers.runs.run_log import RunLog, commit_of_code, make_console
from trainers.runs.training_cli import run_training
from trainers.supervised.jobs import JOBS, Config, Data, Learner, config_class
from trainers.supervised.tempo_takes import clip_name

LOG_INTERVAL_BATCHES = 100


def train(config: Config, resume: bool) -> Path:
    """Run a training to its end, or until it is asked to stop; return the run's folder."""
    job, folder = JOBS[config.learns], Path(config.runs_dir) / config.name
    log = RunLog(folder, make_console())
    if resume and load_newest(folder / "checkpoints") is None:
        raise InputError(f"there is no checkpoint to resume in {folder}/checkpoints; start without --resume")
    make_folder(Path(config.runs_dir))  # before minutes are spent
    data = job.prepare(config.data, Path(config.runs_dir) / "cache", log.info)
    torch.set_num_threads(config.learner.threads)
    learner = job.learner(config, data)
    if not resume:
        move_aside(folder, log.info)
    make_folder(folder)
    checkpoints = Checkpoints(folder / "checkpoints", log.info)
    clock = _resume(checkpoints, learner, config, data) if resume else RunClock()
    save_config(config, folder / "config.yaml")
    log.begin(clock.samples)
    log.info(f"{config.name}, {sum(p.numel() for p in learner.model.parameters()):,} parameters; code {commit_of_code()}")
    stop = StopSignal(log.info)
    losses: list[torch.Tensor] = []

    def tree() -> dict[str, Any]:
        return {"learner": learner.get_state(), "clock": asdict(clock), "made_of": _training_identity(config, data)}

    while clock.progress(config) < 1.0 and not stop.is_requested:
        begin = time.monotonic()
        losses.append(learner.update(clock.progress(config)))
        spent = time.monotonic() - begin
        clock = replace(clock, iteration=clock.iteration + 1, samples=clock.samples + learner.samples, seconds=clock.seconds + spent)
        if clock.iteration % LOG_INTERVAL_BATCHES == 0:
            _log(log, clock, config, losses)
        if clock.progress(config) >= 1.0 or clock.iteration % config.evaluate_every == 0:
            clock = _evaluate(learner, data, config, clock, log, folder)
        if clock.progress(config) >= 1.0 or clock.iteration % config.checkpoint_every == 0:
            checkpoints.save(clock.iteration, tree())
        stop.record_iteration(time.monotonic() - begin)
    finished = clock.progress(config) >= 1.0
    if not finished:
        checkpoints.save(clock.iteration, tree())
    checkpoints.raise_if_last_failed()
    log.info(f"done: {folder}/best/model.safetensors" if finished else f"stopped and saved; go on with --resume: {folder}")
    log.close()
    return folder


def _log(log: RunLog, clock: RunClock, config: Config, losses: list[torch.Tensor]) -> None:
    """Write the mean loss since the last call, and a line of progress."""
    loss = float(torch.stack(losses).mean())
    losses.clear()
    sample = JOBS[config.learns].sample_unit
    speed = clock.samples / max(clock.seconds, 1e-9)
    log.write(clock.samples, {"training/loss": loss, f"speed/{sample}_per_s": speed})
    done = clock.progress(config)
    log.info_throttled(
        f"{done:5.1%}  {clock.samples / 1e6:7.2f} M {sample}  {speed:6.0f} {sample}/s  {clock.time_left(config)}   loss {loss:.4f}"
    )


def _evaluate(learner: Learner, data: Data, config: Config, clock: RunClock, log: RunLog, folder: Path) -> RunClock:
    """Score the model on the held-out performer and keep it if it is the best so far."""
    begin = time.monotonic()
    score = learner.score()
    selected = -score[JOBS[config.learns].selected_by]
    better = selected > clock.best
    log.write(clock.samples, {f"held_out/{name}": value for name, value in score.items()})
    text = "  ".join(f"{name} {value:.4f}" for name, value in score.items())
    log.info(f"held out{', best' if better else ''} at {clock.samples / 1e6:.2f} M {JOBS[config.learns].sample_unit}:   {text}")
    clock = replace(clock, seconds=clock.seconds + time.monotonic() - begin)
    if not better:
        return clock
    try:
        (folder / "best").mkdir(exist_ok=True)
        learner.model.save(folder / "best" / "model.safetensors", _card(data, config, clock, score))
    except OSError as error:
        log.info(f"the best model could not be written ({error}); the one before stays")
        return clock
    return replace(clock, best=selected)


def _card(data: Data, config: Config, clock: RunClock, score: dict[str, float]) -> dict[str, object]:
    clips = data.training.clips
    settings = asdict(config.data)
    for name in {"motions", "rough_motions"} & set(settings):
        settings[name] = "/".join(Path(settings[name]).parts[-2:])  # not where on this machine
    return {
        "model": asdict(config.model),
        "data": {**settings, "mapping": Path(config.data.mapping).name},
        "learner": asdict(config.learner),
        "clips": sorted({clip_name(clip.name) for clip in clips}),
        "performers": sorted({clip.performer for clip in clips}),
        "held_out": data.held_out,
        "held_out_metrics": score,
        JOBS[config.learns].sample_unit: clock.samples,
        "hours": clock.seconds / 3600.0,
        "code": commit_of_code(),
    }


def _training_identity(config: Config, data: Data) -> dict[str, object]:
    """Return the settings that a resumed run must have in common with its beginning."""
    settings = {f"model.{name}": value for name, value in asdict(config.model).items()}
    known_by_clips = ("motions", "mapping", "kinds", "test_performers")
    settings |= {f"data.{name}": value for name, value in asdict(config.data).items() if name not in known_by_clips}
    settings |= {f"learner.{name}": getattr(config.learner, name) for name in JOBS[config.learns].fixed_learner_settings}
    return json.loads(json.dumps({**settings, "data.motions": data.identity}))  # as it comes back from a checkpoint: no tuples


def _former_name(config: Config, name: str) -> str:
    """Return the name of a setting in checkpoints of earlier versions."""
    section, _, key = name.partition(".")
    return f"{section}.{former_key(type(getattr(config, section)), key)}"


def _resume(checkpoints: Checkpoints, learner: Learner, config: Config, data: Data) -> RunClock:
    """Set the learner to the state of the newest checkpoint; return its clock."""
    newest = checkpoints.newest()
    assert newest is not None  # train checked
    tree, path = newest
    then, now = tree["made_of"], _training_identity(config, data)
    if other := [name for name in now if then.get(name, then.get(_former_name(config, name))) != now[name]]:
        raise InputError(f"{path} was trained with another {', '.join(other)}; resume with the config and the clips of then")
    learner.set_state(tree["learner"])
    return RunClock(**tree["clock"])


def main(arguments: list[str] | None = None, prog: str = "python -m trainers.supervised") -> int:
    """Run the command line; return the exit code."""
    description = "Train a network that gives clips a root, or one that gives trackers a lower body."
    return run_training(prog, description, "configs/root3d.yaml", config_class, train, arguments)
