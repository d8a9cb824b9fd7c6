"""Policy studies (thesis Table 4.4, section 4.5): training data, and observed bodies and corrected joints."""

from collections.abc import Callable, Sequence
from pathlib import Path

import torch
from rich.console import Console
from rich.progress import track

from configs.process_pool import available_cores
from eval.evaluation_recordings import TEST_FOLDERS, TRAIN_FOLDER, check_recordings
from eval.runs.trained_run import load_run
from eval.runs.training_curves import read_curves
from eval.runs.training_pool import train_all
from eval.runs.training_spec import PPO_PROGRAM, Training, run_name, training_cost
from eval.study.framework.page import Row, Study, study_row
from eval.study.framework.trainings import schedule_training
from eval.study.policy.findings import Finding, configuration_findings, mixture_findings
from eval.study.policy.page import GROUPS, plot_training_curves, policy_notes
from eval.study.policy.scores import Scores, data_size, score_policy
from eval.study.policy.unseen_clips import UnseenClips, load_unseen_clips, split_half
from eval.study.policy.variants import CONFIGURATION, MIXTURE, UNTRAINED, Variant
from trainers.algorithms.ppo_config import PpoConfig
from trainers.data.training_motions import prepare_motions
from trainers.evaluation.evaluation_protocol import zero_residual
from trainers.runs.run_log import make_console

CONFIG = "mixed"
NUM_SEEDS = 2
TOTAL_CONTROL_STEPS = 4_800_000  # of a whole study, shared out equally to its trainings: about 35 minutes of one core
NUM_EVALUATIONS = 5  # of each training on its held-out performer
COMMON_OVERRIDES = (
    "minutes=0",  # by samples alone
    "collect.actors=0", "collect.threads=1", "learner.threads=1",  # a core a training
    "data.reward_target=observed", "data.synthetic_sets=0", "data.mirror=false", "task.foot_slip=0", "task.action_rate=0",  # thesis
)  # fmt: skip
PolicyRun = Training[PpoConfig]


def mixture_study(data: Path, out: Path) -> Study:
    """Return the study of training data; arguments and errors are those of ``configuration_study``."""
    return _study("mixture", MIXTURE, mixture_findings, data, out)


def configuration_study(data: Path, out: Path) -> Study:
    """Return the study of observed bodies and corrected joints; its trainings stay in ``out`` and are not repeated.

    Args:
        data: Folder of real motion.
        out: Folder of the study.

    Raises:
        InputError: If a recording is not there.
    """
    return _study("configuration", CONFIGURATION, configuration_findings, data, out)


def _study(name: str, variants: Sequence[Variant], find: Callable[[Sequence[Row]], list[Finding]], data: Path, out: Path) -> Study:
    check_recordings(data, (TRAIN_FOLDER, *TEST_FOLDERS))
    console, out = make_console(), out.resolve()
    cache, folders = out / "runs" / "cache", {True: (data / TRAIN_FOLDER).resolve(), False: out / "half"}
    first = _training(variants[0], 0, TOTAL_CONTROL_STEPS, folders[True], "auto", out).resolve_config()
    held_out, performers = split_half(first.data, folders[False], cache, console.print)
    steps = TOTAL_CONTROL_STEPS // (NUM_SEEDS * len(variants))
    runs = {
        variant.name: [_training(variant, seed, steps, folders[variant.uses_all_clips], held_out, out) for seed in range(NUM_SEEDS)]
        for variant in variants
    }
    sizes = {row: data_size(prepare_motions(own[0].resolve_config().data, cache, console.print)) for row, own in runs.items()}
    train_all([run for own in runs.values() for run in own], console)
    tested = load_unseen_clips(data, first.data, performers, cache, console.print)
    rows = _rows(variants, runs, sizes, tested, console)
    curves = {row: [read_curves(run.folder) for run in own] for row, own in runs.items()}
    table = {"study": name, "rows": rows, "findings": find(rows)}
    return Study(table, GROUPS, plot_training_curves(curves), policy_notes(first, steps, NUM_SEEDS, held_out, tested))


def _training(variant: Variant, seed: int, steps: int, motions: Path, held_out: str, out: Path) -> PolicyRun:
    """Return one run of a row."""
    overrides = (*COMMON_OVERRIDES, *variant.overrides, f"data.motions={motions}", f"data.holdout={held_out}")
    run = Training(PPO_PROGRAM, CONFIG, overrides, run_name(variant.name, seed), out / "runs")
    return schedule_training(run, seed, steps, lambda config: config.collect.envs * config.collect.horizon, NUM_EVALUATIONS)


def _rows(
    variants: Sequence[Variant],
    runs: dict[str, list[PolicyRun]],
    sizes: dict[str, Scores],
    tested: Sequence[UnseenClips],
    console: Console,
) -> list[Row]:
    """Return the rows, and one of the zero residual."""
    threads = available_cores()  # of the physics; the networks are too small to be shared out
    torch.set_num_threads(1)
    rows: list[Row] = []
    for variant in track(variants, "testing policies", console=console, transient=True):
        seeds: list[Scores] = []
        for training in runs[variant.name]:
            run = load_run(training.folder)
            seeds.append(score_policy(run.policy.act, run.spec, tested, threads) | training_cost(training) | sizes[variant.name])
        row = study_row(variant.name, seeds, variant.published)
        rows.append(row | {"config": CONFIG, "overrides": list(runs[variant.name][0].overrides)})
    spec = runs[variants[0].name][0].resolve_config().task
    nothing = score_policy(zero_residual(spec), spec, tested, threads)
    return [*rows, study_row(UNTRAINED, [nothing])]
