"""Evaluation of the lower-body network in the package on the test clips and sessions of the LoBSTr study."""

from collections.abc import Sequence

import numpy as np

from agents.lobstr.spec import WINDOW_FRAMES
from agents.lower_body.clip_prediction import predict_clips
from agents.lower_body.model import LowerBodyModel
from agents.lower_body.pose import joint_poses
from datasets.motion.rotation_matrices import quaternions_to_matrices
from datasets.trackers.trackers import TrackerPoses
from eval.study.lobstr.evaluation_sessions import EvaluationClip
from eval.study.lobstr.scores import PredictedLegs, Scores, score_clips


def predict_shipped(model: LowerBodyModel, joints: Sequence[TrackerPoses]) -> list[PredictedLegs]:
    """Return the prediction of the network for each clip, its state carried, in all frames that have a second behind them.

    Args:
        model: Trained network.
        joints: Poses of the four joints in each clip from its first frame on, (T, 4, ...).
    """
    clips = [joint_poses(one, quaternions_to_matrices(one.rotations), np.ones(one.positions.shape[:2], dtype=bool)) for one in joints]
    return [PredictedLegs(pose.legs[WINDOW_FRAMES:], pose.contacts[WINDOW_FRAMES:]) for pose in predict_clips(model, clips)]


def evaluate_shipped(model: LowerBodyModel, clips: Sequence[EvaluationClip]) -> Scores:
    """Return all measures with perfect trackers, the state carried through clips: the network is never used in windows."""
    return score_clips(clips, predict_shipped(model, [clip.joints for clip in clips]))
