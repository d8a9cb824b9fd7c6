"""Augmentation of training windows: mirroring, and masking of joints and sensors."""

import torch

from agents.root.spec import RootSpec
from datasets.imu.root_features import LOWER_BODIES
from datasets.motion.humanoid import BODY_COUNT
from datasets.motion.mirror import OTHER_SIDE


def mirror_bodies(bodies: tuple[int, ...]) -> torch.Tensor:
    """Return for each of ``bodies`` the position among them of the same body of the other side, or its own."""
    return torch.tensor([bodies.index(OTHER_SIDE[body]) for body in bodies])


class RootAugmentation:
    """Augments windows of one kind of model at random."""

    def __init__(self, spec: RootSpec, mask_share: float) -> None:
        """Build the index tables.

        Args:
            spec: Spec of the model.
            mask_share: Share of the vectors of trunk, head and arms in each window that are replaced by their means. Arm motion
                correlates with leg motion, but the feet on the ground move the root: a network that has seen few people must not
                infer the root from the arms.
        """
        bodies = list(spec.bodies)
        joints = bodies.index(BODY_COUNT - 1) + 1
        sensors = joints + mirror_bodies(tuple(bodies[joints:])) if len(bodies) > joints else torch.zeros(0, dtype=torch.long)
        self._mirrored_index = torch.cat([mirror_bodies(tuple(bodies[:joints])), sensors])
        self._reflection = torch.tensor([1.0, -1.0, 1.0])  # reflection in the plane of forward and up
        self._is_maskable = torch.tensor([body not in LOWER_BODIES for body in bodies])
        self._mask_share = mask_share

    def __call__(
        self, features: torch.Tensor, targets: torch.Tensor, mean: torch.Tensor, random: torch.Generator
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Return augmented features and targets; half of the batch is mirrored.

        Args:
            features: Raw features of windows that face forward, shape (B, W, F).
            targets: Targets of the windows, shape (B, W, 3).
            mean: Means of the features, shape (F,).
            random: Random generator.
        """
        count, vectors = len(features), 3 * len(self._mirrored_index)
        seen, padding = features[..., :vectors], features[..., vectors:]
        seen = seen.unflatten(-1, (-1, 3))
        half = count // 2
        mirrored = seen[:half][:, :, self._mirrored_index] * self._reflection
        seen = torch.cat([mirrored, seen[half:]])
        targets = torch.cat([targets[:half] * self._reflection, targets[half:]])
        masked = (torch.rand(count, 1, len(self._is_maskable), generator=random) < self._mask_share) & self._is_maskable
        seen = torch.where(masked[..., None], mean[:vectors].view(-1, 3), seen)
        return torch.cat([seen.flatten(2), padding], -1), targets
