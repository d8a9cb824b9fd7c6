"""Rows of a study, compared by the rule of all findings on networks and policies that are trained with several seeds.

The rule stands before any row is known: one row is better than another where their means differ by more than their two standard
deviations over seeds together, so that the ranges "mean ± std" do not touch. What is closer is undecided, and not reproduced.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

Finding = dict[str, Any]
Claims = Iterator[tuple[str, bool]]


class ComparedRows:
    """The rows by name, to be compared."""

    def __init__(
        self, rows: Sequence[Mapping[str, Any]], sign: Callable[[str], float], text: Callable[[Mapping[str, float], str], str]
    ) -> None:
        """Take rows.

        Args:
            rows: Of a study.
            sign: Returns 1 for a measure of which more is better, else -1.
            text: Returns mean and standard deviation of a measure for people.
        """
        self._ours = {row["name"]: row["ours"] for row in rows}
        self._sign, self._text = sign, text

    def __contains__(self, name: str) -> bool:
        """Return whether there is such a row."""
        return name in self._ours

    def has_measure(self, name: str, measure: str) -> bool:
        """Return whether a row has a measure."""
        return measure in self._ours[name]

    def mean(self, name: str, measure: str) -> float:
        """Return the mean of a measure."""
        return self._ours[name][measure]["mean"]

    def best(self, names: Sequence[str], measure: str) -> str:
        """Return the row that is best by its mean."""
        return max(names, key=lambda name: self._sign(measure) * self.mean(name, measure))

    def worst(self, names: Sequence[str], measure: str) -> str:
        """Return the row that is worst by its mean."""
        return min(names, key=lambda name: self._sign(measure) * self.mean(name, measure))

    def claim_better(self, name: str, other: str, measure: str, claim: str) -> tuple[str, bool]:
        """Return a claim with the numbers behind it, and whether one row is better than another."""
        lead, spread = self._compared(name, other, measure)
        verdict = "so it is" if lead > spread else "it is the other way round" if -lead > spread else "undecided, closer than seeds are"
        return f"{claim}: {self._numbers(name, other, measure)}: {verdict}", lead > spread

    def claim_alike(self, name: str, other: str, measure: str, claim: str) -> tuple[str, bool]:
        """Return a claim that two rows do not differ, with the numbers behind it, and whether it holds."""
        lead, spread = self._compared(name, other, measure)
        verdict = "closer than seeds are" if abs(lead) <= spread else f"{name if lead > 0 else other} is better"
        return f"{claim}: {self._numbers(name, other, measure)}: {verdict}", abs(lead) <= spread

    def text(self, name: str, measure: str) -> str:
        """Return mean and standard deviation of a measure."""
        return self._text(self._ours[name][measure], measure)

    def _compared(self, name: str, other: str, measure: str) -> tuple[float, float]:
        one, two = (self._ours[row][measure] for row in (name, other))
        return self._sign(measure) * (one["mean"] - two["mean"]), one["std"] + two["std"]

    def _numbers(self, name: str, other: str, measure: str) -> str:
        return f"{measure} {self.text(name, measure)} ({name}) against {self.text(other, measure)} ({other})"


def as_findings(found: Iterable[tuple[str, bool]]) -> list[Finding]:
    """Return claims and whether they hold as a study's JSON has them."""
    return [{"finding": text, "reproduced": bool(reproduced)} for text, reproduced in found]
