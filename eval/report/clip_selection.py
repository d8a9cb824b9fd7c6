"""Clips of a report: finds, reads and selects them, and marks those that the training saw."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from configs.errors import InputError
from datasets.library.sources import (
    ROUGH_GROUND_KINDS,
    SYNTHETIC_SOURCE,
    SourceMotion,
    credit,
    find_motion_files,
    load_source_motions,
    notices_line,
    read_index,
    unique_names,
)
from datasets.motion.clip import FPS, BodyMotion
from datasets.performer.reading_options import read_mapping
from trainers.data.motion_config import RECONSTRUCTED, DataConfig
from trainers.data.root_source import IMU_SYSTEMS, RootSource
from trainers.data.training_motions import simulate_suits
from trainers.evaluation.evaluation_protocol import MIN_CLIP_FRAMES

SYNTHETIC_SEED_OFFSET = 1000  # added to a run's seed, so that synthetic performers are others than those it trained on


@dataclass(frozen=True)
class EvaluationClips:
    """Clips to evaluate.

    Attributes:
        source: Origin of the clips, in words.
        recorded: Clips as recorded, at 60 fps, with unique names.
        suited: Those that are no IMU recordings, through a simulated IMU suit.
        truths: Clean clip behind each suited clip.
        left_out: Reason why a clip is not evaluated, by its name.
        root_models: Model that gave the root, by name of a recorded clip whose root is not the file's.
        seen_in: "training" or "model selection", by name of a recorded clip that it saw, or whose performer it saw.
    """

    source: str
    recorded: list[BodyMotion]
    suited: list[BodyMotion]
    truths: list[BodyMotion]
    left_out: dict[str, str]
    root_models: dict[str, str]
    seen_in: dict[str, str]


def choose_clips(config: DataConfig, card: dict[str, Any], motions: list[str] | None, log: Callable[[str], None]) -> EvaluationClips:
    """Return the clips to evaluate a policy on.

    Args:
        config: Motion config of the run.
        card: Card of its policy: ``clips`` and ``performers`` trained on, and ``held_out``, the performer of model selection.
        motions: Motion sources given by the user. By default, performers that a run on synthetic motion never saw, or else the clips
            of the performer that the run held out.
        log: Called with messages of progress.

    Raises:
        InputError: If a source is bad, or nothing in it can be evaluated.
    """
    source, found = _find(config, card, motions, log)
    left_out = {one.clip.name: reason for one in found if (reason := _reason_unfit(one.clip))}
    fit = [one for one in found if one.clip.name not in left_out]
    if not fit:
        raise InputError(f"{source}: none of {len(found)} clips is on flat ground and at least {MIN_CLIP_FRAMES / FPS:g} s long")
    roots = RootSource(config.root_source == RECONSTRUCTED, log)
    recorded, by_model = roots.apply_to_recordings(fit)
    suitable = [clip for clip in recorded if clip.system not in IMU_SYSTEMS]
    log(f"putting {len(suitable)} clips through simulated suits")
    suited, truths = simulate_suits(suitable, DataConfig(root_source=config.root_source, restore=config.restore))
    seen = {clip.name: by for clip in recorded if (by := _seen_by(clip, card))}
    return EvaluationClips(source, recorded, suited, truths, left_out, by_model, seen)


def _find(
    config: DataConfig, card: dict[str, Any], motions: list[str] | None, log: Callable[[str], None]
) -> tuple[str, list[SourceMotion]]:
    """Return the source of the clips in words, and the clips."""
    seed = config.seed + SYNTHETIC_SEED_OFFSET
    if motions is None and config.motions == SYNTHETIC_SOURCE:
        return f"synthetic motion of seed {seed}", load_source_motions(SYNTHETIC_SOURCE, seed=seed)
    if motions is None:
        return f"{card['held_out']}, held out of {config.motions}", _read(_files_of(config, card["held_out"]), config, log)
    files: dict[Path, Path] = {}  # by their true path, so that no file is read twice
    for source in motions:
        files |= {path.resolve(): path for path in find_motion_files(source)} if source != SYNTHETIC_SOURCE else {}
    clips = _read(list(files.values()), config, log)
    if SYNTHETIC_SOURCE in motions:
        clips += load_source_motions(SYNTHETIC_SOURCE, seed=seed)
    return ", ".join(motions), clips


def _files_of(config: DataConfig, performer: str) -> list[Path]:
    """Return the files of a performer in the run's motion source."""
    if performer == "none":
        raise InputError("the run held no performer out; name the clips to evaluate on with --motions PATH ...")
    paths = find_motion_files(config.motions)
    index = read_index(paths[0])
    files = [path for path in paths if credit(path, index).performer == performer]
    if not files:
        raise InputError(f"{config.motions} has no clip of {performer}, whom the run held out; name other clips with --motions PATH ...")
    return files


def _read(files: list[Path], config: DataConfig, log: Callable[[str], None]) -> list[SourceMotion]:
    """Return the clips of files, with unique names; of several files broken ones are left out, with a line."""
    reading = read_mapping(config.mapping) if config.mapping else None
    clips = []
    for number, (file, name) in enumerate(zip(files, unique_names(files), strict=True), start=1):
        log(f"reading {number}/{len(files)} {file}")
        try:
            (one,) = load_source_motions(file, reading, say=lambda _: None)  # what was guessed is told of each folder at once
        except InputError as error:
            if len(files) == 1:
                raise
            log(f"{error}; left out")
            continue
        clips.append((file, replace(one, clip=replace(one.clip, name=name))))
    if not clips and files:
        raise InputError(f"none of {len(files)} motion files can be read, see above")
    for folder in dict.fromkeys(file.parent for file in files):
        if line := notices_line([(file, one) for file, one in clips if file.parent == folder], folder):
            log(line)
    return [one for _, one in clips]


def _reason_unfit(clip: BodyMotion) -> str:
    """Return why a clip is not evaluated, "" if it is."""
    if clip.kind in ROUGH_GROUND_KINDS:
        return f"{clip.kind}: the simulated ground is flat"
    return f"lasts {clip.seconds:.2f} s, under {MIN_CLIP_FRAMES / FPS:g} s" if len(clip) < MIN_CLIP_FRAMES else ""


def _seen_by(clip: BodyMotion, card: dict[str, Any]) -> str:
    """Return which part of the run saw a clip or its performer, "" if none did."""
    trained = {name.partition("#")[0] for name in card["clips"]}  # pieces of a clip bear its name, then "#" and a number
    if clip.name in trained or clip.performer in card["performers"]:
        return "training"
    return "model selection" if clip.performer == card["held_out"] else ""
