"""Restoring study: poses of simulated suits before and after the restoring network, and what each ingredient of its training is worth."""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import torch
from rich.console import Console
from rich.progress import track

from agents.restore.model import RestoreModel
from agents.weights.pretrained import PRETRAINED_POLICY, load_pretrained_restore
from configs.process_pool import available_cores, map_on_cores
from eval.clean.edits import RESTORE
from eval.clean.pipeline import CleaningPipeline
from eval.evaluation_recordings import IMU_SUIT_CLIPS, SENSOR_WALK_FOLDER, TRAIN_FOLDER, check_recordings
from eval.runs.training_pool import train_all
from eval.runs.training_spec import RESTORE_PROGRAM, Training, run_name, training_cost
from eval.study.clean.case_results import case_result, pipeline_key
from eval.study.clean.cases import AFTER, BEFORE, SUITS, TRUTH, Values, all_cases
from eval.study.framework.page import Row, Study, study_row
from eval.study.framework.trainings import schedule_training
from eval.study.restore.findings import restore_findings
from eval.study.restore.page import GROUPS, NOTES, restore_plots
from eval.study.restore.rows import CLEANED, NOT_RESTORED, cleaning_row, ingredient_row, part_row, severity_row, walk_row
from eval.study.restore.scores import Scores, score_clean_clip, score_pair, score_training
from eval.study.restore.suit_pairs import FOLDERS, NUM_RECORDINGS, SuitPair, load_test_clips, simulate_pairs
from eval.study.restore.variants import INGREDIENTS, Ingredient
from eval.study.restore.walk import walk_rows
from trainers.runs.run_log import make_console, progress_bar
from trainers.supervised.restore_config import RestoreConfig
from trainers.supervised.restore_data import prepare_restore_data

SEVERITIES = (0.0, 0.5, 1.0, 1.5, 2.0)
NUM_SEEDS = 3
TRAINING_WINDOWS = 10_000  # of each training that leaves an ingredient out: two minutes of a core
NUM_EVALUATIONS = 2  # of each on its held-out performer
PREPARED = ("data.suit_takes=4", "data.synthetic_sets=2")  # prepared in minutes


def restore_study(data: Path, out: Path) -> Study:
    """Return the study; trainings and cleaned clips stay in ``out`` and are not repeated.

    Args:
        data: Folder of real motion.
        out: Folder of the study.

    Raises:
        InputError: If a recording is not there.
    """
    check_recordings(data, (TRAIN_FOLDER, *FOLDERS.values(), SENSOR_WALK_FOLDER, IMU_SUIT_CLIPS[-1]))
    console, model = make_console(), load_pretrained_restore()
    trainings = {one: [_training(one, seed, data, out) for seed in range(NUM_SEEDS)] for one in INGREDIENTS}
    _train([runs[seed] for seed in range(NUM_SEEDS) for runs in trainings.values()], console)  # a seed of each before the next
    torch.set_num_threads(available_cores())
    clips = load_test_clips(data)
    pairs = simulate_pairs(clips, NUM_RECORDINGS)
    clean = map_on_cores(partial(score_clean_clip, model), [clip for _, clip in clips], progress_bar("clean clips"))
    rows = _part_rows(pairs, _score_all(model, pairs), [(source, clip.kind) for source, clip in clips], clean)
    rows += [_severity_row(model, clips, severity) for severity in SEVERITIES]
    rows += [walk_row(name, values) for name, values in walk_rows(model, data).items()]
    rows += _cleaning_rows(data, out, console)
    rows += [
        _ingredient_row(one, runs, pairs) for one, runs in track(trainings.items(), "testing trainings", console=console, transient=True)
    ]
    return Study({"study": "restore", "rows": rows, "findings": restore_findings(rows)}, GROUPS, restore_plots(rows), NOTES)


def _training(one: Ingredient, seed: int, data: Path, out: Path) -> Training[RestoreConfig]:
    """Return one run of a training."""
    overrides = (f"data.motions={(data / TRAIN_FOLDER).resolve()}", *PREPARED, *one.overrides)
    run = Training(RESTORE_PROGRAM, "restore", overrides, run_name(one.name, seed), out.resolve() / "runs")
    return schedule_training(run, seed, TRAINING_WINDOWS, lambda config: config.learner.batch, NUM_EVALUATIONS)


def _train(runs: Sequence[Training[RestoreConfig]], console: Console) -> None:
    """Run the trainings that are not done; the motion of each is prepared before."""
    waiting = [run for run in runs if not run.is_done()]
    for settings in {run.resolve_config().data for run in waiting}:
        prepare_restore_data(settings, runs[0].runs / "cache", console.print)
    train_all(runs, console)


def _score_all(model: RestoreModel, pairs: Sequence[SuitPair]) -> list[Scores]:
    return map_on_cores(partial(score_pair, model), pairs, progress_bar("restoring"))


def _part_rows(pairs: Sequence[SuitPair], scores: Sequence[Scores], clips: Sequence[tuple[str, str]], clean: Sequence[Scores]) -> list[Row]:
    """Return rows of folders, and of kinds and performers within them."""
    rows = []
    for source, field, part in _parts(pairs):
        own = [
            found for pair, found in zip(pairs, scores, strict=True) if pair.source == source and part in ("", getattr(pair.truth, field))
        ]
        rows.append(part_row(source, field, part, own))
        if field == "kind":
            left = [found for (name, kind), found in zip(clips, clean, strict=True) if name == source and part in ("", kind)]
            rows[-1]["ours"] |= study_row("", left)["ours"]
    return rows


def _parts(pairs: Sequence[SuitPair]) -> Iterator[tuple[str, str, str]]:
    """Yield folder, field of a clip and its value for each row; the whole folder first, as the kind ""."""
    for source in dict.fromkeys(pair.source for pair in pairs):
        yield source, "kind", ""
        for field in ("kind", "performer"):
            yield from ((source, field, part) for part in sorted({getattr(pair.truth, field) for pair in pairs if pair.source == source}))


def _severity_row(model: RestoreModel, clips: Sequence[tuple[str, object]], severity: float) -> Row:
    return severity_row(severity, _score_all(model, simulate_pairs(clips, 1, severity)))  # type: ignore[arg-type]


def _ingredient_row(one: Ingredient, runs: Sequence[Training[RestoreConfig]], pairs: Sequence[SuitPair]) -> Row:
    """Return the row of a training: of each seed the mean over the first recording of each clip, by folder."""
    seeds = []
    for run in runs:
        score = partial(score_training, RestoreModel.load(run.weights_path)[0])
        found: dict[str, list[float]] = {}
        for scores in map_on_cores(score, pairs[::NUM_RECORDINGS]):
            for name, value in scores.items():
                found.setdefault(name, []).append(value)
        seeds.append({name: sum(values) / len(values) for name, values in found.items()} | training_cost(run))
    return ingredient_row(one.name, seeds)


def _cleaning_rows(data: Path, out: Path, console: Console) -> list[Row]:
    """Return rows of suits' clips before and after the whole of the cleaning, with and without the restoring network."""
    whole = CleaningPipeline.load(available_cores())
    cleaners = {
        CLEANED: (whole, pipeline_key(PRETRAINED_POLICY)),
        NOT_RESTORED: (whole.without([RESTORE]), pipeline_key(PRETRAINED_POLICY, False)),
    }
    sides: dict[tuple[str, str], list[Values]] = {}
    for case in track([case for case in all_cases(data) if case.group == SUITS], "cleaning", console=console, transient=True):
        for name, (cleaner, key) in cleaners.items():
            result = case_result(case, name, cleaner, key, out / "clips")
            sides.setdefault((case.source, name), []).append(result.sides[AFTER])
            if name == CLEANED:
                for side in (BEFORE, TRUTH):
                    sides.setdefault((case.source, side), []).append(result.sides[side])
    return [cleaning_row(source, side, values) for (source, side), values in sorted(sides.items())]
