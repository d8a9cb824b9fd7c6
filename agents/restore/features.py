"""Input features of a restoring network: orientations, positions and velocities of the 20 bodies in the pelvis' heading.

B windows of T frames at ``RESTORE_RATE_HZ``.
"""

import torch

from agents.restore.kinematics import joint_positions, sole_positions
from agents.restore.spec import RESTORE_RATE_HZ
from datasets.motion.humanoid import BODY_COUNT
from datasets.motion.rotation import Constant, conjugate, multiply, rotate, to_matrix

NUM_SOLES = 6
_ABOUT_VERTICAL = Constant([1.0, 0.0, 0.0, 1.0])  # components of a quaternion
# Two axes of each body; positions and velocities of joints and sole points; the latter's heights over and velocities against the
# lowest; the turning rate.
FEATURE_COUNT = BODY_COUNT * 6 + (BODY_COUNT - 1 + NUM_SOLES) * 6 + NUM_SOLES * 4 + 1


def heading_rotation(rotations: torch.Tensor) -> torch.Tensor:
    """Return the part about the vertical (..., 4) of rotations (..., 4); a body that bends over keeps its heading."""
    kept = rotations * _ABOUT_VERTICAL.like(rotations)
    return kept / (kept.square().sum(-1, keepdim=True) + 1e-12).sqrt()


def pose_features(rotations: torch.Tensor) -> torch.Tensor:
    """Return the features of poses, shape (B, T, ``FEATURE_COUNT``).

    Args:
        rotations: Rotations of the bodies in the world, wxyz, shape (B, T, 20, 4). Where the world's north lies does not matter.
    """
    heading = heading_rotation(rotations[:, :, 0])
    to_heading = conjugate(heading)[:, :, None]
    ahead = multiply(to_heading.expand(rotations.shape), rotations)
    joints = joint_positions(ahead)
    points = torch.cat([joints[:, :, 1:], sole_positions(joints, ahead)], dim=2)
    quarter = (*points.shape[:3], 4)
    moved = torch.zeros_like(points)
    moved[:, 1:] = rotate(heading[:, :, None].expand(quarter), points).diff(dim=1) * RESTORE_RATE_HZ
    velocities = rotate(to_heading.expand(quarter), moved)
    soles, steps = points[:, :, -NUM_SOLES:], velocities[:, :, -NUM_SOLES:]
    heights = soles[..., 2] - soles[..., 2].amin(-1, keepdim=True)
    lowest = soles[..., 2].argmin(-1)[..., None, None].expand(*steps.shape[:2], 1, 3)
    over_ground = steps - steps.gather(2, lowest)  # if the lowest point stands, which it does more often than not
    turned = torch.zeros_like(heading[..., :1])
    between = multiply(conjugate(heading[:, :-1]), heading[:, 1:])
    turned[:, 1:, 0] = 2.0 * between[..., 3] * between[..., 0].sign() * RESTORE_RATE_HZ  # of small angles
    parts = (to_matrix(ahead)[..., :2], points, velocities, heights, over_ground, turned)
    return torch.cat([part.flatten(2) for part in parts], dim=-1)
