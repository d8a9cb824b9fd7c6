"""LoBSTr's comparisons (section 4, Tables 1 to 3, figure 6) as one command: trainings, tests, rows beside the paper's values."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from rich.console import Console
from rich.progress import track

from agents.lobstr.model import LobstrModel
from agents.weights.pretrained import SHIPPED_LOBSTR
from eval.recordings import FOLDERS, TRAINED_ON, check_recordings
from eval.runs.training_curves import read_curves
from eval.runs.training_pool import train_all
from eval.runs.training_spec import LOWER_BODY, Training, effort, run_name
from eval.study.lobstr.evaluate import commoner_class, examine, mean_pose
from eval.study.lobstr.findings import find
from eval.study.lobstr.page import GROUPS, notes
from eval.study.lobstr.plots import plot_all
from eval.study.lobstr.scores import Predicted, Scores, score_clips
from eval.study.lobstr.test_sessions import TestClip, perform, unseen_clips
from eval.study.lobstr.user_rows import UserRows
from eval.study.lobstr.variants import COMMONER, MEAN_POSE, REPRESENTATIONS, SHIPPED, TRUTH, VARIANTS, Variant
from eval.study.protocol.page import Study, summarise_seeds
from trainers.runs.run_log import make_console
from trainers.supervised.lobstr_config import LobstrConfig
from trainers.supervised.lobstr_data import LobstrData, prepare_lobstr_data

CONFIG = "lobstr"
SEEDS = 3
SAMPLES = 120 * 64 * 46  # predicted frames of each training: a minute of a core for a GRU
EVALUATIONS = 10  # of each training on its held-out performer
COMMON = (
    "model.upright=false",  # as in the paper, like all below but what is said of batches
    "data.mirror=false", "data.synthetic=0", "data.takes=1",
    "learner.noise=0.01", "learner.turned=1.5", "learner.displaced=0",
    "learner.pose=1", "learner.kinematics=0.1", "learner.velocity=0.1", "learner.contact=1e-6",
    "learner.learning_rate=1e-3", "learner.final_learning_rate=2.2e-4",
    "learner.batch=64", "learner.predicted=46",  # where the paper has 256 windows of one prediction each: see the page's notes
    "minutes=0", "learner.threads=1",
)  # fmt: skip
LobstrRun = Training[LobstrConfig]
Row = dict[str, Any]


def lobstr_study(data: Path, out: Path) -> Study:
    """Return the study; its trainings stay in ``out`` and are not repeated.

    Args:
        data: Folder of real motion.
        out: Folder of the study.

    Raises:
        InputError: If a recording is not there.
    """
    check_recordings(data, (TRAINED_ON, *FOLDERS))
    console = make_console()
    runs = {variant.name: [_training(variant, seed, data, out) for seed in range(SEEDS)] for variant in VARIANTS}
    motion = _train([run for own in runs.values() for run in own], console)
    with console.status("reading test clips"):
        clips = unseen_clips(data)
    torch.set_num_threads(os.cpu_count() or 1)
    rows = _rows(runs, motion, clips, console)
    curves = {row: [read_curves(run.folder) for run in own] for row, own in runs.items()}
    table = {"study": "lobstr", "rows": rows, "findings": find(rows)}
    return Study(table, GROUPS, plot_all(rows, curves), notes(SAMPLES, motion, clips))


def _training(variant: Variant, seed: int, data: Path, out: Path) -> LobstrRun:
    """Return one run of a network; nothing but the run's own seed tells the seeds apart."""
    overrides = (*COMMON, *variant.overrides, f"data.motions={(data / TRAINED_ON).resolve()}", f"samples={SAMPLES}", f"seed={seed}")
    run = Training(LOWER_BODY, CONFIG, overrides, run_name(variant.name, seed), out.resolve() / "runs")
    learner = run.resolved().learner
    every = max(1, -(-SAMPLES // (learner.batch * learner.predicted) // EVALUATIONS))
    return replace(run, overrides=(*overrides, f"evaluate_every={every}", f"checkpoint_every={every}"))


def _train(runs: Sequence[LobstrRun], console: Console) -> LobstrData:
    """Run what is not done, and return the motion that all share, which is prepared once."""
    with console.status("preparing motion"):
        motion = prepare_lobstr_data(runs[0].resolved().data, runs[0].runs / "cache", console.print)
    train_all(runs, console)
    return motion


def _rows(runs: Mapping[str, Sequence[LobstrRun]], motion: LobstrData, clips: Sequence[TestClip], console: Console) -> list[Row]:
    """Return the rows of all networks and of what needs none, with perfect trackers, and then those of the virtual users."""
    rows: list[Row] = []
    users = UserRows(perform(clips))
    names = {row: how for how, row in REPRESENTATIONS.items()}
    for variant in track(VARIANTS, "testing networks", console=console, transient=True):
        seeds = []
        for run in runs[variant.name]:
            model = LobstrModel.load(run.network)[0]
            seeds.append(examine(model, clips) | effort(run))
            if variant.name in names:
                users.add(names[variant.name], model, seeds[-1])
        row = _row(variant.name, seeds, variant.published)
        rows.append(row | {"config": CONFIG, "overrides": list(runs[variant.name][0].overrides)})
    rows.append(_row(COMMONER, [commoner_class(motion, clips)]))
    rows.append(_row(MEAN_POSE, [score_clips(clips, mean_pose(motion, clips))]))
    rows.append(_row(TRUTH, [{"body_movement": score_clips(clips, [Predicted(clip.legs) for clip in clips])["body_movement"]}]))
    model, card = LobstrModel.load(SHIPPED_LOBSTR)
    shipped = examine(model, clips) | {"samples": float(card["frames"]), "minutes": 60.0 * card["hours"]}
    rows.append(_row(SHIPPED, [shipped]))
    users.add(SHIPPED, model, shipped)
    return [*rows, *(_row(*row) for row in users.rows())]


def _row(name: str, seeds: Sequence[Scores], published: dict[str, float] | None = None) -> Row:
    return {"name": name, "ours": summarise_seeds(seeds), "published": published or {}}
