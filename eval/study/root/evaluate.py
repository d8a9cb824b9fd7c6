"""Evaluation of root models, and of baselines without training, on the test takes and the real walk."""

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from agents.root.model import RootModel
from agents.root.path import FULL_ORDER, predict_root_path
from agents.root.reconstruct import filter_path
from agents.weights.pretrained import WEIGHTS_FOLDER, load_pretrained_restore
from datasets.imu.root_features import root_frames
from eval.clean.restored_poses import restore_clip
from eval.evaluation_recordings import IMU_POSES, OPTICAL_POSES, RESTORED_POSES
from eval.metrics.root_path import distance_ratio, drift, e_mse, stationary_path
from eval.study.root.evaluation_takes import EvaluationTake, TakesByPose
from eval.study.root.scores import Paths, Scores, score, trajectory_errors
from eval.study.root.variants import MOTIONLESS, OWN_ROOT, WALK_CONTACTS, WALK_OWN_ROOT
from eval.study.suit.vicon_walk import RealWalk, align_heading, track_root_by_contacts

FILTERED_MEASURES = (  # measured after the filters as well
    *("e_mse", "e_mse_median", "e_mse_turned", "e_mse_stretched", "e_mse_walks"),
    *("drift", "distance_ratio", "stairs_error", "stairs_ratio"),
)


class ModelEvaluation(NamedTuple):
    """Test results of one model.

    Attributes:
        poses: Kind of poses that the model was tested on.
        scores: All measures.
        paths: Predicted paths of the takes with these poses.
    """

    poses: str
    scores: Scores
    paths: Paths


def evaluate_model(model: RootModel, poses: str, takes: TakesByPose, walk: RealWalk) -> ModelEvaluation:
    """Return all test results of a model.

    Args:
        model: Trained model.
        poses: Kind of poses to test on; with those of suits Root3D is tested on the real walk as well, restored or not.
        takes: All test takes.
        walk: Real walk.
    """
    tested = takes[poses]
    paths = predict_paths(model, tested)
    found = score(tested, paths, model.spec.vertical == "height")
    if not model.spec.is_planar:
        found |= _filtered(model, tested, paths)
        if model.spec.accelerations and model.spec.predicts_steps_ahead:
            found |= _orders(model, tested)
        if poses != OPTICAL_POSES:
            found |= _walk_of(model, restored_walk(walk) if poses == RESTORED_POSES else walk)
        return ModelEvaluation(poses, found, paths)
    found = {name: value for name, value in found.items() if not name.startswith("stairs_")}  # planar models know level ground alone
    if poses == OPTICAL_POSES:
        found["e_mse_on_imu_poses"] = float(trajectory_errors(takes[IMU_POSES], predict_paths(model, takes[IMU_POSES])).mean())
    return ModelEvaluation(poses, found, paths)


def predict_paths(model: RootModel, takes: Iterable[EvaluationTake], order: int = FULL_ORDER) -> list[np.ndarray]:
    """Return the path (N, 3) [m] that a model predicts for each take; all begin where the truth begins."""
    return [predict_root_path(model, take.frames, take.truth.root_position[0], order) for take in takes]


def evaluate_baselines(takes: TakesByPose, walk: RealWalk) -> dict[str, ModelEvaluation]:
    """Return the results of a root that never moves, of the simulated suit's own root, and of the models in the package."""
    still = [stationary_path(take.truth.root_position) for take in takes[OPTICAL_POSES]]
    own = [take.observed.root_position for take in takes[IMU_POSES]]
    found = {
        MOTIONLESS: ModelEvaluation(OPTICAL_POSES, score(takes[OPTICAL_POSES], still, False), still),
        OWN_ROOT: ModelEvaluation(IMU_POSES, score(takes[IMU_POSES], own, False), own),
    }
    shipped = {"planar": "planar model, {} poses", "root3d": "Root3D, {} poses and accelerations", "root3d_pose": "Root3D, {} poses alone"}
    for file, name in shipped.items():
        model, card = RootModel.load(WEIGHTS_FOLDER / f"{file}.safetensors")
        for poses, in_words in ((OPTICAL_POSES, "optical"), (IMU_POSES, "IMU"), (RESTORED_POSES, "restored IMU")):
            one = evaluate_model(model, poses, takes, walk)
            one.scores.update(samples=float(card["windows"]), minutes=60.0 * card["hours"])
            found["as shipped: " + name.format(in_words)] = one
    return found


def evaluate_walk_baselines(walk: RealWalk) -> dict[str, Scores]:
    """Return the measures of the real walk for baselines without a model."""
    return {
        "the real walk, motionless": score_walk(stationary_path(walk.truth), walk.truth),
        WALK_OWN_ROOT: score_walk(walk.motion.root_position, walk.truth),
        WALK_CONTACTS: score_walk(track_root_by_contacts(walk), walk.truth),
    }


def score_walk(path: np.ndarray, truth: np.ndarray, suffix: str = "") -> Scores:
    """Return drift, e_mse and distance ratio of a path of the real walk, with headings equal at the pelvis and turned onto the truth."""
    turned = align_heading(path, truth)
    return {
        f"walk_drift{suffix}": drift(path, truth),
        f"walk_drift_turned{suffix}": drift(turned, truth),
        f"walk_e_mse{suffix}": e_mse(path, truth),
        f"walk_e_mse_turned{suffix}": e_mse(turned, truth),
        f"walk_distance_ratio{suffix}": distance_ratio(path, truth, 100.0),
    }


def restored_walk(walk: RealWalk) -> RealWalk:
    """Return the real walk with its poses restored, as cleaning does before all else."""
    return replace(walk, motion=restore_clip(load_pretrained_restore(), walk.motion).motion)


def _walk_of(model: RootModel, walk: RealWalk) -> Scores:
    frames = root_frames(walk.motion, walk.accelerations)
    path = predict_root_path(model, frames, walk.truth[0])
    held = filter_path(model.spec, path, walk.motion, frames if model.spec.accelerations else None)
    return score_walk(path, walk.truth) | score_walk(held, walk.truth, "_filtered")


def _filtered(model: RootModel, takes: list[EvaluationTake], paths: Paths) -> Scores:
    held = [
        filter_path(model.spec, path, take.observed, take.frames if model.spec.accelerations else None)
        for take, path in zip(takes, paths, strict=True)
    ]
    found = score(takes, held, absolute_height=False)
    return {f"{name}_filtered": found[name] for name in FILTERED_MEASURES if name in found}


def _orders(model: RootModel, takes: list[EvaluationTake]) -> Scores:
    """Return mean and standard deviation of e_mse over windows for every order w of F_w (thesis figure 3.2)."""
    found: Scores = {}
    for order in range(FULL_ORDER + 1):
        errors = trajectory_errors(takes, predict_paths(model, takes, order))
        found |= {f"e_mse_w{order}": float(errors.mean()), f"e_mse_std_w{order}": float(errors.std())}
    return found
