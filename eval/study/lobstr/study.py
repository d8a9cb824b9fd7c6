"""LoBSTr study: the paper's comparisons (section 4, Tables 1 to 3, figure 6) from trainings and tests, rows beside its values."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import torch
from rich.console import Console
from rich.progress import track

from agents.lobstr.model import LobstrModel
from agents.lower_body.model import LowerBodyModel
from agents.weights.pretrained import PRETRAINED_LOWER_BODY
from configs.process_pool import available_cores
from eval.evaluation_recordings import TEST_FOLDERS, TRAIN_FOLDER, check_recordings
from eval.runs.training_curves import read_curves
from eval.runs.training_pool import train_all
from eval.runs.training_spec import LOBSTR_PROGRAM, Training, run_name, training_cost
from eval.study.framework.page import Row, Study, study_row
from eval.study.framework.trainings import schedule_training
from eval.study.lobstr.evaluate import evaluate_model, predict, predict_mean_pose, score_majority_class
from eval.study.lobstr.evaluation_sessions import EvaluationClip, load_unseen_clips, simulate_sessions
from eval.study.lobstr.findings import lobstr_findings
from eval.study.lobstr.page import GROUPS, lobstr_notes
from eval.study.lobstr.plots import plot_all
from eval.study.lobstr.scores import PredictedLegs, score_clips
from eval.study.lobstr.shipped import evaluate_shipped, predict_shipped
from eval.study.lobstr.user_rows import UserRows
from eval.study.lobstr.variants import MAJORITY_CLASS, MEAN_POSE, PRETRAINED, REPRESENTATIONS, TRUTH, VARIANTS, Variant
from trainers.runs.run_log import make_console
from trainers.supervised.lobstr_config import LobstrConfig
from trainers.supervised.lobstr_data import LobstrData, prepare_lobstr_data

CONFIG = "lobstr"
NUM_SEEDS = 3
TRAINING_FRAMES = 120 * 64 * 46  # predicted in each training: a minute of a core for a GRU
NUM_EVALUATIONS = 10  # of each training on its held-out performer
COMMON_OVERRIDES = (
    "model.upright=false",  # as in the paper, like all below except batches
    "data.mirror=false", "data.synthetic_sets=0", "data.tempo_takes=1",
    "learner.position_noise_m=0.01", "learner.rotation_noise_deg=1.5", "learner.placement_std_m=0",
    "learner.pose_weight=1", "learner.kinematics_weight=0.1", "learner.velocity_weight=0.1", "learner.contact_weight=1e-6",
    "learner.learning_rate=1e-3", "learner.final_learning_rate=2.2e-4",
    "learner.batch=64", "learner.predicted_frames=46",  # where the paper has 256 windows of one prediction each: see the page's notes
    "minutes=0", "learner.threads=1",
)  # fmt: skip
LobstrRun = Training[LobstrConfig]


def lobstr_study(data: Path, out: Path) -> Study:
    """Return the LoBSTr study; its trainings stay in ``out`` and are not repeated.

    Args:
        data: Folder of real motion.
        out: Folder of the study.

    Raises:
        InputError: If a recording is not there.
    """
    check_recordings(data, (TRAIN_FOLDER, *TEST_FOLDERS))
    console = make_console()
    runs = {variant.name: [_training(variant, seed, data, out) for seed in range(NUM_SEEDS)] for variant in VARIANTS}
    motion = _train([run for own in runs.values() for run in own], console)
    with console.status("reading test clips"):
        clips = load_unseen_clips(data)
    torch.set_num_threads(available_cores())
    rows = _rows(runs, motion, clips, console)
    curves = {row: [read_curves(run.folder) for run in own] for row, own in runs.items()}
    table = {"study": "lobstr", "rows": rows, "findings": lobstr_findings(rows)}
    return Study(table, GROUPS, plot_all(rows, curves), lobstr_notes(TRAINING_FRAMES, motion, clips))


def _training(variant: Variant, seed: int, data: Path, out: Path) -> LobstrRun:
    """Return one run of a network."""
    overrides = (*COMMON_OVERRIDES, *variant.overrides, f"data.motions={(data / TRAIN_FOLDER).resolve()}")
    run = Training(LOBSTR_PROGRAM, CONFIG, overrides, run_name(variant.name, seed), out.resolve() / "runs")
    return schedule_training(
        run, seed, TRAINING_FRAMES, lambda config: config.learner.batch * config.learner.predicted_frames, NUM_EVALUATIONS
    )


def _train(runs: Sequence[LobstrRun], console: Console) -> LobstrData:
    """Run the trainings that are not done; return the motion that all share, which is prepared once."""
    with console.status("preparing motion"):
        motion = prepare_lobstr_data(runs[0].resolve_config().data, runs[0].runs / "cache", console.print)
    train_all(runs, console)
    return motion


def _rows(runs: Mapping[str, Sequence[LobstrRun]], motion: LobstrData, clips: Sequence[EvaluationClip], console: Console) -> list[Row]:
    """Return the rows of all networks and baselines with perfect trackers, then those of the virtual users."""
    rows: list[Row] = []
    users = UserRows(simulate_sessions(clips))
    names = {row: how for how, row in REPRESENTATIONS.items()}
    for variant in track(VARIANTS, "testing networks", console=console, transient=True):
        seeds = []
        for run in runs[variant.name]:
            model = LobstrModel.load(run.weights_path)[0]
            seeds.append(evaluate_model(model, clips) | training_cost(run))
            if variant.name in names:
                users.add(names[variant.name], partial(predict, model, carried=True), seeds[-1]["toe_position_error_carried"])
        row = study_row(variant.name, seeds, variant.published)
        rows.append(row | {"config": CONFIG, "overrides": list(runs[variant.name][0].overrides)})
    rows.append(study_row(MAJORITY_CLASS, [score_majority_class(motion, clips)]))
    rows.append(study_row(MEAN_POSE, [score_clips(clips, predict_mean_pose(motion, clips))]))
    rows.append(study_row(TRUTH, [{"body_movement": score_clips(clips, [PredictedLegs(clip.legs) for clip in clips])["body_movement"]}]))
    model, card = LowerBodyModel.load(PRETRAINED_LOWER_BODY)
    shipped = evaluate_shipped(model, clips) | {"samples": float(card["frames"]), "minutes": 60.0 * card["hours"]}
    rows.append(study_row(PRETRAINED, [shipped]))
    users.add(PRETRAINED, partial(predict_shipped, model), shipped["toe_position_error"])
    return [*rows, *(study_row(*row) for row in users.rows())]
