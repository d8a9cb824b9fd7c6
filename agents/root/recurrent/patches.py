"""Patches of a clip for the recurrent root model: features of a few frames at once, four frames apart.

P patches, F features. A patch spans ``WINDOW_FRAMES`` frames and tells how the pelvis moves during its first ``PATCH_FRAMES``; the rest
lies ahead of these. Vectors are rotated about the vertical so that the pelvis faces x in the patch's first frame.
"""

from datasets.imu.root_features import ROOT_RATE_HZ, to_heading_frame
from datasets.imu.sensor_model import SENSOR_BODIES
from datasets.motion.humanoid import BODY_COUNT
from datasets.motion.rotation import Array, array_namespace

PATCH_FRAMES = 4  # from one patch to the next: 25 patches a second
WINDOW_FRAMES = 8  # that a patch sees
PATCH_S = PATCH_FRAMES / ROOT_RATE_HZ
_AHEAD_S = (WINDOW_FRAMES - 1 - PATCH_FRAMES) / ROOT_RATE_HZ
OUTPUT_COUNT = 12  # that the network gives of a patch, for ``agents.root.recurrent.velocity_filter``
NUM_JOINT_BLOCKS, NUM_SENSOR_BLOCKS = 3, 2  # vectors of each joint and of each sensor among the features


def patch_bodies(accelerations: bool) -> tuple[int, ...]:
    """Return the body of each vector in the features of a patch.

    Args:
        accelerations: Whether sensors are among them.
    """
    return (*range(BODY_COUNT),) * NUM_JOINT_BLOCKS + SENSOR_BODIES * (NUM_SENSOR_BLOCKS * accelerations)


def patch_features(joints: Array, heading: Array, accelerations: Array | None) -> Array:
    """Return the features of patches, NumPy or torch, shape (P, F).

    They are the joints about the pelvis in the first frame, their mean velocities during the patch and ahead of it, and the sensors'
    mean accelerations during the patch and ahead of it.

    Args:
        joints: Joints relative to the pelvis, in the world's axes [m], shape (P, 8, 20, 3).
        heading: Heading of the pelvis in the first frame [rad], shape (P,).
        accelerations: Free accelerations of the sensors, in the world's axes [m/s^2], shape (P, 8, 19, 3); None if the model sees none.
    """
    first, last, end = joints[:, 0], joints[:, PATCH_FRAMES], joints[:, -1]
    parts = [first, (last - first) / PATCH_S, (end - last) / _AHEAD_S]
    if accelerations is not None:
        parts += [accelerations[:, :PATCH_FRAMES].mean(1), accelerations[:, PATCH_FRAMES:].mean(1)]
    turned = to_heading_frame(array_namespace(joints).concat(parts, axis=1), heading)
    return turned.reshape(len(turned), -1)
