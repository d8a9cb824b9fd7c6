"""Findings of the restoring study: its aims with the numbers that decide them, and ingredients by the one rule for trainings."""

from collections.abc import Mapping, Sequence
from typing import Any

from eval.study.framework.seed_comparison import Claims, ComparedRows, Finding, as_findings
from eval.study.restore.rows import CLEANED, CLEANING, FOLDER, TRAINING, cleaning_name, part_name, training_name
from eval.study.restore.variants import WHOLE

MIN_GAIN = {"cmu/test": 0.35, "bandai/test": 0.20}  # share of the distance to the truth that is to be taken out
MAX_LOSS_MM = 1.0  # mm, by which a kind of motion may be farther from the truth afterwards
MAX_HARM_MM = 5.0  # mm, by which a clean clip may be moved
MIN_CONTACT_ACCURACY = 92.0  # %
MAX_SKATE_OVER_TRUTH = 3.0  # cm/s
MIN_CLEANED_GAIN = 0.25  # share of the distance to the truth that is to be gone after the whole cleaning
Rows = Sequence[Mapping[str, Any]]


def restore_findings(rows: Rows) -> list[Finding]:
    """Return each aim, and whether each ingredient of the training is worth its place."""
    return as_findings([*_aims(rows), *_cleaning(rows), *_ingredients(rows)])


def _aims(rows: Rows) -> Claims:
    ours = {row["name"]: {name: value["mean"] for name, value in row["ours"].items()} for row in rows if row["name"].startswith(FOLDER)}
    for source, gain in MIN_GAIN.items():
        yield _less(
            f"{source}, poses restored", ours[part_name(source)]["truth_error_local"], ours[part_name(source)]["restored_error"], gain
        )
    for name, found in ours.items():
        if "moved_if_clean" in found:
            lost = found["restored_error"] - found["truth_error_local"]
            yield f"{name}: {lost:+.1f} mm from the truth by restoring; aim: at most {MAX_LOSS_MM:g} mm more", lost <= MAX_LOSS_MM
    for source in (name for name in ours if ", " not in name):
        found = ours[source]
        yield f"{source}: clean clips moved by {found['harm']:.1f} mm; aim: at most {MAX_HARM_MM:g} mm", found["harm"] <= MAX_HARM_MM
        right, usual = found["contact_accuracy"], found["contact_commoner"]
        text = f"{source}: {right:.1f} % of contacts are right ({usual:.1f} % by always guessing the commoner)"
        yield f"{text}; aim: {MIN_CONTACT_ACCURACY:g} %", right >= MIN_CONTACT_ACCURACY
        skate, own = found["stance_skate_planted"], found["stance_skate_truth"]
        text = f"{source}: planted feet slide at {skate:.1f} cm/s, {found['stance_skate_before']:.1f} before, {own:.1f} in the truth"
        yield f"{text}; aim: within {MAX_SKATE_OVER_TRUTH:g} cm/s of the truth", skate <= own + MAX_SKATE_OVER_TRUTH


def _cleaning(rows: Rows) -> Claims:
    errors = {
        row["name"]: row["ours"]["truth_error_local"]["mean"]
        for row in rows
        if row["name"].startswith(CLEANING) and "truth_error_local" in row["ours"]
    }
    for source in MIN_GAIN:
        before, after = errors[cleaning_name(source, "before")], errors[cleaning_name(source, CLEANED)]
        yield _less(f"{source}, after the whole cleaning", before, after, MIN_CLEANED_GAIN)


def _ingredients(rows: Rows) -> Claims:
    trainings = [row for row in rows if row["name"].startswith(TRAINING)]
    compared = ComparedRows(trainings, lambda _: -1.0, lambda value, _: f"{value['mean']:.1f} ± {value['std']:.1f} mm")
    for row in trainings:
        if row["name"] != training_name(WHOLE):
            for source in MIN_GAIN:
                yield compared.claim_better(
                    training_name(WHOLE), row["name"], f"{source} restored_error", f"better than with {row['name'][len(TRAINING) + 2 :]}"
                )


def _less(what: str, before: float, after: float, gain: float) -> tuple[str, bool]:
    change = after / before - 1.0
    return f"{what}: {after:.1f} mm from the truth, {before:.1f} before, {100 * change:+.0f} %; aim: {-100 * gain:.0f} %", change <= -gain
