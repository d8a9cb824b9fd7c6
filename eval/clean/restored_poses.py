"""The restoring stage of cleaning: poses of a suit are corrected, those of a clean recording left as they are."""

from typing import NamedTuple

import numpy as np

from agents.restore.model import RestoreModel
from agents.restore.restore import restore_poses
from datasets.cleanup.foot_contacts import debounce_contacts
from datasets.motion.clip import BodyMotion
from eval.clean.misalignments import Misalignment, find_misalignments

# deg, mean angle of the constant misalignments over the bodies, under which a clip is taken for clean: of bandai/train, another
# capture system than the network's, 95 % of the suits' recordings are above twice as much and 95 % of the clean clips below half of it.
MIN_MEAN_MISALIGNMENT_DEG = 1.0
# deg, of a body, beyond any strap: real suits have up to 26. Somebody who kneels or lies all the time is unlike what the network knows.
MAX_MISALIGNMENT_DEG = 45.0


class RestoredPoses(NamedTuple):
    """A clip of T frames after the restoring stage.

    Attributes:
        motion: The clip with corrected poses, or the very clip where it was left as it is.
        contacts: Whether the left and the right foot stand, as the network sees it, shape (T, 2); None where the clip was left.
        misalignments: Segments whose sensors were clearly misaligned, the largest first.
        unknown_poses: Whether the clip was left because no suit's misalignment would explain its poses.
    """

    motion: BodyMotion
    contacts: np.ndarray | None
    misalignments: tuple[Misalignment, ...]
    unknown_poses: bool = False


def restore_clip(model: RestoreModel | None, recorded: BodyMotion) -> RestoredPoses:
    """Return a clip with a suit's faults taken out of its poses; one that is clean already stays as it is.

    Args:
        model: Restoring network; None leaves every clip as it is.
        recorded: Retargeted clip at 60 fps.
    """
    if model is None:
        return RestoredPoses(recorded, None, ())
    found = restore_poses(model, recorded)
    degrees = np.degrees(np.linalg.norm(found.constant, axis=-1))
    unknown = bool(degrees.max() > MAX_MISALIGNMENT_DEG)
    if unknown or degrees.mean() < MIN_MEAN_MISALIGNMENT_DEG:
        return RestoredPoses(recorded, None, (), unknown)
    contacts = debounce_contacts(found.contacts[:, :2] > 0.5, recorded.fps)
    return RestoredPoses(found.motion, contacts, find_misalignments(found.constant, found.constant_std))
