"""Cleaning study: artefacts before and after cleaning, of unseen performers through simulated suits, real suits and clean clips."""

from pathlib import Path

import torch
from rich.progress import track

from agents.weights.pretrained import PRETRAINED_POLICY, load_pretrained_restore
from configs.process_pool import available_cores
from eval.clean.edits import PHYSICS, RESTORE
from eval.clean.pipeline import CleaningPipeline
from eval.clean.quality import FAST, GOOD, QUALITIES, Simulator
from eval.evaluation_recordings import IMU_SUIT_CLIPS, TEST_FOLDERS, check_recordings
from eval.study.clean.case_results import case_result, pipeline_key
from eval.study.clean.cases import CaseResult, all_cases
from eval.study.clean.findings import clean_findings
from eval.study.clean.page import GROUPS, clean_notes, clean_plots
from eval.study.clean.rows import NO_PHYSICS, NO_RESTORING, PRETRAINED, clean_rows
from eval.study.framework.page import Study
from trainers.algorithms.policy_file import load_policy
from trainers.runs.run_log import make_console

POLICIES = "policies"  # folder below the study's of policies to compare with the package's


def clean_study(data: Path, out: Path) -> Study:
    """Return the study; the result of each clip stays in ``out`` and is not repeated while clip, policy and code are the same.

    Args:
        data: Folder of real motion.
        out: Folder of the study; policies in its folder "policies" are compared with the package's.

    Raises:
        InputError: If a recording is not there, or a policy cannot be loaded.
    """
    check_recordings(data, (*TEST_FOLDERS, *IMU_SUIT_CLIPS))
    cleaners, keys, performers = _variants(out)
    cases, console = all_cases(data), make_console()
    torch.set_num_threads(available_cores())
    results: dict[str, list[CaseResult]] = {variant: [] for variant in cleaners}
    for case in track(cases, "cleaning clips", console=console, transient=True):
        for variant, cleaner in cleaners.items():
            results[variant].append(case_result(case, variant, cleaner, keys[variant], out / "clips"))
    rows, first = clean_rows(cases, results), results[PRETRAINED]
    tested = {result.performer for result in first}
    seen = {variant: sorted(tested & known) for variant, known in performers.items()}
    table = {"study": "clean", "rows": rows, "findings": clean_findings(rows, tuple(cleaners))}
    return Study(table, GROUPS, clean_plots(rows, tuple(cleaners)), clean_notes(cases, first, seen))


def _variants(out: Path) -> tuple[dict[str, CleaningPipeline], dict[str, str], dict[str, set[str]]]:
    """Return by variant the pipeline, a key of all that it depends on, and the performers that its training saw."""
    files = {PRETRAINED: PRETRAINED_POLICY} | {file.stem: file for file in sorted((out / POLICIES).glob("*.safetensors"))}
    cleaners, keys, performers = {}, {}, {}
    for variant, file in files.items():
        policy, card, spec = load_policy(file)
        search = QUALITIES[GOOD if variant == PRETRAINED else FAST]  # which searches along the policy
        cleaners[variant] = CleaningPipeline(Simulator(policy, spec, available_cores(), search), load_pretrained_restore())
        keys[variant], performers[variant] = pipeline_key(file), set(card["performers"])
    own = cleaners.pop(PRETRAINED)
    keys |= {NO_RESTORING: pipeline_key(PRETRAINED_POLICY, restored=False), NO_PHYSICS: pipeline_key(None)}
    return {PRETRAINED: own, NO_RESTORING: own.without([RESTORE]), NO_PHYSICS: own.without([PHYSICS]), **cleaners}, keys, performers
