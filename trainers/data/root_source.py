"""Choice of the clips' roots: as recorded, or reconstructed where suits cannot know it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from agents.weights.pretrained import IMU_ROOT_MODEL, POSE_ROOT_MODEL, reconstruct_root_on_ground, restore_suit_poses
from datasets.imu.suit_simulation import SuitClip
from datasets.library.sources import SourceMotion
from datasets.motion.clip import SIMULATED_SUIT, BodyMotion

IMU_SYSTEMS = ("imu", SIMULATED_SUIT)  # capture systems whose recordings are no ground truth, least of all their roots


@dataclass(frozen=True)
class RootSource:
    """Assigns roots to clips.

    Attributes:
        reconstructed: Whether clips of IMU suits and clips without a root get theirs from a model.
        log: Receives lines about the progress.
    """

    reconstructed: bool
    log: Callable[[str], None]

    def apply_to_recordings(self, recordings: list[SourceMotion]) -> tuple[list[BodyMotion], dict[str, str]]:
        """Return clips with their roots, and by clip name the model that gave one.

        A model with accelerations serves files that hold them.

        Args:
            recordings: Clips on level ground, none shorter than a model's window.
        """
        clips, models = [one.clip for one in recordings], {}
        for at, (clip, accelerations) in enumerate((one.clip, one.accelerations) for one in recordings):
            if self.reconstructed and (clip.system in IMU_SYSTEMS or not clip.rooted):
                models[clip.name] = POSE_ROOT_MODEL if accelerations is None else IMU_ROOT_MODEL
                clips[at] = reconstruct_root_on_ground(models[clip.name], clip, accelerations, level=True)
        for model in sorted(set(models.values())):
            names = sorted(name for name, by in models.items() if by == model)
            self.log(f"{len(names)} clips of IMU suits or without a root get theirs from {model}: {', '.join(names)}")
        return clips, models


def faulty_clip(suit: SuitClip, restored: bool, reconstructed: bool) -> BodyMotion:
    """Return the faulty clip of a simulated suit as a policy is to follow it.

    Args:
        suit: Recording of a simulated suit.
        restored: Whether the restoring network takes faults out of its poses.
        reconstructed: Whether its root is Root3D's, from these poses and the suit's accelerations, instead of the suit's own.
    """
    clip = restore_suit_poses(suit.faulty).motion if restored else suit.faulty
    if not reconstructed:
        return clip
    clip = reconstruct_root_on_ground(IMU_ROOT_MODEL, clip, suit.accelerations, level=True)
    begin = np.append(suit.clean.root_position[0, :2], 0.0)
    return replace(clip, root_position=clip.root_position + begin)
