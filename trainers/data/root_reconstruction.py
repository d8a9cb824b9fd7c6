"""Which root the clips of a library follow: as recorded, or reconstructed where suits cannot know it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from agents.root.reconstruct import reconstruct_root
from agents.weights.pretrained import load_pretrained_root
from datasets.imu.suit_simulation import SuitClip
from datasets.library.sources import SourceMotion
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import place_on_ground

IMU_SYSTEMS = ("imu", "imu_suit")  # what they recorded is no truth, least of all the root
POSE_ROOT_MODEL, IMU_ROOT_MODEL = "root3d_pose", "root3d"  # which shipped model serves clips without accelerations, and clips with them


@dataclass(frozen=True)
class RootSource:
    """How clips get their roots.

    Attributes:
        reconstructed: Whether clips of IMU suits and clips without a root get another one than the file's.
        log: Told in a line what happens.
    """

    reconstructed: bool
    log: Callable[[str], None]

    def apply_to_recordings(self, recordings: list[SourceMotion]) -> tuple[list[BodyMotion], dict[str, str]]:
        """Return clips with their roots, and by name the model that gave one: by the accelerations where the file holds them.

        Args:
            recordings: Of level ground, none shorter than a model's window.
        """
        clips, models = [one.clip for one in recordings], {}
        for at, (clip, accelerations) in enumerate((one.clip, one.accelerations) for one in recordings):
            if self.reconstructed and (clip.system in IMU_SYSTEMS or not clip.rooted):
                models[clip.name] = POSE_ROOT_MODEL if accelerations is None else IMU_ROOT_MODEL
                clips[at] = _with_model_root(models[clip.name], clip, accelerations)
        for model in sorted(set(models.values())):
            names = sorted(name for name, by in models.items() if by == model)
            self.log(f"{len(names)} clips of IMU suits or without a root get theirs from {model}: {', '.join(names)}")
        return clips, models

    def apply_to_suit(self, suit: SuitClip) -> BodyMotion:
        """Return the faulty clip of a simulated suit with its root: the suit's own, or Root3D's from the suit's accelerations."""
        if not self.reconstructed:
            return suit.faulty
        clip = _with_model_root(IMU_ROOT_MODEL, suit.faulty, suit.accelerations)
        begin = np.append(suit.clean.root_position[0, :2], 0.0)
        return replace(clip, root_position=clip.root_position + begin)


def _with_model_root(model: str, clip: BodyMotion, accelerations: np.ndarray | None) -> BodyMotion:
    """Return a clip of level ground with the root that a shipped model gives it."""
    return place_on_ground(reconstruct_root(load_pretrained_root(model), clip, accelerations, level=True))
