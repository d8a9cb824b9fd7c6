"""Reconstruction of the root of a clip by a root model, from its pose and accelerations."""

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from agents.root.model import RootModel
from agents.root.path import FULL_ORDER, predict_root_path
from agents.root.spec import RootSpec
from configs.errors import InputError
from datasets.cleanup.ballistic_flight import apply_ballistic_root
from datasets.cleanup.ground_levelling import level_to_ground
from datasets.cleanup.stance_root_filter import apply_stance_root_filter
from datasets.imu.free_acceleration import accelerations_from_pose
from datasets.imu.root_features import ROOT_RATE_HZ, RootFrames, root_frames
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import body_poses, lowest_point_heights, resample


def reconstruct_root(
    model: RootModel,
    motion: BodyMotion,
    accelerations: np.ndarray | None = None,
    order: int = FULL_ORDER,
    filtered: bool = True,
    level: bool = False,
) -> BodyMotion:
    """Return a clip with the root path that a model predicts for it; its own root is not used.

    The clip is resampled to 100 Hz along splines and its new root back to the clip's own rate. The path starts above the origin with
    the lowest sole on the ground.

    Args:
        model: Trained root model.
        motion: Clip of any rate.
        accelerations: Free accelerations in the clip's world at 100 Hz [m/s^2], shape (N, 19, 3); if the model needs them and there
            are none, those of the pose about the pelvis are taken.
        order: Order w of F_w (thesis eq. 3.12).
        filtered: Whether the path is filtered: in the air the centre of mass flies ballistically (``apply_ballistic_root``, which needs
            measured accelerations; recurrent models fly by themselves), and feet in stance are held (``apply_stance_root_filter``, thesis
            3.5.2).
        level: Whether the ground is known to be level: then height drift is corrected wherever feet stand (``level_to_ground``).

    Raises:
        InputError: If the clip is shorter than the model's window, or the accelerations do not fit; names the clip.
    """
    clip = resample(motion, ROOT_RATE_HZ)
    seen = accelerations_from_pose(motion) if accelerations is None and model.spec.accelerations else accelerations
    try:
        frames = root_frames(clip, seen)
        path = predict_root_path(model, frames, initial_root_position(clip), order)
    except InputError as error:
        raise error if motion.name in str(error) else InputError(f"{motion.name}: {error}") from None
    if filtered:
        path = filter_path(model.spec, path, clip, None if accelerations is None else frames)
    found = replace(motion, root_position=_at_frames(path, motion))
    return level_to_ground(found) if level else found


def filter_path(spec: RootSpec, path: np.ndarray, clip: BodyMotion, measured_frames: RootFrames | None) -> np.ndarray:
    """Return a path filtered by stance, and by ballistic flight where the model's steps know of none [m], shape (N, 3).

    Args:
        spec: Spec of the model. The recurrent one flies by itself, and planar ones know heights.
        path: Path that a model predicts [m], shape (N, 3).
        clip: Clip of the path, at 100 Hz.
        measured_frames: Frames of the clip with measured accelerations; None without them: then there is no flight.
    """
    if measured_frames is not None and spec.predicts_steps_ahead:
        path = apply_ballistic_root(path, measured_frames.centre, measured_frames.accelerations)
    return apply_stance_root_filter(replace(clip, root_position=path), spec.slide_speed).root_position


def initial_root_position(motion: BodyMotion) -> np.ndarray:
    """Return the position of the pelvis above the origin with the lowest point of the first frame on the ground [m], shape (3,)."""
    first = replace(motion.cut(0, 1), root_position=np.zeros((1, 3)))
    return np.array([0.0, 0.0, -lowest_point_heights(*body_poses(first)).min()])


def _at_frames(path: np.ndarray, motion: BodyMotion) -> np.ndarray:
    """Return a path at 100 Hz resampled to the frames of a clip, the last of which may lie slightly beyond its end."""
    if motion.fps == ROOT_RATE_HZ:
        return path
    return CubicSpline(np.arange(len(path)) / ROOT_RATE_HZ, path)(np.arange(len(motion)) / motion.fps)
