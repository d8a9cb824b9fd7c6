"""Variation of how somebody stands and walks: the pelvis moved over feet that stay, and legs turned out, as dancers turn them.

T frames at 60 fps or another rate.
"""

from dataclasses import replace

import numpy as np

from datasets.ik.leg_ik import leg_ik
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import conjugate, from_axis_angle, from_yaw, heading, multiply, rotate

MAX_SWAY_HZ = 0.2  # Hz, of the quickest sway of the pelvis
LOWERING = 0.4  # m of lowering for a metre to the side, so that legs reach their feet: the tangent of a leg's tilt in a wide step
TURN_IN_SHARE = 0.25  # of the largest turn-out, up to which legs turn in
_LEGS = [[BODY_NAMES.index(f"{part}_{side}") for part in ("thigh", "shin", "foot")] for side in "lr"]
_OUTWARD = (1.0, -1.0)  # sign of the yaw that turns the left and the right leg out


def vary_stance(clip: BodyMotion, max_shift_m: float, max_turn_out_rad: float, rng: np.random.Generator) -> BodyMotion:
    """Return a clip whose pelvis is moved and sways over its feet, and whose legs are turned out or in; ankles stay where they are.

    Args:
        clip: Clip.
        max_shift_m: Largest standard deviation of how far the pelvis is moved along each axis of its heading [m]; each clip draws its own.
        max_turn_out_rad: Largest angle by which both legs and feet are turned out [rad].
        rng: Random generator.
    """
    shift = _pelvis_shift(len(clip), clip.fps, max_shift_m * rng.uniform(), rng)
    turn_out = max_turn_out_rad * rng.uniform(-TURN_IN_SHARE, 1.0)
    return move_pelvis(clip, rotate(from_yaw(heading(clip.local_rotations[:, 0])), shift), turn_out)


def move_pelvis(clip: BodyMotion, shift: np.ndarray, turn_out: float) -> BodyMotion:
    """Return a clip with its pelvis moved over feet that stay where they are, and its legs turned out.

    Feet turn about the vertical through their ankles. A foot out of the leg's reach comes along.

    Args:
        clip: Clip.
        shift: How far the pelvis is moved in the world [m], shape (T, 3).
        turn_out: Angle by which knees and feet turn outward [rad].
    """
    positions, rotations = body_poses(clip)
    local = clip.local_rotations.copy()
    for (thigh, shin, foot), outward in zip(_LEGS, _OUTWARD, strict=True):
        yaw = np.broadcast_to(from_yaw(np.array(outward * turn_out)), (len(clip), 4))
        ahead = rotate(rotations[:, thigh], np.broadcast_to((1.0, 0.0, 0.0), shift.shape))
        turned, flexion = leg_ik(positions[:, thigh] + shift, positions[:, foot], rotate(yaw, ahead))
        knee = from_axis_angle(np.broadcast_to((0.0, 1.0, 0.0), shift.shape), flexion)
        local[:, thigh] = multiply(conjugate(rotations[:, 0]), turned)
        local[:, shin] = knee
        local[:, foot] = multiply(conjugate(multiply(turned, knee)), multiply(yaw, rotations[:, foot]))
    return replace(clip, root_position=clip.root_position + shift, local_rotations=local)


def _pelvis_shift(frames: int, fps: float, scale: float, rng: np.random.Generator) -> np.ndarray:
    """Return how far the pelvis is moved in its heading, a constant part and one that sways, shape (T, 3) [m]."""
    cycles = MAX_SWAY_HZ * rng.uniform(size=3) * np.arange(frames)[:, None] / fps
    sway = np.sin(2.0 * np.pi * (cycles + rng.uniform(size=3)))
    shift = scale * (rng.standard_normal(3) + rng.standard_normal(3) * sway)
    down = np.sqrt(shift[:, 2] ** 2 + (0.25 * scale) ** 2) + LOWERING * np.linalg.norm(shift[:, :2], axis=1)
    return np.column_stack([shift[:, :2], -down])
