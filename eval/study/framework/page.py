"""Study results as an HTML page and as text: tables of measures, ours beside the published values, findings and plots."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from eval.pages.page import number, render_page

Summary = dict[str, float]  # mean, std, seeds
Row = dict[str, Any]  # of study.json: name, ours (by measure), published (by measure)


class Measure(NamedTuple):
    """Unit and description of a measure, as printed."""

    unit: str
    text: str


class Group(NamedTuple):
    """Table of measures that are read together, with the rows that have at least one of them.

    Attributes:
        heading: Heading of the table.
        reading: Sentence or two on how to read it.
        measures: Measures by id.
        rows: Prefixes of the names of its rows.
    """

    heading: str
    reading: str
    measures: Mapping[str, Measure]
    rows: tuple[str, ...] = ("",)


class Plot(NamedTuple):
    """Plot on the page of a study.

    Attributes:
        section: Heading under which the plot stands.
        title: Title of the plot.
        figure: Plotly figure as plain data; the page replaces the colour "text" by that of its text.
    """

    section: str
    title: str
    figure: dict[str, Any]


@dataclass(frozen=True)
class Study:
    """Results of a study.

    Attributes:
        table: Content of ``study.json``: study, rows and findings.
        groups: Tables of the page, the first of which the terminal shows too; one table of everything if empty.
        plots: Plots of the page.
        notes: Paragraphs that a reader must know.
    """

    table: dict[str, Any]
    groups: Sequence[Group] = ()
    plots: Sequence[Plot] = ()
    notes: Sequence[str] = field(default=())


def study_row(name: str, seeds: Sequence[Mapping[str, float]], published: Mapping[str, float] | None = None) -> Row:
    """Return a row of ``study.json``: the summary over seeds, or whatever else is repeated, beside the published values."""
    return {"name": name, "ours": summarise_seeds(seeds), "published": published or {}}


def summarise_seeds(seeds: Sequence[Mapping[str, float]]) -> dict[str, Summary]:
    """Return the mean and standard deviation over seeds of each measure that all seeds have."""
    shared = [key for key in seeds[0] if all(key in one for one in seeds)]
    return {key: mean_and_std([one[key] for one in seeds]) for key in shared}


def mean_and_std(values: Sequence[float]) -> Summary:
    """Return the mean, the standard deviation and the number of values."""
    mean = sum(values) / len(values)
    return {"mean": float(mean), "std": float((sum((x - mean) ** 2 for x in values) / len(values)) ** 0.5), "seeds": len(values)}


def study_page(study: Study) -> str:
    """Return the page of a study as HTML."""
    sections: dict[str, list[Plot]] = {}
    for plot in study.plots:
        sections.setdefault(plot.section, []).append(plot)
    return render_page(
        "study/framework/study.html.j2",
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
        table: Content of ``study.json``.
        measures: Measures to show; all if empty.
        rows: Prefixes of the names of the rows to show.
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
