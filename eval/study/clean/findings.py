"""Aims of cleaning, each beside the numbers of the study's rows that decide whether it is reached."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from eval.metrics.catalogue import ARTEFACT_CATALOGUE
from eval.study.clean.cases import BEFORE, CLEAN, REAL, SUITS, TRUTH
from eval.study.clean.rows import ALL, NO_PHYSICS, PRETRAINED, REMOVED, row_name

MIN_REMOVED = {"stance_skate": 0.8, "floating": 0.9, "ground_penetration": 0.9, "self_penetration": 0.9}  # of the excess over the truth
MAX_JITTER_RATIO = 1.3  # to that of the clean truth
MAX_ERROR_RATIO = 0.72  # of the distance to the truth, to that before
MIN_CONTACT_AGREEMENT = 0.93
MIN_PHYSICS, MAX_RESTARTS = 0.7, 1.0  # share of the output; 1/min
MAX_DEVIATION_MM = 40.0  # of clips that are clean already
FLOATING_CLIP, MAX_FLOATING_MM = "rokoko_jesse_dance", 5.0  # the clip that floats, and the metric's threshold of floating
COMPARED_MEASURES = (
    "foot_skate", "stance_skate", "support_slide", "floating", "ground_penetration", "self_penetration", "jitter", "truth_error_local",
)  # fmt: skip
Ours = Mapping[str, Mapping[str, Any]]
Finding = dict[str, Any]
Claims = Iterator[tuple[str, bool]]


def clean_findings(rows: Sequence[Mapping[str, Any]], variants: Sequence[str]) -> list[Finding]:
    """Return each aim, with the numbers that decide whether it is reached, for every policy; then the package's policy beside the others.

    Args:
        rows: Rows of the study.
        variants: Variants of the cleaning, the package's own first.
    """
    ours = {row["name"]: row["ours"] for row in rows}
    found = [f for variant in variants if variant != NO_PHYSICS for f in _aims(ours, variant)]
    found += [f for variant in variants if variant != PRETRAINED for f in _beside(ours, variant)]
    return [{"finding": text, "reproduced": reached} for text, reached in found]


def _aims(ours: Ours, variant: str) -> Claims:
    before, after, truth = (_means(ours, SUITS, ALL, side) for side in (BEFORE, variant, TRUTH))
    removed = {name: value["mean"] for name, value in ours[row_name(REMOVED, ALL, variant)].items()}
    for name, share in MIN_REMOVED.items():
        if name in removed:
            own = f"the clean truth has {_text(name, truth)}"
            text = f"{_change(name, before, after)}; {own}: {removed[name]:.2f} of the excess removed; aim: at least {share:g}"
            yield f"{variant}, {SUITS}: {text}", removed[name] >= share
    times = after["jitter"] / truth["jitter"]
    text = f"{_change('jitter', before, after)}, {times:.2f} times the clean truth's; aim: at most {MAX_JITTER_RATIO} times"
    yield f"{variant}, {SUITS}: {text}", times <= MAX_JITTER_RATIO
    error = "truth_error_local"
    text = f"{_change(error, before, after)}; aim: at most {MAX_ERROR_RATIO} of before"
    yield f"{variant}, {SUITS}: {text}", after[error] <= MAX_ERROR_RATIO * before[error]
    for name, aim, reached in (
        ("contact_agreement", f"at least {MIN_CONTACT_AGREEMENT}", after["contact_agreement"] >= MIN_CONTACT_AGREEMENT),
        ("physics", f"at least {MIN_PHYSICS}", after["physics"] >= MIN_PHYSICS),
        ("restarts", f"at most {MAX_RESTARTS:g} a minute", after["restarts"] <= MAX_RESTARTS),
    ):
        yield f"{variant}, {SUITS}: {name} {after[name]:.2f}; aim: {aim}", reached
    before, after = (_means(ours, REAL, FLOATING_CLIP, side) for side in (BEFORE, variant))
    yield (
        f"{variant}, {FLOATING_CLIP}: {_change('floating', before, after)}; aim: at most {MAX_FLOATING_MM:g} mm",
        after["floating"] <= MAX_FLOATING_MM,
    )
    moved = _means(ours, CLEAN, ALL, variant)["deviation_local"]
    yield (
        f"{variant}, {CLEAN}: moved by {_text('deviation_local', {'deviation_local': moved})}; aim: under {MAX_DEVIATION_MM:g} mm",
        moved < MAX_DEVIATION_MM,
    )


def _beside(ours: Ours, other: str) -> Claims:
    one, two = (_means(ours, SUITS, ALL, side) for side in (PRETRAINED, other))
    for name in COMPARED_MEASURES:
        yield (
            f"{SUITS}: {name} less with the {PRETRAINED}, {_text(name, one)}, than with {other}, {_text(name, two)}",
            one[name] < two[name],
        )


def _means(ours: Ours, group: str, part: str, side: str) -> dict[str, float]:
    return {name: value["mean"] for name, value in ours[row_name(group, part, side)].items()}


def _change(name: str, before: Mapping[str, float], after: Mapping[str, float]) -> str:
    """Return the change of a measure as text, such as "jitter 0.20 km/s³ after 0.40 before, -50 %"."""
    old, new = before[name], after[name]
    percent = f"{100.0 * (new - old) / old:+.0f} %" if old else "nothing to remove"
    return f"{name} {_text(name, after)} after {_text(name, before)} before, {percent}"


def _text(name: str, values: Mapping[str, float]) -> str:
    metric = ARTEFACT_CATALOGUE.get(name)
    return f"{values[name]:.3g} {metric.unit if metric else 'cm/s'}"
