"""A study as a page and as text: groups of measures as tables, ours beside the published values, findings and plots."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from eval.pages.page import number, render_page

Summary = dict[str, float]  # mean, std, seeds


class Measure(NamedTuple):
    """How a measure is printed."""

    unit: str
    text: str


class Group(NamedTuple):
    """Measures that are read together: one table, with the rows that have one of them.

    Attributes:
        heading: Of the table.
        reading: How to read it, in a sentence or two.
        measures: By id.
        rows: How the names of its rows begin.
    """

    heading: str
    reading: str
    measures: Mapping[str, Measure]
    rows: tuple[str, ...] = ("",)


class Plot(NamedTuple):
    """A plot.

    Attributes:
        section: Plots of the same section stand together.
        title: Of the plot.
        figure: Plotly's, plain data; the page replaces the colour "text" by that of its text.
    """

    section: str
    title: str
    figure: dict[str, Any]


@dataclass(frozen=True)
class Study:
    """What a study found.

    Attributes:
        table: What ``study.json`` holds: study, rows and findings.
        groups: Tables of the page, the first of which the terminal shows too; one table of everything if empty.
        plots: Pictures of it.
        notes: What a reader must know.
    """

    table: dict[str, Any]
    groups: Sequence[Group] = ()
    plots: Sequence[Plot] = ()
    notes: Sequence[str] = field(default=())


def summarise_seeds(seeds: Sequence[Mapping[str, float]]) -> dict[str, Summary]:
    """Return mean and standard deviation over seeds of each measure that all of them have."""
    shared = [key for key in seeds[0] if all(key in one for one in seeds)]
    return {key: mean_and_std([one[key] for one in seeds]) for key in shared}


def mean_and_std(values: Sequence[float]) -> Summary:
    """Return mean, standard deviation and how many values there are."""
    mean = sum(values) / len(values)
    return {"mean": float(mean), "std": float((sum((x - mean) ** 2 for x in values) / len(values)) ** 0.5), "seeds": len(values)}


def study_page(study: Study) -> str:
    """Return the page as HTML."""
    sections: dict[str, list[Plot]] = {}
    for plot in study.plots:
        sections.setdefault(plot.section, []).append(plot)
    return render_page(
        "study/protocol/study.html.j2",
        {"brief": format_three_digits},
        study=study.table,
        groups=[(group, _rows_of(group, study)) for group in _groups(study)],
        sections=sections,
        notes=study.notes,
        text=study_text(study.table),
    )


def study_text(table: Mapping[str, Any], measures: Collection[str] = (), rows: tuple[str, ...] = ("",)) -> str:
    """Return a study as text: one block a row, one line a measure, then the findings.

    Args:
        table: What ``study.json`` holds.
        measures: Those that are shown; all if empty.
        rows: How the names of those that are shown begin.
    """
    lines = []
    for row in (row for row in table["rows"] if row["name"].startswith(rows)):
        shown = [key for key in row["ours"] if not measures or key in measures]
        lines += [row["name"]] if shown else []
        for key in shown:
            value, known = row["ours"][key], row["published"].get(key)
            published = "" if known is None else f"   published {known:.4g}"
            lines.append(f"    {key:28s} {value['mean']:10.4g} +- {value['std']:<10.4g} n={value['seeds']}{published}")
    lines += [f"{'yes' if finding['reproduced'] else 'NO '}  {finding['finding']}" for finding in table["findings"]]
    return "\n".join(lines)


def format_three_digits(value: float | None) -> str:
    """Return a number with three significant digits and a true minus; thousands in full."""
    if value is None or value == 0.0:
        return number(value, 0)
    decimals = 0
    while decimals < 6 and abs(value) * 10.0**decimals < 99.95:
        decimals += 1
    return number(value, decimals)


def _groups(study: Study) -> Sequence[Group]:
    everything = dict.fromkeys(key for row in study.table["rows"] for key in row["ours"])
    return study.groups or [Group("Measures", "", {key: Measure("", "") for key in everything})]


def _rows_of(group: Group, study: Study) -> list[dict[str, Any]]:
    return [row for row in study.table["rows"] if row["name"].startswith(group.rows) and group.measures.keys() & row["ours"].keys()]
