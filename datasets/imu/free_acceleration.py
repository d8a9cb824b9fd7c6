"""Free accelerations of all 19 sensor bodies for a clip whose recording holds only some of them.

N samples at 100 Hz, as in ``datasets.imu.suit_simulation``: world axes, gravity subtracted, each sensor at the centre of mass of its
body. A body without a sensor gets its acceleration relative to the pelvis from the pose alone, plus the pelvis' measured one. No root
path is needed, so nothing of the path that is to be found leaks in.
"""

from dataclasses import replace

import numpy as np
from scipy.signal import sosfiltfilt

from datasets.imu.sensor_model import MOTION_BANDWIDTH_HZ, SENSOR_BODIES, SENSOR_RATE_HZ, low_pass
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import align_quaternion_signs, body_poses, linear_acceleration, mass_centres, resample
from datasets.motion.rotation import normalise

PELVIS_BODY = BODY_NAMES.index("pelvis")
_SENSOR_PELVIS = SENSOR_BODIES.index(PELVIS_BODY)
_PADDING = 9  # samples, by which the filter extends a clip at both ends, as scipy does for a filter of this order


def accelerations_from_pose(motion: BodyMotion) -> np.ndarray:
    """Return accelerations from the pose alone: those of the sensor bodies' centres of mass with the pelvis' origin held still.

    Args:
        motion: Any clip; its root path is not used.

    Returns:
        Accelerations in the world's axes [m/s^2], shape (N, 19, 3), of the motion below ``MOTION_BANDWIDTH_HZ``.
    """
    clip = resample(motion, SENSOR_RATE_HZ)
    local = align_quaternion_signs(clip.local_rotations)
    local = normalise(sosfiltfilt(low_pass(MOTION_BANDWIDTH_HZ), local, axis=0, padlen=min(_PADDING, len(local) - 1)))
    held = replace(clip, root_position=np.zeros_like(clip.root_position), local_rotations=local)
    positions, rotations = body_poses(held)
    return linear_acceleration(mass_centres(positions, rotations)[:, list(SENSOR_BODIES)], SENSOR_RATE_HZ)


def fill_accelerations(motion: BodyMotion, known: dict[int, np.ndarray]) -> np.ndarray:
    """Return the accelerations of all 19 sensor bodies, of which some were measured.

    Args:
        motion: Any clip; its root path is not used.
        known: Index of a body -> its measured free acceleration in the clip's world axes [m/s^2], shape (N, 3); with the pelvis.

    Returns:
        Accelerations [m/s^2], shape (N, 19, 3): the measured ones as they are, the others relative to the pelvis.

    Raises:
        ValueError: If the pelvis is missing or a body is not among the 19.
    """
    strange = [BODY_NAMES[body] for body in known if body not in SENSOR_BODIES]
    if PELVIS_BODY not in known or strange:
        raise ValueError(f"{', '.join(strange) or 'no pelvis'} among the measured bodies; the pelvis and others of the 19 are expected")
    relative = accelerations_from_pose(motion)
    filled = relative - relative[:, _SENSOR_PELVIS, None] + known[PELVIS_BODY][:, None]
    for body, measured in known.items():
        filled[:, SENSOR_BODIES.index(body)] = measured
    return filled
