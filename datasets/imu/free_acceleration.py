"""Free accelerations of the 19 sensor bodies for a clip that brings only some of them, or none.

N samples at 100 Hz, as ``imu_suit`` has them: world axes, gravity taken away, a sensor at the centre of its body. The rule for a
body without a sensor is the pose's: its acceleration relative to the pelvis follows from the pose alone, and what the pelvis'
own sensor measured is put on top. No root path is needed, so nothing of the path that is looked for leaks in.
"""

from dataclasses import replace

import numpy as np
from scipy.signal import sosfiltfilt

from datasets.imu.sensor_model import MOTION_BANDWIDTH_HZ, SENSOR_BODIES, SENSOR_RATE_HZ, low_pass
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_COM_OFFSETS, BODY_NAMES
from datasets.motion.kinematics import align_quaternion_signs, body_poses, linear_acceleration, resample
from datasets.motion.rotation import normalise, rotate

PELVIS_BODY = BODY_NAMES.index("pelvis")
_SENSOR_PELVIS = SENSOR_BODIES.index(PELVIS_BODY)
_PADDING = 9  # samples by which the filter extends a clip at both ends, as scipy does for a filter of this order


def accelerations_from_pose(motion: BodyMotion) -> np.ndarray:
    """Return what the pose alone tells: accelerations of the sensor bodies' centres with the pelvis' origin held still.

    Args:
        motion: Any clip; its root's path is not looked at.

    Returns:
        Accelerations in the world's axes [m/s^2], shape (N, 19, 3), of the motion below ``imu_suit.BANDWIDTH``.
    """
    clip = resample(motion, SENSOR_RATE_HZ)
    local = align_quaternion_signs(clip.local_rotations)
    local = normalise(sosfiltfilt(low_pass(MOTION_BANDWIDTH_HZ), local, axis=0, padlen=min(_PADDING, len(local) - 1)))
    held = replace(clip, root_position=np.zeros_like(clip.root_position), local_rotations=local)
    positions, rotations = body_poses(held)
    centres = positions + rotate(rotations, np.broadcast_to(BODY_COM_OFFSETS, positions.shape))
    return linear_acceleration(centres[:, list(SENSOR_BODIES)], SENSOR_RATE_HZ)


def fill_accelerations(motion: BodyMotion, known: dict[int, np.ndarray]) -> np.ndarray:
    """Return the accelerations of all 19 sensor bodies, of which some were measured.

    Args:
        motion: Any clip; its root's path is not looked at.
        known: Body -> its measured free acceleration in the clip's world axes [m/s^2], shape (N, 3); the pelvis must be there.

    Returns:
        Accelerations [m/s^2], shape (N, 19, 3): the measured ones as they are, the others relative to the pelvis.

    Raises:
        ValueError: If the pelvis is missing or a body has no place among the 19.
    """
    strange = [BODY_NAMES[body] for body in known if body not in SENSOR_BODIES]
    if PELVIS_BODY not in known or strange:
        raise ValueError(f"{', '.join(strange) or 'no pelvis'} among the measured bodies; the pelvis and others of the 19 are expected")
    relative = accelerations_from_pose(motion)
    filled = relative - relative[:, _SENSOR_PELVIS, None] + known[PELVIS_BODY][:, None]
    for body, measured in known.items():
        filled[:, SENSOR_BODIES.index(body)] = measured
    return filled
