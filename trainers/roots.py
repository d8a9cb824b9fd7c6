"""Which root the clips of a library follow: as recorded, or reconstructed where suits cannot know it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from agents.reconstruct_root import reconstruct_root
from agents.shipped import shipped_root_model
from datasets.imu_fusion import SuitClip, on_ground
from datasets.level_ground import level_ground
from datasets.motion import BodyMotion

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

    def of_recordings(self, clips: list[BodyMotion]) -> tuple[list[BodyMotion], dict[str, str]]:
        """Return clips with their roots, and by name the model that gave one: a BVH has no accelerations, so one that needs none."""
        wanting = {clip.name for clip in clips if clip.system in FAULTY_SYSTEMS or not clip.rooted} if self.reconstructed else set()
        if wanting:
            names = ", ".join(sorted(wanting))
            self.say(f"{len(wanting)} clips of IMU suits or without a root get theirs from Root3D without accelerations: {names}")
        model = shipped_root_model(BY_POSE) if wanting else None
        rooted = [on_ground(level_ground(reconstruct_root(model, clip))) if model and clip.name in wanting else clip for clip in clips]
        return rooted, dict.fromkeys(sorted(wanting), BY_POSE)

    def of_suit(self, suit: SuitClip) -> BodyMotion:
        """Return the faulty clip of a simulated suit with its root: the suit's own, or Root3D's from the suit's accelerations."""
        if not self.reconstructed:
            return suit.faulty
        clip = on_ground(level_ground(reconstruct_root(shipped_root_model(BY_SENSORS), suit.faulty, suit.accelerations)))
        begin = np.append(suit.clean.root_position[0, :2], 0.0)
        return replace(clip, root_position=clip.root_position + begin)
