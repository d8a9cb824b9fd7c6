"""Page of the LoBSTr study: groups of measures, and notes for the reader."""

from collections import Counter
from collections.abc import Mapping, Sequence

from datasets.trackers.trackers import TRACKER_RATE_HZ
from eval.study.framework.page import Group, Measure
from eval.study.lobstr.evaluation_sessions import WEARINGS_PER_USER, EvaluationClip
from eval.study.lobstr.six_point_baseline import FROZEN_SHARE, HIDDEN_DURATION_S, HIDDEN_PER_MINUTE, IMPACT_STD_M, JUMP_DISTANCE_M
from eval.study.lobstr.variants import CATEGORIES, MAJORITY_CLASS, MEAN_POSE, PRETRAINED, TRUTH, USER_HEIGHTS_CM, VARIANTS
from trainers.supervised.lobstr_data import LobstrData

PERFECT_ROWS = (*(variant.name for variant in VARIANTS), MAJORITY_CLASS, MEAN_POSE, TRUTH, PRETRAINED)
USER_ROWS = tuple(f"{height} cm" for height in USER_HEIGHTS_CM)
_PERFECT = {
    "contact_accuracy": Measure("%", "of the labels of both toe-bases"),
    "rotational_error": Measure(
        "deg", "mean angle between predicted and true rotation, over eight joints of which two are rigid on CMU's skeleton"
    ),
    "rotational_error_moving": Measure("deg", "the same over the six that move"),
    "toe_position_error": Measure("cm", "mean distance from the true toe-base, in the pelvis' frame"),
    "toe_velocity_error": Measure("cm/s", "mean length of the difference of velocities, in the pelvis' frame (figure 3)"),
    "toe_distance_error": Measure("cm", "by how much the distance from toe-base to toe-base is wrong, as in Table 3"),
    "body_movement": Measure("deg", "mean over frames of the sum over joints of how much each turned (figure 6); the truth's is a row too"),
}
_CATEGORIES = {
    "walk": "walks and turns", "run": "runs", "sit_stand": "made-up people who sit down and squat: no recorded test clip does",
    "carry": "no clip", "static": "gestures on the spot", "free": "jumps and salsas", "total": "all recorded clips",
}  # fmt: skip
GROUPS = (
    Group("Tables 1 and 2: perfect trackers", "All recorded test clips, in windows of a second as in the paper.", _PERFECT, PERFECT_ROWS),
    Group(
        "The recurrent state carried through whole clips",
        "The same, but that a recurrent network's state is begun once a clip, as it is live, rather than anew for each window.",
        {f"{name}_carried": measure for name, measure in _PERFECT.items()},
        PERFECT_ROWS,
    ),
    Group(
        "The autoregressive network (4.1.1)",
        "Above it gets its own poses back, beginning with the true one of each clip. Here it is told the true pose before, as in training; "
        "and it runs on and on through all clips, one after the other, for ten minutes.",
        {
            "exploded": Measure("ratio", "share of seeds in which a number of the pose, of true ones at most 1, comes over 2"),
            "frames_until_explosion": Measure("frames", "until then, or all that were tried"),
            **{f"{name}_told": measure for name, measure in _PERFECT.items()},
        },
        PERFECT_ROWS,
    ),
    Group(
        "By folder",
        "cmu/test is long and varied, bandai/test are short walks, runs and gestures.",
        {
            f"{name}_{source}": Measure(_PERFECT[name].unit, "")
            for source in ("cmu", "bandai")
            for name in ("contact_accuracy", "rotational_error", "toe_position_error")
        },
        PERFECT_ROWS,
    ),
    Group(
        "Table 3: toe-base distance error of virtual users",
        "Trackers displaced and tilted as people wear them, after a T-pose; rotations compensated and sizes scaled, as in the paper, or "
        "places compensated too.",
        {f"toe_distance_{category}": Measure("cm", _CATEGORIES[category]) for category in CATEGORIES},
        USER_ROWS,
    ),
    Group(
        "Virtual users: figure 6 and the rest",
        "The same sessions, recorded clips alone.",
        {
            "body_movement": _PERFECT["body_movement"],
            "toe_position_error": Measure("cm", "at the user's size, as the other lengths of users"),
            "toe_position_error_hidden": Measure("cm", "of a foot while it is hidden from six-point tracking"),
            "hidden_share": Measure("%", "of frames and feet, that they are hidden"),
            "toe_position_growth": Measure("cm", "by how much toe_position_error is more than with perfect trackers at that size"),
            "contact_accuracy": _PERFECT["contact_accuracy"],
            "rotational_error": _PERFECT["rotational_error"],
            "toe_velocity_error": Measure("cm/s", "at the standard size"),
            "toe_distance_bias": Measure("cm", "by how much toe-bases are too far apart in the mean"),
        },
        USER_ROWS,
    ),
    Group("Trainings", "How long each learnt.", {
        "samples": Measure("frames", "that were predicted in training, the same for all rows but the shipped one"),
        "minutes": Measure("min", "of one core that it took, evaluation on the held-out performer included"),
    }),
)  # fmt: skip


def lobstr_notes(samples: int, motion: LobstrData, clips: Sequence[EvaluationClip]) -> tuple[str, ...]:
    """Return the notes for the reader.

    Args:
        samples: Predicted frames of each training.
        motion: Motion that all trainings share.
        clips: Test clips.
    """
    trained = sum(clip.frames for clip in motion.training.clips) / TRACKER_RATE_HZ / 60.0
    kinds: dict[str, Counter[str]] = {}
    for clip in clips:
        kinds.setdefault(clip.category, Counter())[clip.motion.kind] += 1
    listed = "; ".join(f"{category}: {_counted(kinds.get(category, {}))}" for category in CATEGORIES[:-1])
    return (
        f"Every training predicts {samples:,} frames, whatever its row, from {trained:.0f} minutes of cmu/train as recorded; seeds differ "
        "in the network and the order of pieces, not in data. The paper trained for 1,500 epochs, which it does not define, on an hour of "
        "its own: its numbers beside ours are a mark, and what can be repeated is the order of the rows. The shipped network has learnt "
        "for longer, from more motion, with weights of the losses, noise and worn trackers of its own.",
        "The paper's settings but one: a batch is 64 pieces of two seconds that give 46 predictions each, all with a second and up to "
        "two behind them, where the paper has 256 windows of a second with one prediction each. So a GRU learns several times as much "
        "from a minute of computing, and its state is used to being carried for longer than a second. It is the same for all rows. "
        "'GRU, upright' departs from the paper further: it tells thighs against the upright reference frame. How a pelvis is tilted "
        "differs between performers and recordings, and no input tells of it: the other rows' errors of joints and of toe-bases' places "
        "hold that difference, while contacts, distances of toe-bases and body movement do not.",
        f"{motion.held_out} is held out of training and selects which state of a network is kept, by the network's own loss. Tests are "
        "clips on level ground of performers whom no training saw, cmu/test and bandai/test, at 45 Hz. Our humanoid has no hip joints, "
        "which are rigid on CMU's skeleton: they are predicted and counted as in the paper, and the six joints that move by themselves.",
        f"Virtual users perform the same clips: {', '.join(map(str, USER_HEIGHTS_CM))} cm tall, "
        f"each of whom puts the trackers on {WEARINGS_PER_USER} "
        "times, displaced and tilted anew, takes a T-pose by eye for a second, and is measured with the 2 mm of noise that the paper "
        "names. The networks' states are carried through each clip, as live. The proportions of all users are the humanoid's. The paper "
        "has real users, and its errors of 0.03 or 0.2 cm can hardly be means of absolute differences, as ours are: toe_distance_bias, "
        "in which differences cancel, is beside them.",
        f"Categories of Table 3 by the clips' kinds: {listed}. The total is over recorded clips, without the made-up people.",
        "Six-point tracking has two trackers more, on the feet, perfectly worn and calibrated; the pelvis is where the calibrated "
        f"trackers say, legs by inverse kinematics. Where feet get lost, each is hidden {HIDDEN_PER_MINUTE:g} times a minute for "
        f"{HIDDEN_DURATION_S[0]:g} to {HIDDEN_DURATION_S[1]:g} s, and its tracker then stays where it was ({FROZEN_SHARE:.0%}) or jumps by "
        f"{JUMP_DISTANCE_M[0]:g} to {JUMP_DISTANCE_M[1]:g} m; each strike on the ground shakes it by {100.0 * IMPACT_STD_M:g} cm "
        "(standard deviation along each axis) "
        "for a moment. These are assumptions: the paper shows pictures and no numbers.",
        "A finding counts as reproduced where two rows are further apart than their two standard deviations over seeds together, decided "
        "before any row was known; one that two rows are alike, where they are not. What is closer is undecided.",
    )


def _counted(kinds: Mapping[str, int]) -> str:
    return ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items())) or "none"
