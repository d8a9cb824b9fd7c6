"""Mirrored clips: left and right exchanged, for a body can do to the right what it can do to the left."""

from dataclasses import replace

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES

_PARTNERS = {"_l": "_r", "_r": "_l"}
# Index of each body's counterpart on the other side; bodies in the middle are their own.
OTHER_SIDE = [BODY_NAMES.index(name[:-2] + _PARTNERS.get(name[-2:], name[-2:])) for name in BODY_NAMES]
MIRRORED_VECTOR = (1.0, -1.0, 1.0)  # signs of a vector's components
MIRRORED_AXIAL_VECTOR = (-1.0, 1.0, -1.0)  # of a rotation vector's or an angular velocity's
# A mirror at y = 0 keeps rotations about y and reverses those about x and z. At rest every body is its partner's mirror image.
MIRRORED_QUATERNION = (1.0, -1.0, 1.0, -1.0)


def mirrored_name(name: str) -> str:
    """Return the name of a clip's mirror image."""
    return f"{name}_mirrored"


def mirror_motion(motion: BodyMotion) -> BodyMotion:
    """Return the clip mirrored at the plane y = 0: y becomes -y, and the sides of the body change places."""
    return replace(
        motion,
        name=mirrored_name(motion.name),
        root_position=motion.root_position * MIRRORED_VECTOR,
        local_rotations=motion.local_rotations[:, OTHER_SIDE] * MIRRORED_QUATERNION,
        toe_offsets=None if motion.toe_offsets is None else motion.toe_offsets[::-1] * MIRRORED_VECTOR,
    )
