"""Low-pass filter of whole clips: removes the jitter of sensors, which is quicker than human motion."""

from dataclasses import replace

import numpy as np
from scipy.signal import butter, sosfiltfilt

from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import align_quaternion_signs
from datasets.motion.rotation import normalise

CUTOFF_HZ = 6.0  # Hz; bandai/train through simulated suits then has the jitter of its clean clips, and no larger error
PADDING_S = 0.5  # s, by which the clip is extended as its own point reflection at each end, where the filter starts


def smooth_motion(motion: BodyMotion) -> BodyMotion:
    """Return the clip low-pass filtered at ``CUTOFF_HZ`` without delay."""
    if motion.fps <= 2.0 * CUTOFF_HZ or len(motion) < 2:
        return motion
    sections = butter(2, CUTOFF_HZ, fs=motion.fps, output="sos")  # forward and backward: fourth order in all
    padding = min(round(PADDING_S * motion.fps), len(motion) - 1)
    root, local = sosfiltfilt(sections, motion.root_position, axis=0, padlen=padding), align_quaternion_signs(motion.local_rotations)
    for body in range(local.shape[1]):  # one at a time, as the filter takes several times the memory of its input
        local[:, body] = normalise(np.asarray(sosfiltfilt(sections, local[:, body], axis=0, padlen=padding)))
    return replace(motion, root_position=root, local_rotations=local)
