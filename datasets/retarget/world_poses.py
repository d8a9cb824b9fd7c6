"""Poses in the world of the joints that are bodies: at rest, in chosen frames, and mean rotations between them and bodies."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.motion.humanoid import LEG_LENGTH
from datasets.motion.rotation import conjugate, cross, multiply
from datasets.motion.skeleton import forward_kinematics
from datasets.motion.vectors import rotation_from_axes, unit_vector
from datasets.performer.performer_clip import PerformerClip

UPRIGHT_SHARE = 0.3  # of the frames, the most upright ones, which replace a rest pose
REST_BONE_DIRECTIONS = {
    "thigh_l": (0, 0, -1.0),
    "thigh_r": (0, 0, -1.0),
    "upper_arm_l": (0, 1.0, 0),
    "upper_arm_r": (0, -1.0, 0),
}  # from the body to the next one at rest


@dataclass(frozen=True)
class WorldPoses:
    """Poses in the world of the joints, by the names of their bodies.

    Attributes:
        positions: Body -> positions in the humanoid's size [m], shape (T, 3).
        rotations: Body -> rotations, wxyz, shape (T, 4).
    """

    positions: dict[str, np.ndarray]
    rotations: dict[str, np.ndarray]

    def cut(self, part: slice) -> "WorldPoses":
        """Return some of the frames."""
        positions, rotations = ({body: own[part] for body, own in tracks.items()} for tracks in (self.positions, self.rotations))
        return WorldPoses(positions, rotations)


def rest_world(performer_clip: PerformerClip) -> WorldPoses:
    """Return the rest pose as a clip of one frame."""
    skeleton = performer_clip.motion.skeleton
    still = np.zeros((1, len(skeleton.names), 4))
    still[..., 0] = 1.0
    positions, rotations = forward_kinematics(skeleton.parents, skeleton.offsets[None], still)
    roles = performer_clip.joint_map.items()
    return WorldPoses({body: positions[:, joint] for body, joint in roles}, {body: rotations[:, joint] for body, joint in roles})


def hip_axis(world: WorldPoses) -> np.ndarray:
    """Return the vectors (T, 3) from the right hip to the left hip."""
    return world.positions["thigh_l"] - world.positions["thigh_r"]


def upright_body_frames(world: WorldPoses) -> np.ndarray:
    """Return for each frame the rotation (T, 4) of an upright body whose left hip is to the left."""
    y = unit_vector(hip_axis(world) * (1.0, 1.0, 0.0))
    z = np.broadcast_to((0.0, 0.0, 1.0), y.shape)
    return rotation_from_axes(cross(y, z), y, z)


def upright_frames(world: WorldPoses) -> WorldPoses:
    """Return the clip's most upright frames: torso vertical, legs straight below the hips, pelvis level."""
    at = world.positions
    torso = unit_vector(at["head"] - at["pelvis"])[:, 2]
    legs = np.minimum(at["thigh_l"][:, 2] - at["foot_l"][:, 2], at["thigh_r"][:, 2] - at["foot_r"][:, 2]) / LEG_LENGTH
    score = torso + legs - np.abs(unit_vector(hip_axis(world))[:, 2])
    return chosen_frames(world, score >= np.quantile(score, 1.0 - UPRIGHT_SHARE))


def chosen_frames(world: WorldPoses, chosen: np.ndarray) -> WorldPoses:
    """Return the frames chosen by a mask (T,)."""
    return WorldPoses({b: p[chosen] for b, p in world.positions.items()}, {b: r[chosen] for b, r in world.rotations.items()})


def mean_relative(frames: np.ndarray, of: np.ndarray) -> np.ndarray:
    """Return the mean (4,) of the rotations ``of`` (T, 4) relative to ``frames`` (T, 4)."""
    return Rotation.from_quat(multiply(conjugate(frames), of), scalar_first=True).mean().as_quat(scalar_first=True)
