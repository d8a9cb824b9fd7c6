"""The thesis's findings on root trajectories (chapters 2 and 3) as one command: trainings, tests, rows beside its values."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import track

from agents.root.model import RootModel
from eval.recordings import FOLDERS, REAL_CLIPS, TRAINED_ON, WALK, check_recordings
from eval.runs.training_pool import train_all
from eval.runs.training_spec import SUPERVISED, Training, effort, run_name
from eval.study.protocol.page import Study, summarise_seeds
from eval.study.root.evaluate import Examined, examine, peers, walk_peers
from eval.study.root.findings import find
from eval.study.root.page import GROUPS, NOTES
from eval.study.root.plots import plot_all
from eval.study.root.scores import Scores
from eval.study.root.test_takes import Takes, unseen_clips, wear_suits
from eval.study.root.variants import MODELS, Model
from eval.study.suit.acceleration_check import MVNX, compare_accelerations
from eval.study.suit.vicon_walk import RealWalk, real_walk
from trainers.runs.run_log import make_console
from trainers.supervised.root_config import RootConfig
from trainers.supervised.root_data import prepare_root_data

SEEDS = 3
SAMPLES = {"planar": 150_000, "root3d": 2_500_000}  # windows of each training: about 100 s of a core
PREPARED = ("data.synthetic=4", "data.takes=4")  # what takes minutes to prepare rather than a quarter of an hour
EVALUATIONS = 2  # of each training on its held-out performer
Row = dict[str, Any]


def root_study(data: Path, out: Path) -> Study:
    """Return the study; its trainings stay in ``out`` and are not repeated.

    Args:
        data: Folder of real motion.
        out: Folder of the study.

    Raises:
        InputError: If a recording is not there.
    """
    check_recordings(data, (TRAINED_ON, *FOLDERS, MVNX, WALK, REAL_CLIPS[-1]))
    console = make_console()
    trainings = {model.name: [_training(model, seed, data, out) for seed in range(SEEDS)] for model in MODELS}
    _train([run for runs in trainings.values() for run in runs], console)
    with console.status("reading test clips"):
        clips, walk = unseen_clips(data), real_walk(data)
    takes = wear_suits(track(clips, "suits on test clips", console=console, transient=True))
    rows, examined = _rows(trainings, takes, walk, console)
    rows += [_accelerations(row) for row in compare_accelerations(data)]
    return Study({"study": "root", "rows": rows, "findings": find(rows)}, GROUPS, plot_all(rows, takes, examined), NOTES)


def _training(model: Model, seed: int, data: Path, out: Path) -> Training[RootConfig]:
    """Return one run of a model; nothing but the run's own seed tells the seeds apart."""
    overrides = (
        *model.overrides,
        f"data.motions={(data / TRAINED_ON).resolve()}",
        *PREPARED,
        f"data.poses={model.poses}",
        f"samples={SAMPLES[model.config]}",
        f"seed={seed}",
    )
    run = Training(SUPERVISED, model.config, overrides, run_name(model.name, seed), out.resolve() / "runs")
    every = max(1, -(-SAMPLES[model.config] // run.resolved().learner.batch // EVALUATIONS))
    return replace(run, overrides=(*overrides, f"evaluate_every={every}", f"checkpoint_every={every}"))


def _train(runs: Sequence[Training[RootConfig]], console: Console) -> None:
    """Run what is not done; its motion is prepared once, since what differs between the trainings' data is a choice from the same."""
    if not all(run.is_done() for run in runs):
        with console.status("preparing motion"):
            prepare_root_data(runs[0].resolved().data, runs[0].runs / "cache", console.print)
    train_all(runs, console)


def _rows(
    trainings: dict[str, list[Training[RootConfig]]], takes: Takes, walk: RealWalk, console: Console
) -> tuple[list[Row], dict[str, Examined]]:
    """Return the rows, and by name what was measured of their first seeds."""
    rows: list[Row] = []
    examined: dict[str, Examined] = {}
    for model in track(MODELS, "testing models", console=console, transient=True):
        seeds = []
        for run in trainings[model.name]:
            one = examine(RootModel.load(run.network)[0], model.poses, takes, walk)
            examined.setdefault(model.name, one)
            seeds.append(one.scores | effort(run))
        rows.append(_row(model.name, seeds, model.published) | {"config": model.config, "overrides": list(model.overrides)})
    for name, peer in peers(takes, walk).items():
        examined[name] = peer
        rows.append(_row(name, [peer.scores]))
    return rows + [_row(name, [scores]) for name, scores in walk_peers(walk).items()], examined


def _row(name: str, seeds: Sequence[Scores], published: dict[str, float] | None = None) -> Row:
    return {"name": name, "ours": summarise_seeds(seeds), "published": published or {}}


def _accelerations(compared: Row) -> Row:
    """Return a row of how simulated accelerations of one body differ from measured ones."""
    values = {key: value for key, value in compared.items() if key not in ("recording", "body")}
    return _row(f"accelerations, {compared['recording']}: {compared['body']}", [values])
