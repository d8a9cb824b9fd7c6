"""The lower-body network in the package on the LoBSTr study's test clips and sessions: ``python -m eval.study.lobstr.shipped``."""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from agents.lobstr.spec import WINDOW_FRAMES
from agents.lower_body.clip_prediction import predict_clips
from agents.lower_body.model import LowerBodyModel
from agents.lower_body.pose import joint_poses
from agents.weights.pretrained import PRETRAINED_LOWER_BODY
from configs.exit_codes import run_command
from datasets.motion.rotation_matrices import quaternions_to_matrices
from datasets.trackers.joint_features import JointPoses
from datasets.trackers.trackers import (
    ALL_TRACKER_NAMES,
    FOOT_TRACKERS,
    SHIN_TRACKERS,
    TRACKER_NAMES,
    TrackerPoses,
)
from eval.study.lobstr.evaluation_sessions import EvaluationClip, Session, load_unseen_clips, simulate_sessions
from eval.study.lobstr.scores import PredictedLegs, Scores, score_clips, score_sessions, weighted_mean
from eval.study.lobstr.variants import USER_HEIGHTS_CM

USUAL = tuple(range(len(TRACKER_NAMES)))
# Trackers with a position and trackers with a rotation of each set but the usual one
TRACKER_SETS = {
    "no pelvis tracker": ((0, 1, 2), (0, 1, 2)),
    "feet tracked": ((*USUAL, *FOOT_TRACKERS), (*USUAL, *FOOT_TRACKERS)),
    "knees tracked": ((*USUAL, *SHIN_TRACKERS), (*USUAL, *SHIN_TRACKERS)),
    "feet and knees tracked": (tuple(range(len(ALL_TRACKER_NAMES))),) * 2,
    "IMUs on the shins": (USUAL, (*USUAL, *SHIN_TRACKERS)),
    "IMUs on shins and feet": (USUAL, tuple(range(len(ALL_TRACKER_NAMES)))),
    "feet tracked, pelvis not": ((0, 1, 2, *FOOT_TRACKERS),) * 2,
}
WORN_SETS = ("feet tracked", "knees tracked")  # of users of the middle height, beside the usual set
MIDDLE_HEIGHT_CM = sorted(USER_HEIGHTS_CM)[len(USER_HEIGHTS_CM) // 2]
NAME_WIDTH = 62  # characters of a row's name
CALM = ("walk", "static")  # categories of walks, turns and standing, for which marks are stricter
MEASURES = {"contact_accuracy": "contacts [%]", "rotational_error": "rotation [deg]", "toe_position_error": "toe-bases [cm]"}


def predict_shipped(model: LowerBodyModel, joints: Sequence[TrackerPoses]) -> list[PredictedLegs]:
    """Return the prediction of the network for each clip, its state carried, in all frames that have a second behind them.

    Args:
        model: Trained network.
        joints: Poses of the four joints in each clip from its first frame on, (T, 4, ...).
    """
    return _predict(model, [_tracked(one, USUAL, USUAL) for one in joints])


def evaluate_shipped(model: LowerBodyModel, clips: Sequence[EvaluationClip]) -> Scores:
    """Return all measures with perfect trackers, the state carried through clips: the network is never used in windows."""
    return score_clips(clips, predict_shipped(model, [clip.joints for clip in clips]))


def shipped_rows(model: LowerBodyModel, data: Path) -> Iterator[tuple[str, Scores]]:
    """Yield names and measures of the rows: kinds of motion, users of each height, and other sets of trackers.

    Args:
        model: Trained network.
        data: Folder of real motion.
    """
    clips = load_unseen_clips(data)
    for name, (seen, oriented) in {"": (USUAL, USUAL), **TRACKER_SETS}.items():
        predicted = _predict(model, [_tracked(clip.every_joint, seen, oriented) for clip in clips])
        kinds = sorted({clip.motion.kind for clip in clips if clip.is_recorded}) if not name else []
        for group, chosen in _groups(clips, kinds):
            row = f"{group}, {name}" if name else group
            yield row, score_clips([clips[one] for one in chosen], [predicted[one] for one in chosen])
    recorded = [clip for clip in clips if clip.is_recorded]
    for height in USER_HEIGHTS_CM:
        yield from _worn_rows(model, recorded, height, "")
    for name in WORN_SETS:
        yield from _worn_rows(model, recorded, MIDDLE_HEIGHT_CM, name)


def _worn_rows(model: LowerBodyModel, clips: Sequence[EvaluationClip], height: int, name: str) -> Iterator[tuple[str, Scores]]:
    """Yield names and measures of users of a height who wear the set of trackers ``name``, the usual one if empty."""
    sessions = simulate_sessions(clips, [height], legs=bool(name))
    seen, oriented = TRACKER_SETS[name] if name else (USUAL, USUAL)
    legs = _predict(model, [_tracked(one.joints(compensate_positions=True), seen, oriented) for one in sessions])
    for group, chosen in _groups([one.clip for one in sessions], []):
        row = f"{group}, {height} cm, worn trackers" + (f", {name}" if name else "")
        yield row, _score_worn([sessions[one] for one in chosen], [legs[one] for one in chosen])


def _groups(clips: Sequence[EvaluationClip], kinds: Sequence[str]) -> Iterator[tuple[str, list[int]]]:
    """Yield names and members of groups of recorded clips: all, calm ones, and those of each of ``kinds``."""
    recorded = [index for index, clip in enumerate(clips) if clip.is_recorded]
    yield "all", recorded
    yield "walks, turns, standing", [index for index in recorded if clips[index].category in CALM]
    for kind in kinds:
        yield kind, [index for index in recorded if clips[index].motion.kind == kind]


def _score_worn(sessions: Sequence[Session], predicted: Sequence[PredictedLegs]) -> Scores:
    """Return the measures of sessions, toe-bases at the user's size; no foot has a tracker that is hidden."""
    hidden = [np.zeros((len(one.legs), 2), dtype=bool) for one in predicted]
    return weighted_mean(
        [(len(one.legs), score_sessions([session], [one], [mask])) for session, one, mask in zip(sessions, predicted, hidden, strict=True)]
    )


def _predict(model: LowerBodyModel, joints: Sequence[JointPoses]) -> list[PredictedLegs]:
    return [PredictedLegs(pose.legs[WINDOW_FRAMES:], pose.contacts[WINDOW_FRAMES:]) for pose in predict_clips(model, joints)]


def _tracked(joints: TrackerPoses, seen: Sequence[int], oriented: Sequence[int]) -> JointPoses:
    """Return joints of which trackers tell the position of those ``seen`` and the rotation of those ``oriented``."""
    masks = np.zeros((2, *joints.positions.shape[:2]), dtype=bool)
    masks[0, :, list(seen)] = masks[1, :, list(oriented)] = True
    return joint_poses(joints, quaternions_to_matrices(joints.rotations), masks[0], masks[1])


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    made = argparse.ArgumentParser("python -m eval.study.lobstr.shipped", description="Test the lower-body network on unseen performers.")
    made.add_argument("--data", type=Path, required=True, help="folder of real motion")
    made.add_argument("--model", type=Path, default=PRETRAINED_LOWER_BODY, help="another network than the package's")
    options = made.parse_args(arguments)

    def run() -> None:
        print(f"{'':{NAME_WIDTH}}" + "".join(f"{title:>16}" for title in MEASURES.values()))
        for name, scores in shipped_rows(LowerBodyModel.load(options.model)[0], options.data):
            print(f"{name:{NAME_WIDTH}}" + "".join(f"{scores[measure]:16.2f}" for measure in MEASURES), flush=True)

    return run_command(run)


if __name__ == "__main__":
    sys.exit(main())
