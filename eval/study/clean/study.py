"""Cleaning study: artefacts before and after cleaning, of unseen performers through simulated suits, real suits and clean clips."""

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import torch
from rich.progress import track

from agents.weights.pretrained import PRETRAINED_POLICY, WEIGHTS_FOLDER
from configs.source_code import imported_files
from eval.clean.pipeline import CleaningPipeline
from eval.evaluation_recordings import IMU_SUIT_CLIPS, TEST_FOLDERS, check_recordings
from eval.pages.output_files import write_whole
from eval.study.clean.cases import Case, CaseResult, all_cases, clean_case, result_from_json, result_to_json
from eval.study.clean.findings import clean_findings
from eval.study.clean.page import GROUPS, clean_notes, clean_plots
from eval.study.clean.rows import NO_PHYSICS, PRETRAINED, clean_rows
from eval.study.framework.page import Study
from trainers.algorithms.policy_file import load_policy
from trainers.runs.device import available_cores
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
            results[variant].append(_result(case, variant, cleaner, keys[variant], out / "clips"))
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
        cleaners[variant] = CleaningPipeline(policy, spec, available_cores())
        keys[variant], performers[variant] = _key(file), set(card["performers"])
    without = replace(cleaners[PRETRAINED], policy=None)
    return {PRETRAINED: cleaners.pop(PRETRAINED), NO_PHYSICS: without, **cleaners}, {**keys, NO_PHYSICS: _key(None)}, performers


def _key(policy: Path | None) -> str:
    """Return a key of the code that cleans and measures, of the package's root models and of a policy."""
    models = [file for file in sorted(WEIGHTS_FOLDER.glob("*.safetensors")) if file != PRETRAINED_POLICY]
    digest = hashlib.sha256()
    for file in (*imported_files(Case.__module__), *models, *([policy] if policy else [])):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def _result(case: Case, variant: str, cleaner: CleaningPipeline, key: str, folder: Path) -> CaseResult:
    """Return the result of a clip, from the file of a former run if that has the same key."""
    own = hashlib.sha256(key.encode() + case.file.read_bytes() + str(case.seed).encode()).hexdigest()[:16]
    file = folder / _slug(variant) / f"{_slug(case.group)}_{case.file.stem}.json"
    known: Mapping[str, object] = json.loads(file.read_text()) if file.is_file() else {}
    if known.get("key") == own:
        return result_from_json(known["result"])  # type: ignore[arg-type]
    result = clean_case(case, cleaner)
    file.parent.mkdir(parents=True, exist_ok=True)
    write_whole(file, json.dumps({"key": own, "result": result_to_json(result)}, indent=1, allow_nan=False) + "\n")
    return result


def _slug(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "_", text.lower())
