"""Results of cleaned clips, kept as files: a clip is cleaned again only if it, the models or the code have changed."""

import hashlib
import json
import re
from collections.abc import Mapping
from pathlib import Path

from agents.weights.pretrained import PRETRAINED_POLICY, WEIGHTS_FOLDER
from configs.source_code import imported_files
from eval.clean.pipeline import CleaningPipeline
from eval.pages.output_files import write_whole
from eval.study.clean.cases import Case, CaseResult, clean_case, result_from_json, result_to_json


def pipeline_key(policy: Path | None, restored: bool = True) -> str:
    """Return a key of the code that cleans and measures, and of the models that take part.

    Args:
        policy: File of the policy; None without physics.
        restored: Whether poses are restored.
    """
    models = [file for file in sorted(WEIGHTS_FOLDER.glob("*.safetensors")) if file != PRETRAINED_POLICY]
    digest = hashlib.sha256(b"" if restored else b"not restored")
    for file in (*imported_files(Case.__module__), *models, *([policy] if policy else [])):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def case_result(case: Case, variant: str, cleaner: CleaningPipeline, key: str, folder: Path) -> CaseResult:
    """Return the result of a clip, from the file of a former run if that has the same key.

    Args:
        case: Clip to clean.
        variant: Name of the pipeline.
        cleaner: The pipeline.
        key: What ``pipeline_key`` returned for it.
        folder: Folder of all results.
    """
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
