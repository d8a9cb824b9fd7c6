"""Motion that a lower-body network learns from: joints, legs and toe contacts of clips and of synthetic people at 45 Hz."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch

from datasets.library.splits import HoldoutSplit
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import body_poses
from datasets.trackers.lower_body import LEG_BODIES, toe_contacts
from datasets.trackers.trackers import TRACKED_BODIES
from trainers.supervised.clip_selection import ClipSelection
from trainers.supervised.lobstr_config import LobstrDataConfig
from trainers.supervised.lobstr_data import prepare_takes


class LowerBodyFrames(NamedTuple):
    """N frames of clips at 45 Hz, one clip after the other, torch.

    Attributes:
        positions: Positions of the joints that may be tracked [m], shape (N, 8, 3).
        rotations: Rotations of these joints, wxyz, shape (N, 8, 4).
        legs: Rotations of thigh, shin and foot, left and right, relative to their parents, wxyz, shape (N, 6, 4).
        contacts: Contacts of the toe-bases, 0 or 1, shape (N, 2).
    """

    positions: torch.Tensor
    rotations: torch.Tensor
    legs: torch.Tensor
    contacts: torch.Tensor


@dataclass(frozen=True)
class LowerBodyData(HoldoutSplit[ClipSelection]):
    """Motion that a run trains and selects on; the held-out performer's as it was recorded.

    Attributes:
        frames: Frames of all clips.
    """

    frames: LowerBodyFrames


def prepare_lower_body_data(config: LobstrDataConfig, cache: Path, log: Callable[[str], None]) -> LowerBodyData:
    """Return the clips of a run, from the cache where the same were prepared before.

    Args:
        config: Settings of the motion.
        cache: Folder of prepared clips.
        log: Receives lines about the progress.

    Raises:
        InputError: If the source is bad, holds nothing to train on, or the held-out performer is unknown.
    """
    split, arrays = prepare_takes(config, _frames_of_clip, LowerBodyFrames._fields, __name__, cache, log)
    return LowerBodyData(split.training, split.holdout, split.held_out, LowerBodyFrames(**arrays))


def _frames_of_clip(clip: BodyMotion) -> list[np.ndarray]:
    """Return the arrays of ``LowerBodyFrames`` of a take."""
    positions, rotations = body_poses(clip)
    legs = clip.local_rotations[:, LEG_BODIES]
    return [positions[:, TRACKED_BODIES], rotations[:, TRACKED_BODIES], legs, toe_contacts(clip)]
