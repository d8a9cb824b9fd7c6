"""Page of the cleaning study: groups of measures, plots, and notes for the reader."""

from collections.abc import Mapping, Sequence
from typing import Any

from eval.metrics.artefacts import REMOVABLE
from eval.metrics.catalogue import ARTEFACT_CATALOGUE
from eval.pages.figures import GREY, RECORDED, SUITED, figure
from eval.study.clean.cases import BEFORE, CLEAN, REAL, SOURCES, SUITS, TRUTH, Case, CaseResult
from eval.study.clean.findings import COMPARED_MEASURES
from eval.study.clean.rows import ALL, NO_PHYSICS, NO_RESTORING, PRETRAINED, REMOVED, kind_part, row_name
from eval.study.framework.page import Group, Measure, Plot

COLOURS = {BEFORE: SUITED, NO_PHYSICS: GREY, NO_RESTORING: "#4aa5a0", PRETRAINED: RECORDED, TRUTH: "#6b9e5b"}
OTHERS = ("#9a7fb8", "#d9541f", "#d9a51f")  # of further policies
_MEASURES = {name: Measure(metric.unit, metric.text) for name, metric in ARTEFACT_CATALOGUE.items()} | {
    "support_slide": Measure("cm/s", "horizontal speed of the slower foot's lowest point, whatever its height"),
    "physics": Measure("ratio", "share of the output that is the simulation's, by how far it is trusted in each frame"),
    "restarts": Measure("1/min", "how often the simulation began again from the reference"),
    "ground_level": Measure("mm", "height at which the reading found the ground in the file; there the output stands"),
    "seconds": Measure("s", "duration of a clip"),
}


def _of(*names: str) -> dict[str, Measure]:
    return {name: _MEASURES[name] for name in names}


_MAIN = _of(
    "foot_skate", "stance_skate", "support_slide", "floating", "ground_penetration", "self_penetration", "jitter", "imbalance",
    "deviation_local", "truth_error_local", "contact_agreement", "touchdown_error", "physics", "restarts",
)  # fmt: skip
_REST = _of(
    "skating_ratio", "self_penetration_depth", "deviation_world", "truth_error_world", "ground_level", "seconds",
)  # fmt: skip
_WITH_TRUTH = ("truth_error_local", "contact_agreement", "touchdown_error")
_WITHOUT_TRUTH = {name: measure for name, measure in _MAIN.items() if name not in _WITH_TRUTH}
_REMOVED = {name: Measure("ratio", f"share of the excess over the truth that was removed: {_MEASURES[name].text}") for name in REMOVABLE}
GROUPS = (
    Group(
        "Simulated suits, all clips",
        "Unseen performers through a simulated suit of the default severity, each clip once; its root is Root3D's. Before is what the suit "
        "delivers, on the true ground. Reading its file calibrates soles and ground already, which trades floating for penetration where "
        "the root drifts up and down: as read is what the cleaning proper begins with. After is on the ground that the reading found.",
        _MAIN,
        (f"{SUITS}, {ALL}",),
    ),
    Group(
        "Simulated suits, what was removed",
        "(before - after) / (before - truth) of the means: 1 is as clean as the truth. Empty where before is within a tenth of it.",
        _REMOVED,
        (REMOVED,),
    ),
    Group("Simulated suits, by folder", "The same.", _MAIN, tuple(f"{SUITS}, {source}" for source in SOURCES)),
    Group("Simulated suits, by kind of motion", "The same.", _MAIN, (f"{SUITS}, {kind_part('')}",)),
    Group(
        "Real suits",
        "In no training; no truth is known. A foot is in contact by its own height, and stands where it does before.",
        _WITHOUT_TRUTH,
        (REAL,),
    ),
    Group(
        "Already clean clips", "The same performers as recorded: what there is to lose.", _of("deviation_local") | _WITHOUT_TRUTH, (CLEAN,)
    ),
    Group("All clips, what else there is", "Of all groups.", _REST, tuple(f"{group}, {ALL}" for group in (SUITS, REAL, CLEAN))),
)


def clean_notes(cases: Sequence[Case], results: Sequence[CaseResult], seen: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """Return the notes for the reader.

    Args:
        cases: Clips of the study.
        results: Results of the package's cleaning, one of each clip.
        seen: Tested performers whom the training of a policy saw, by policy.
    """
    told = [
        f"{result.name} ({case.group}): {' '.join(result.notices)}" for case, result in zip(cases, results, strict=True) if result.notices
    ]
    trained = [f"{policy} has learnt from {', '.join(performers)}" for policy, performers in seen.items() if performers]
    return (
        "Every clip goes the whole way of a user's: a BVH file is read, cleaned and written, and the written file is read again through "
        "the first one's calibration and ground. A simulated suit's clip is a BVH on the 20 bodies' own skeleton. Means over clips, each "
        "counting once, ± their standard deviation.",
        "The clean truth is carried along with the slow drift of the suit's root and heading, which nobody can observe. Its contacts and "
        "flights are used on all sides, so that a foot that floats where it should stand counts.",
        f"'{NO_RESTORING}' leaves the poses of suits as they were captured. '{NO_PHYSICS}' is the same cleaning without the simulation: "
        "jitter, ground and limbs repaired, feet locked where they seem to stand. What the simulation adds is the difference. Other "
        "policies are those in DIR/policies.",
        "A finding counts as reproduced where the aim is reached. foot_skate takes a foot under 2 cm for a standing one at any speed: what "
        "the clean truth has of it is swinging feet, which no cleaning should stop. stance_skate, ours, leaves them out.",
        f"Performers of the test clips in a training: {'; '.join(trained) or 'none'}.",
        f"Left to itself in part, or given a root: {' | '.join(told) or 'no clip'}.",
    )


def clean_plots(rows: Sequence[Mapping[str, Any]], variants: Sequence[str]) -> list[Plot]:
    """Return bars of all sides by kind of motion, for each compared measure.

    Args:
        rows: Rows of the study.
        variants: Variants of the cleaning.
    """
    ours = {row["name"]: row["ours"] for row in rows}
    begin, end = f"{SUITS}, {kind_part('')}", f": {BEFORE}"
    kinds = [name.removeprefix(begin).removesuffix(end) for name in ours if name.startswith(begin) and name.endswith(end)]
    spare = iter(OTHERS)
    colours = {
        side: COLOURS.get(side) or next(spare, GREY) for side in (BEFORE, *(v for v in variants if v != PRETRAINED), PRETRAINED, TRUTH)
    }
    section, plots = "By kind of motion, through simulated suits", []
    for measure in COMPARED_MEASURES:
        traces = [
            {
                "type": "bar", "name": side, "x": kinds, "marker": {"color": colour},
                "y": [ours[row_name(SUITS, kind_part(kind), side)].get(measure, {"mean": None})["mean"] for kind in kinds],
            }
            for side, colour in colours.items()
        ]  # fmt: skip
        shown = [trace for trace in traces if any(value is not None for value in trace["y"])]
        plots.append(Plot(section, measure, figure(shown, "", f"[{_MEASURES[measure].unit}]", height=320)))
    return plots
