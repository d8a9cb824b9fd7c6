"""Rows of the restoring study and their names."""

from collections.abc import Mapping, Sequence

from eval.study.framework.page import Row, study_row

CLEANED, NOT_RESTORED = "cleaned", "cleaned without restoring"
FOLDER, SEVERITY, WALK, CLEANING, TRAINING = "folder", "severity", "real walk", "whole cleaning", "training"
Values = Mapping[str, float]


def part_name(source: str, field: str = "kind", part: str = "") -> str:
    """Return the name of a row of clips, such as "folder cmu/test, kind walk"; of a whole folder without a part."""
    return f"{FOLDER} {source}, {field} {part}" if part else f"{FOLDER} {source}"


def part_row(source: str, field: str, part: str, scores: Sequence[Values]) -> Row:
    """Return the row of some recordings of a folder."""
    return study_row(part_name(source, field, part), scores)


def severity_row(severity: float, scores: Sequence[Values]) -> Row:
    """Return the row of a severity of the suits' faults."""
    return study_row(f"{SEVERITY} {severity:g}", scores)


def walk_row(name: str, values: Values) -> Row:
    """Return a row of the real walk."""
    return study_row(f"{WALK}, {name}", [values])


def cleaning_name(source: str, side: str) -> str:
    """Return the name of a row of the whole cleaning, such as "whole cleaning, cmu/test: before"."""
    return f"{CLEANING}, {source}: {side}"


def cleaning_row(source: str, side: str, values: Sequence[Values]) -> Row:
    """Return the row of a folder before or after the whole of the cleaning."""
    return study_row(cleaning_name(source, side), values)


def training_name(name: str) -> str:
    """Return the name of the row of a training, such as "training, no conventions"."""
    return f"{TRAINING}, {name}"


def ingredient_row(name: str, seeds: Sequence[Values]) -> Row:
    """Return the row of a training that is repeated with several seeds."""
    return study_row(training_name(name), seeds)
