"""Root study: the thesis's findings on root trajectories (chapters 2 and 3) from trainings and tests, rows beside its values."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import track

from agents.root.model import RootModel
from eval.evaluation_recordings import IMU_SUIT_CLIPS, SENSOR_WALK_FOLDER, TEST_FOLDERS, TRAIN_FOLDER, check_recordings
from eval.runs.training_pool import train_all
from eval.runs.training_spec import ROOT_PROGRAM, Training, run_name, training_cost
from eval.study.framework.page import Row, Study, study_row
from eval.study.framework.trainings import schedule_training
from eval.study.root.evaluate import ModelEvaluation, evaluate_baselines, evaluate_model, evaluate_walk_baselines
from eval.study.root.evaluation_takes import TakesByPose, load_unseen_clips, simulate_takes
from eval.study.root.findings import root_findings
from eval.study.root.page import GROUPS, NOTES
from eval.study.root.plots import plot_all
from eval.study.root.variants import VARIANTS, Variant
from eval.study.suit.acceleration_check import MVNX, AccelerationRow, compare_accelerations
from eval.study.suit.vicon_walk import RealWalk, load_real_walk
from trainers.runs.run_log import make_console
from trainers.supervised.root_config import RootConfig
from trainers.supervised.root_data import prepare_root_data

NUM_SEEDS = 3
TRAINING_WINDOWS = {"planar": 150_000, "root3d": 2_500_000}  # windows of each training: about 100 s of a core
# Suits' poses as captured, as in the thesis; two takes of an hour of clips are what trainings that run side by side have the memory for.
PREPARED = ("data.synthetic_sets=4", "data.suit_takes=2", "data.tempo=1.5", "data.restored_share=0")
NUM_EVALUATIONS = 2  # of each training on its held-out performer


def root_study(data: Path, out: Path) -> Study:
    """Return the root study; its trainings stay in ``out`` and are not repeated.

    Args:
        data: Folder of real motion.
        out: Folder of the study.

    Raises:
        InputError: If a recording is not there.
    """
    check_recordings(data, (TRAIN_FOLDER, *TEST_FOLDERS, MVNX, SENSOR_WALK_FOLDER, IMU_SUIT_CLIPS[-1]))
    console = make_console()
    trainings = {model.name: [_training(model, seed, data, out) for seed in range(NUM_SEEDS)] for model in VARIANTS}
    _train([run for runs in trainings.values() for run in runs], console)
    with console.status("reading test clips"):
        clips, walk = load_unseen_clips(data), load_real_walk(data)
    takes = simulate_takes(track(clips, "suits on test clips", console=console, transient=True))
    rows, evaluations = _rows(trainings, takes, walk, console)
    rows += [_accelerations(row) for row in compare_accelerations(data)]
    return Study({"study": "root", "rows": rows, "findings": root_findings(rows)}, GROUPS, plot_all(rows, takes, evaluations), NOTES)


def _training(model: Variant, seed: int, data: Path, out: Path) -> Training[RootConfig]:
    """Return one run of a model."""
    overrides = (*model.overrides, f"data.motions={(data / TRAIN_FOLDER).resolve()}", *PREPARED, f"data.pose_source={model.poses}")
    run = Training(ROOT_PROGRAM, model.config, overrides, run_name(model.name, seed), out.resolve() / "runs")
    return schedule_training(run, seed, TRAINING_WINDOWS[model.config], lambda config: config.learner.batch, NUM_EVALUATIONS)


def _train(runs: Sequence[Training[RootConfig]], console: Console) -> None:
    """Run the trainings that are not done; motion is prepared once, as all of them choose from the same."""
    if not all(run.is_done() for run in runs):
        with console.status("preparing motion"):
            prepare_root_data(runs[0].resolve_config().data, runs[0].runs / "cache", console.print)
    train_all(runs, console)


def _rows(
    trainings: dict[str, list[Training[RootConfig]]], takes: TakesByPose, walk: RealWalk, console: Console
) -> tuple[list[Row], dict[str, ModelEvaluation]]:
    """Return the rows, and the test results of their first seeds by name."""
    rows: list[Row] = []
    evaluations: dict[str, ModelEvaluation] = {}
    for model in track(VARIANTS, "testing models", console=console, transient=True):
        seeds = []
        for run in trainings[model.name]:
            one = evaluate_model(RootModel.load(run.weights_path)[0], model.poses, takes, walk)
            evaluations.setdefault(model.name, one)
            seeds.append(one.scores | training_cost(run))
        rows.append(study_row(model.name, seeds, model.published) | {"config": model.config, "overrides": list(model.overrides)})
    for name, peer in evaluate_baselines(takes, walk).items():
        evaluations[name] = peer
        rows.append(study_row(name, [peer.scores]))
    return rows + [study_row(name, [scores]) for name, scores in evaluate_walk_baselines(walk).items()], evaluations


def _accelerations(compared: AccelerationRow) -> Row:
    """Return the row of the difference between simulated and measured accelerations of one body."""
    values = {key: value for key, value in compared.items() if key not in ("recording", "body")}
    return study_row(f"accelerations, {compared['recording']}: {compared['body']}", [values])
