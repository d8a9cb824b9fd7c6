"""Takes the jitter out of a clip: what is quicker than people move is the sensors', not theirs."""

from dataclasses import replace

import numpy as np
from scipy.signal import butter, sosfiltfilt

from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import continuous
from datasets.motion.rotation import normalise

CUT_OFF = 6.0  # Hz: bandai/train through simulated suits then has the jitter of its clean clips, and no larger error
SETTLES = 0.5  # s, of mirrored clip at each end from which the filter starts


def steady(motion: BodyMotion) -> BodyMotion:
    """Return the clip without what is quicker than ``CUT_OFF``, nothing delayed."""
    if motion.fps <= 2.0 * CUT_OFF or len(motion) < 2:
        return motion
    sections = butter(2, CUT_OFF, fs=motion.fps, output="sos")  # forward and backward: fourth order in all
    padding = min(round(SETTLES * motion.fps), len(motion) - 1)
    root, local = (
        sosfiltfilt(sections, track, axis=0, padlen=padding) for track in (motion.root_position, continuous(motion.local_rotations))
    )
    return replace(motion, root_position=root, local_rotations=normalise(np.asarray(local)))
