"""Rows of the cleaning study: means of artefacts over all clips, over those of a folder and over those of a kind."""

from collections.abc import Iterator, Mapping, Sequence

from eval.metrics.artefacts import removed_shares
from eval.study.clean.cases import AFTER, AS_READ, BEFORE, CLEAN, REAL, SUITS, TRUTH, Case, CaseResult, Values
from eval.study.framework.page import Row, study_row, summarise_seeds

PRETRAINED, NO_RESTORING, NO_PHYSICS = "shipped policy", "no restoring", "no physics"
ALL, REMOVED = "all", "removed from simulated suits"


def row_name(group: str, part: str, side: str) -> str:
    """Return the name of a row, such as "simulated suits, kind walk: before"."""
    return f"{group}, {part}: {side}"


def kind_part(kind: str) -> str:
    """Return the part of a row's name for the clips of a kind."""
    return f"kind {kind}"


def clean_rows(cases: Sequence[Case], results: Mapping[str, Sequence[CaseResult]]) -> list[Row]:
    """Return the rows.

    Args:
        cases: Clips of the study.
        results: Results of each clip by variant of the cleaning, the package's own first.
    """
    first = next(iter(results.values()))
    rows, removed = [], []
    for group in (SUITS, REAL, CLEAN):
        for part, members in _parts(group, cases, first):
            sides = {side: _side(first, members, side) for side in (BEFORE, AS_READ)}
            sides |= {variant: _side(own, members, AFTER) for variant, own in results.items()}
            sides[TRUTH] = _side(first, members, TRUTH)
            rows += [study_row(row_name(group, part, side), values) for side, values in sides.items() if values]
            if group == SUITS:
                removed += [study_row(row_name(REMOVED, part, variant), [_removed(sides, variant)]) for variant in results]
    return rows + removed


def _removed(sides: Mapping[str, list[Values]], variant: str) -> Values:
    """Return the share of each artefact's excess over the truth that a variant removes, of the means over clips."""
    return removed_shares(
        *({name: value["mean"] for name, value in summarise_seeds(sides[side]).items()} for side in (BEFORE, variant, TRUTH))
    )


def _parts(group: str, cases: Sequence[Case], results: Sequence[CaseResult]) -> Iterator[tuple[str, list[int]]]:
    """Yield the parts of a group of clips and the indices of their members."""
    members = [index for index, case in enumerate(cases) if case.group == group]
    yield ALL, members
    for source in dict.fromkeys(cases[index].source for index in members):
        yield source, [index for index in members if cases[index].source == source]
    if group != REAL:
        for kind in sorted({results[index].kind for index in members}):
            yield kind_part(kind), [index for index in members if results[index].kind == kind]


def _side(results: Sequence[CaseResult], members: Sequence[int], side: str) -> list[Values]:
    return [results[index].sides[side] for index in members if side in results[index].sides]
