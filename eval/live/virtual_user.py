"""Virtual user of the live service: a clip as tracker poses with a T-pose first, and the errors of the answers against the clip."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from datasets.motion.clip import BodyMotion
from datasets.motion.curves import smoother_step
from datasets.motion.humanoid import SKELETON
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import from_yaw, heading, multiply, normalise, rotate
from datasets.motion.skeleton import forward_kinematics
from datasets.trackers.lower_body import TOE_BODIES, toe_contacts
from datasets.trackers.trackers import ALL_TRACKER_NAMES, PELVIS_TRACKER, TRACKER_NAMES, TRACKER_RATE_HZ, TrackerPoses, tracker_poses
from datasets.trackers.virtual_user import draw_tracker_placement, simulate_t_pose, simulate_trackers

T_POSE_S = 1.2  # s, a little longer than the calibration
BLEND_S = 1.0  # s, from the T-pose into the clip, while the network warms up


@dataclass(frozen=True)
class TrackerReplay:
    """Tracker poses of a virtual user, and the truth behind them.

    Attributes:
        trackers: Tracker poses, T-pose first, shape (T, J, ...).
        first_clip_frame: Index of the clip's first frame among them.
        clip: True clip on the standard skeleton.
        scale: Size of the user relative to the standard skeleton.
    """

    trackers: TrackerPoses
    first_clip_frame: int
    clip: BodyMotion
    scale: float


@dataclass(frozen=True)
class AnswerErrors:
    """Errors of the answers against the truth.

    Attributes:
        frames: Number of frames compared.
        toe_error: Mean distance of the toe-bases from the true ones, roots aligned [m].
        toe_error_world: Mean distance of the toe-bases from the true ones in the world, the pelvis' error included [m].
        contact_accuracy: Share of toe contacts that are right.
    """

    frames: int
    toe_error: float
    toe_error_world: float
    contact_accuracy: float


def replay_as_trackers(clip: BodyMotion, height: float, seed: int, legs: bool = False, imus: Sequence[str] = ()) -> TrackerReplay:
    """Return the poses of worn, noisy trackers of a clip at 45 fps.

    Args:
        clip: Clip on the 20 bodies.
        height: Height of the user, from sole to crown [m].
        seed: Seed of the tracker placement, of the T-pose and of the noise.
        legs: Whether feet and shins have trackers as well: all eight instead of four.
        imus: Names of trackers that are IMUs, without positions.
    """
    rng = np.random.default_rng(seed)
    wearing = draw_tracker_placement(rng, height, legs)
    joints = tracker_poses(clip, len(ALL_TRACKER_NAMES if legs else TRACKER_NAMES))
    standing = _move_to_start(simulate_t_pose(T_POSE_S, rng, legs), joints)
    blend = _blend(TrackerPoses(*(part[-1] for part in standing)), TrackerPoses(*(part[0] for part in joints)))
    whole = TrackerPoses(*(np.concat(parts) for parts in zip(standing, blend, joints, strict=True)))
    trackers = simulate_trackers(whole, wearing, rng)
    trackers.positions[:, [ALL_TRACKER_NAMES.index(name) for name in imus]] = np.nan
    return TrackerReplay(trackers, len(whole.positions) - len(clip), clip, wearing.scale)


def measure_answers(
    replay: TrackerReplay, frames: np.ndarray, roots: np.ndarray, rotations: np.ndarray, contacts: np.ndarray
) -> AnswerErrors:
    """Return the errors of A answers.

    Args:
        replay: Replay that was answered.
        frames: Frame of the clip of each answer, shape (A,).
        roots: Positions of the pelvis [m], shape (A, 3).
        rotations: Rotations of the 20 bodies relative to their parents, wxyz, shape (A, 20, 4).
        contacts: Whether the left and the right toes are in contact, shape (A, 2).
    """
    offsets = np.tile(SKELETON.offsets * replay.scale, (len(frames), 1, 1))
    offsets[:, 0] = roots
    said = forward_kinematics(SKELETON.parents, offsets, rotations)[0][:, [0, *TOE_BODIES]]
    true = replay.scale * body_poses(replay.clip)[0][frames][:, [0, *TOE_BODIES]]
    off, relative = said - true, (said - said[:, :1]) - (true - true[:, :1])
    return AnswerErrors(
        len(frames),
        float(np.linalg.norm(relative[:, 1:], axis=-1).mean()),
        float(np.linalg.norm(off[:, 1:], axis=-1).mean()),
        float((contacts == toe_contacts(replay.clip)[frames]).mean()),
    )


def _move_to_start(standing: TrackerPoses, joints: TrackerPoses) -> TrackerPoses:
    """Return the tracker poses of a T-pose moved to the position and heading of the clip's first frame."""
    turn = from_yaw(heading(joints.rotations[0, PELVIS_TRACKER]))
    positions = rotate(np.broadcast_to(turn, (*standing.positions.shape[:-1], 4)), standing.positions)
    place = joints.positions[0, PELVIS_TRACKER] * (1.0, 1.0, 0.0)
    return TrackerPoses(positions + place, multiply(np.broadcast_to(turn, standing.rotations.shape), standing.rotations))


def _blend(start: TrackerPoses, end: TrackerPoses) -> TrackerPoses:
    """Return the interpolation from one pose (J, ...) to another, without the ends."""
    share = smoother_step(np.arange(1, round(BLEND_S * TRACKER_RATE_HZ)) / round(BLEND_S * TRACKER_RATE_HZ))[:, None, None]
    near = np.where(np.sum(start.rotations * end.rotations, axis=-1, keepdims=True) < 0.0, -end.rotations, end.rotations)
    return TrackerPoses((1 - share) * start.positions + share * end.positions, normalise((1 - share) * start.rotations + share * near))
