"""The real walk with Vicon's truth before and after the restoring network: directions of pelvis, thighs, shins and feet, and the root."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from agents.restore.model import RestoreModel
from agents.restore.restore import restore_poses
from agents.weights.pretrained import POSE_ROOT_MODEL, reconstruct_root_on_ground
from datasets.cleanup.plant_feet import plant_feet
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses
from eval.metrics.root_path import drift
from eval.study.suit.vicon_walk import align_heading, load_real_walk, load_vicon_points

# Ends of a segment among our bodies and among Vicon's points, of the left leg.
_SEGMENTS = {"thigh": ("thigh", "shin", "FEP", "FEO"), "shin": ("shin", "foot", "FEO", "TIO"), "foot": ("foot", "toe", "TIO", "TOE")}
_LEVEL = np.array([1.0, 1.0, 0.0])


def walk_rows(model: RestoreModel, data: Path) -> dict[str, dict[str, float]]:
    """Return the measures of the walk by row: as the suit has it, and restored.

    Args:
        model: Restoring network.
        data: Folder of real motion.
    """
    walk, points = load_real_walk(data), load_vicon_points(data)
    found = restore_poses(model, walk.motion)
    placed = reconstruct_root_on_ground(POSE_ROOT_MODEL, found.motion, level=False)
    shift = walk.truth[0] - placed.root_position[0]
    rooted = {
        "as captured": walk.motion,
        "restored, root by Root3D": replace(placed, root_position=placed.root_position + shift),
        "restored, feet planted": plant_feet(replace(found.motion, root_position=walk.motion.root_position), found.contacts[:, :2] > 0.5),
    }
    return {name: _measure(motion, points, walk.truth) for name, motion in rooted.items()}


def _measure(motion: BodyMotion, points: dict[str, np.ndarray], truth: np.ndarray) -> dict[str, float]:
    """Return the mean errors of directions and knees [deg], and the drift of the root in its own heading and turned onto the truth."""
    joints = body_poses(motion)[0]
    ours, theirs = {}, {}
    for side in "lr":
        for name, (begin, end, start, stop) in _SEGMENTS.items():
            level = _LEVEL if name == "foot" else 1.0  # Vicon's toe is a marker on the shoe, whose height says nothing of the pitch
            ours[f"{name}_{side}"] = level * (joints[:, _body(end, side)] - joints[:, _body(begin, side)])
            theirs[f"{name}_{side}"] = level * (points[side.upper() + stop] - points[side.upper() + start])
    ours["pelvis"] = joints[:, _body("thigh", "l")] - joints[:, _body("thigh", "r")]
    theirs["pelvis"] = points["LFEP"] - points["RFEP"]
    mine, other = (np.stack([_unit(track) for track in tracks.values()]) for tracks in (ours, theirs))
    # North is unknown: the one turn about the vertical that brings all directions nearest to Vicon's.
    yaw = np.angle(np.sum((other[..., 0] + 1j * other[..., 1]) * np.conj(mine[..., 0] + 1j * mine[..., 1])))
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    errors = np.degrees(np.arccos(np.clip(np.sum(mine @ turn.T * other, axis=-1), -1.0, 1.0))).mean(axis=1)
    by_name = dict(zip(ours, errors.tolist(), strict=True))
    knees = [_degrees_between(track[f"thigh_{side}"], track[f"shin_{side}"]) for side in "lr" for track in (ours, theirs)]
    parts = {part: np.mean([by_name[f"{part}_{side}"] for side in "lr"]) for part in _SEGMENTS}
    return {
        "segment_error": float(np.mean([by_name["pelvis"], *parts.values()])),
        "pelvis_error": by_name["pelvis"],
        **{f"{part}_error": float(value) for part, value in parts.items()},
        "knee_error": float(np.mean([np.abs(knees[0] - knees[1]), np.abs(knees[2] - knees[3])])),
        "walk_drift": drift(motion.root_position, truth),
        "walk_drift_turned": drift(align_heading(motion.root_position, truth), truth),
    }


def _body(part: str, side: str) -> int:
    return BODY_NAMES.index(f"{part}_{side}")


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _degrees_between(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the angles between directions (T, 3) [deg]."""
    return np.degrees(np.arccos(np.clip(np.sum(_unit(one) * _unit(other), axis=-1), -1.0, 1.0)))
