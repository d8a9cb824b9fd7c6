"""Page of the restoring study: groups of measures, plots, and notes for the reader."""

from collections.abc import Mapping, Sequence
from typing import Any

from eval.pages.figures import RECORDED, SUITED, figure
from eval.study.framework.page import Group, Measure, Plot
from eval.study.restore.rows import CLEANING, FOLDER, SEVERITY, TRAINING, WALK, part_name
from eval.study.restore.suit_pairs import FOLDERS, MADE_UP, NUM_RECORDINGS

_ERRORS = {
    "truth_error_local": Measure("mm", "mean distance of the joints from the truth, roots aligned, before"),
    "restored_error": Measure("mm", "the same after the restoring network alone"),
    "constant": Measure("deg", "mean angle of the true constant misalignment of the 20 bodies"),
    "constant_error": Measure("deg", "mean angle between the estimated and the true one"),
    "within_two_std": Measure(
        "ratio", "share of these, by axis, within two of the standard deviations that the network claims; 0.95 if it is honest"
    ),
}
_CONTACTS = {
    "contact_accuracy": Measure("%", "frames and feet whose contact is the truth's"),
    "contact_commoner": Measure("%", "the same by always guessing the commoner"),
    "stance_skate_before": Measure("cm/s", "speed of standing feet as the suit has it"),
    "stance_skate_planted": Measure("cm/s", "the same after the network's contacts have planted the feet, before physics"),
    "stance_skate_truth": Measure("cm/s", "the truth's own"),
}
_HARM = {
    "recognised": Measure("%", "suits' recordings that the stage corrects"),
    "left_alone": Measure("%", "clean clips that the stage leaves as they are"),
    "harm": Measure("mm", "mean distance by which the stage moves clean clips"),
    "moved_if_clean": Measure("mm", "the same if none was left alone"),
}
_WALK = {
    "segment_error": Measure("deg", "mean error of the directions of pelvis, thighs, shins and feet"),
    "pelvis_error": Measure("deg", "of the axis from hip to hip"),
    "thigh_error": Measure("deg", ""),
    "shin_error": Measure("deg", ""),
    "foot_error": Measure("deg", "from above alone: Vicon's toe is a marker on the shoe"),
    "knee_error": Measure("deg", "of the knees' angles"),
    "walk_drift": Measure("ratio", "error of the root at the end over the distance walked, headings equal at the pelvis"),
    "walk_drift_turned": Measure("ratio", "the same, the path turned as a whole onto the truth"),
}
_CLEANING = {
    "truth_error_local": Measure("mm", "mean distance of the joints from the truth, roots aligned"),
    "truth_error_world": Measure("mm", "the same in the world"),
    "stance_skate": Measure("cm/s", "speed of standing feet"),
    "jitter": Measure("km/s³", "third difference of the joints' positions"),
    "physics": Measure("ratio", "share of the output that is the simulation's"),
    "restarts": Measure("1/min", "how often the simulation began again"),
}
_TRAININGS = {
    **{f"{source} restored_error": Measure("mm", f"of {source}") for source in (*FOLDERS, MADE_UP)},
    "contact_accuracy": Measure("%", "over all folders"),
    "moved_if_clean": Measure("mm", "by which clean clips would be moved"),
    "samples": Measure("windows", "that a training saw"),
    "minutes": Measure("min", "of one core that it took"),
}
GROUPS = (
    Group(
        "Restored poses",
        f"Simulated suits of the default severity, {NUM_RECORDINGS} recordings a clip; roots aligned.",
        _ERRORS | _CONTACTS,
        (FOLDER,),
    ),
    Group(
        "What is clean already",
        "Clips whose constant misalignments are small on average are taken for clean, and left as they are.",
        _HARM,
        (FOLDER,),
    ),
    Group("By severity", "One recording a clip of all folders.", _ERRORS | _CONTACTS, (SEVERITY,)),
    Group("The real walk", "Vicon's points are the truth of pelvis and legs (9.55 s, 7.7 m).", _WALK, (WALK,)),
    Group("Before and after the whole cleaning", "Suits' clips with Root3D's root, from BVH to BVH.", _CLEANING, (CLEANING,)),
    Group("Ingredients of the training", "Short trainings, each without one ingredient.", _TRAININGS, (TRAINING,)),
)
NOTES = (
    "Trained on cmu/train and made-up people, tested on performers whom no training saw: cmu/test has the skeletons of the training, "
    "bandai/test and pfnn have others. The truth is turned and moved along with what nobody can observe of a suit (align_drift).",
    "The package's network learnt longer, from more recordings, than the trainings of the last table, which compare with one another.",
)


def restore_plots(rows: Sequence[Mapping[str, Any]]) -> list[Plot]:
    """Return the plots: errors by kind of motion in each folder, and by severity."""
    ours = {row["name"]: row["ours"] for row in rows}
    plots = []
    for source in (*FOLDERS, MADE_UP):
        kinds = {name.rpartition(" ")[2]: value for name, value in ours.items() if name.startswith(f"{part_name(source)}, kind ")}
        plots.append(Plot("Restored poses", f"{source}, by kind of motion", _bars(kinds, "kind of motion")))
    severities = {name.removeprefix(f"{SEVERITY} "): value for name, value in ours.items() if name.startswith(SEVERITY)}
    return [*plots, Plot("By severity", "All folders", _bars(severities, "severity"))]


def _bars(groups: Mapping[str, Mapping[str, Any]], axis: str) -> dict[str, Any]:
    """Return bars of the distance from the truth before and after, by group."""
    sides = (("captured", "truth_error_local", SUITED), ("restored", "restored_error", RECORDED))
    traces = [
        {
            "type": "bar", "name": name, "x": [f"{name} " for name in groups], "y": [value[measure]["mean"] for value in groups.values()],
            "marker": {"color": colour},
        }
        for name, measure, colour in sides
    ]  # fmt: skip
    return figure(traces, axis, "distance from the truth [mm]", height=340, barmode="group")
