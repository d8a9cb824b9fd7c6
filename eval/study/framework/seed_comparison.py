"""Comparison of a study's rows by the one rule for findings on networks and policies that are trained with several seeds.

The rule stands before any row is known: two rows differ where their means are further apart than their two standard deviations over
seeds together (the sum), so that the ranges "mean ± std" do not touch. What is closer is undecided, and not reproduced.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

Finding = dict[str, Any]
Claims = Iterator[tuple[str, bool]]


class ComparedRows:
    """Compares the rows of a study, by their names."""

    def __init__(
        self, rows: Sequence[Mapping[str, Any]], sign: Callable[[str], float], text: Callable[[Mapping[str, float], str], str]
    ) -> None:
        """Index the rows by name.

        Args:
            rows: Rows of a study.
            sign: Returns 1 for a measure of which more is better, else -1.
            text: Formats the mean and standard deviation of a measure, with its unit if any.
        """
        self._ours = {row["name"]: row["ours"] for row in rows}
        self._sign, self._text = sign, text

    def __contains__(self, name: str) -> bool:
        """Return whether there is such a row."""
        return name in self._ours

    def measures(self, name: str) -> list[str]:
        """Return the measures of a row."""
        return list(self._ours[name])

    def mean(self, name: str, measure: str) -> float:
        """Return the mean of a measure over seeds."""
        return self._ours[name][measure]["mean"]

    def std(self, name: str, measure: str) -> float:
        """Return the standard deviation of a measure over seeds."""
        return self._ours[name][measure]["std"]

    def best(self, names: Sequence[str], measure: str) -> str:
        """Return the name of the row with the best mean."""
        return max(names, key=lambda name: self._sign(measure) * self.mean(name, measure))

    def worst(self, names: Sequence[str], measure: str) -> str:
        """Return the name of the row with the worst mean."""
        return min(names, key=lambda name: self._sign(measure) * self.mean(name, measure))

    def is_less(self, name: str, other: str, measure: str, other_measure: str = "") -> bool:
        """Return whether a measure of one row is less than that of another, or than another measure of it, by the rule."""
        difference, spread = self._difference((name, measure), (other, other_measure or measure))
        return -difference > spread

    def claim_better(self, name: str, other: str, measure: str, claim: str) -> tuple[str, bool]:
        """Return a claim with the numbers behind it, and whether one row is better than another by the rule."""
        lead, spread = self._lead(name, other, measure)
        verdict = "so it is" if lead > spread else "it is the other way round" if -lead > spread else "undecided, closer than seeds are"
        return f"{claim}: {self._numbers(name, other, measure)}: {verdict}", lead > spread

    def claim_alike(self, name: str, other: str, measure: str, claim: str) -> tuple[str, bool]:
        """Return a claim that two rows do not differ, with the numbers behind it, and whether it holds."""
        lead, spread = self._lead(name, other, measure)
        verdict = "closer than seeds are" if abs(lead) <= spread else f"{name if lead > 0 else other} is better"
        return f"{claim}: {self._numbers(name, other, measure)}: {verdict}", abs(lead) <= spread

    def text(self, name: str, measure: str) -> str:
        """Return the mean and standard deviation of a measure as text."""
        return self._text(self._ours[name][measure], measure)

    def _lead(self, name: str, other: str, measure: str) -> tuple[float, float]:
        """Return by how much a row is better than another, and the two standard deviations together."""
        difference, spread = self._difference((name, measure), (other, measure))
        return self._sign(measure) * difference, spread

    def _difference(self, *values: tuple[str, str]) -> tuple[float, float]:
        """Return the difference of two means, each given by row and measure, and the two standard deviations together."""
        one, two = (self._ours[row][measure] for row, measure in values)
        return one["mean"] - two["mean"], one["std"] + two["std"]

    def _numbers(self, name: str, other: str, measure: str) -> str:
        return f"{measure} {self.text(name, measure)} ({name}) against {self.text(other, measure)} ({other})"


def as_findings(found: Iterable[tuple[str, bool]]) -> list[Finding]:
    """Return claims and whether they hold in the form of ``study.json``."""
    return [{"finding": text, "reproduced": bool(reproduced)} for text, reproduced in found]
