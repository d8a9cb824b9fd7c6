"""A clip as a user of the live service performs it, trackers on, T-pose first; and how far the answers are from the truth."""

from dataclasses import dataclass

import numpy as np

from datasets.motion.clip import BodyMotion
from datasets.motion.curves import smoother_step
from datasets.motion.humanoid import SKELETON
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import from_axis_angle, heading, multiply, normalise, rotate
from datasets.motion.skeleton import forward_kinematics
from datasets.trackers.lower_body import TOE_BODIES, toe_contacts
from datasets.trackers.trackers import PELVIS_TRACKER, TRACKER_RATE_HZ, TrackerPoses, tracker_poses
from datasets.trackers.virtual_user import draw_tracker_placement, simulate_t_pose, simulate_trackers

T_POSE_S = 1.2  # a little longer than calibration takes
BLEND_S = 1.0  # from the T-pose into the clip: while the network warms up
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class TrackerReplay:
    """What one virtual user does.

    Attributes:
        trackers: What the trackers tell, T-pose first, shape (T, 4, ...).
        first_clip_frame: Index of the clip's first frame among them.
        clip: The truth, on the standard skeleton.
        scale: The user's size against it.
    """

    trackers: TrackerPoses
    first_clip_frame: int
    clip: BodyMotion
    scale: float


@dataclass(frozen=True)
class AnswerErrors:
    """How far answers are from the truth.

    Attributes:
        frames: How many were compared.
        toe_error: Mean distance of the toe-bases from the true ones, pelvis on pelvis [m].
        toe_error_world: The same in the world, where the pelvis' own error counts as well [m].
        contact_accuracy: Share of toe contacts that are right.
    """

    frames: int
    toe_error: float
    toe_error_world: float
    contact_accuracy: float


def replay_as_trackers(clip: BodyMotion, height: float, seed: int) -> TrackerReplay:
    """Return a clip at 45 fps as worn trackers with noise.

    Args:
        clip: On the 20 bodies.
        height: Of the user, from sole to crown [m].
        seed: Of how the trackers are worn, of the T-pose and of the noise.
    """
    rng = np.random.default_rng(seed)
    wearing = draw_tracker_placement(rng, height)
    joints = tracker_poses(clip)
    standing = _at(simulate_t_pose(T_POSE_S, rng), joints)
    blend = _blend(TrackerPoses(*(part[-1] for part in standing)), TrackerPoses(*(part[0] for part in joints)))
    whole = TrackerPoses(*(np.concat(parts) for parts in zip(standing, blend, joints, strict=True)))
    return TrackerReplay(simulate_trackers(whole, wearing, rng), len(whole.positions) - len(clip), clip, wearing.scale)


def measure_answers(
    replay: TrackerReplay, frames: np.ndarray, roots: np.ndarray, rotations: np.ndarray, contacts: np.ndarray
) -> AnswerErrors:
    """Return how right answers are.

    Args:
        replay: What was performed.
        frames: Which of the clip's frames the answers are to, shape (A,).
        roots: Positions of the pelvis [m], shape (A, 3).
        rotations: Of the 20 bodies relative to their parents, shape (A, 20, 4).
        contacts: Of the toes, left and right, shape (A, 2).
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


def _at(standing: TrackerPoses, joints: TrackerPoses) -> TrackerPoses:
    """Return a T-pose where the clip begins, facing where it faces."""
    turn = from_axis_angle(_UP, heading(joints.rotations[0, PELVIS_TRACKER]))
    positions = rotate(np.broadcast_to(turn, (*standing.positions.shape[:-1], 4)), standing.positions)
    place = joints.positions[0, PELVIS_TRACKER] * (1.0, 1.0, 0.0)
    return TrackerPoses(positions + place, multiply(np.broadcast_to(turn, standing.rotations.shape), standing.rotations))


def _blend(start: TrackerPoses, end: TrackerPoses) -> TrackerPoses:
    """Return the way from one pose (4, ...) to another, ends left out."""
    share = smoother_step(np.arange(1, round(BLEND_S * TRACKER_RATE_HZ)) / round(BLEND_S * TRACKER_RATE_HZ))[:, None, None]
    near = np.where(np.sum(start.rotations * end.rotations, axis=-1, keepdims=True) < 0.0, -end.rotations, end.rotations)
    return TrackerPoses((1 - share) * start.positions + share * end.positions, normalise((1 - share) * start.rotations + share * near))
