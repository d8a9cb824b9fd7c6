"""Which root the clips of a library follow: as recorded, or reconstructed where suits cannot know it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from agents.root.reconstruct import reconstruct_root
from agents.weights.pretrained import shipped_root_model
from datasets.imu.suit_simulation import SuitClip
from datasets.library.sources import Recorded
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import on_ground

FAULTY_SYSTEMS = ("imu", "imu_suit")  # what they recorded is no truth, least of all the root
BY_POSE, BY_SENSORS = "root3d_pose", "root3d"  # which shipped model serves clips without accelerations, and clips with them


@dataclass(frozen=True)
class Roots:
    """How clips get their roots.

    Attributes:
        reconstructed: Whether clips of IMU suits and clips without a root get another one than the file's.
        say: Told in a line what happens.
    """

    reconstructed: bool
    say: Callable[[str], None]

    def of_recordings(self, recordings: list[Recorded]) -> tuple[list[BodyMotion], dict[str, str]]:
        """Return clips with their roots, and by name the model that gave one: by the accelerations where the file holds them.

        Args:
            recordings: Of level ground, none shorter than a model's window.
        """
        clips, models = [one.clip for one in recordings], {}
        for at, (clip, accelerations) in enumerate((one.clip, one.accelerations) for one in recordings):
            if self.reconstructed and (clip.system in FAULTY_SYSTEMS or not clip.rooted):
                models[clip.name] = BY_POSE if accelerations is None else BY_SENSORS
                clips[at] = _rooted(models[clip.name], clip, accelerations)
        for model in sorted(set(models.values())):
            names = sorted(name for name, by in models.items() if by == model)
            self.say(f"{len(names)} clips of IMU suits or without a root get theirs from {model}: {', '.join(names)}")
        return clips, models

    def of_suit(self, suit: SuitClip) -> BodyMotion:
        """Return the faulty clip of a simulated suit with its root: the suit's own, or Root3D's from the suit's accelerations."""
        if not self.reconstructed:
            return suit.faulty
        clip = _rooted(BY_SENSORS, suit.faulty, suit.accelerations)
        begin = np.append(suit.clean.root_position[0, :2], 0.0)
        return replace(clip, root_position=clip.root_position + begin)


def _rooted(model: str, clip: BodyMotion, accelerations: np.ndarray | None) -> BodyMotion:
    """Return a clip of level ground with the root that a shipped model gives it."""
    return on_ground(reconstruct_root(shipped_root_model(model), clip, accelerations, level=True))
