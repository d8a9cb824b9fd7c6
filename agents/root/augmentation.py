"""More performers than were recorded: windows seen in a mirror, and windows of which some joints and sensors are not seen."""

import torch

from agents.root.spec import RootSpec
from datasets.imu.root_features import LOWER_BODIES
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES


def _twin(body: int) -> int:
    """Return the same body of the other side, or the body itself in the middle."""
    base, _, side = BODY_NAMES[body].rpartition("_")
    return BODY_NAMES.index(f"{base}_{'r' if side == 'l' else 'l'}") if side in ("l", "r") else body


class RootAugmentation:
    """Changes windows of one kind of model at random."""

    def __init__(self, spec: RootSpec, mask_share: float) -> None:
        """Prepare.

        Args:
            spec: Of the model whose windows come.
            mask_share: Share of the vectors that are not of pelvis and legs of each window that are replaced by their means. What arms
                do goes along with what legs do, but it is the feet on the ground that move the root: a network that has seen few
                people must not guess the one from the other.
        """
        bodies = list(spec.bodies)
        joints = bodies.index(BODY_COUNT - 1) + 1
        blocks = [range(joints), range(joints, len(bodies))]  # joints, then sensors
        twins = [bodies.index(_twin(bodies[at]), block.start) for block in blocks for at in block]
        self._other_side = torch.tensor(twins)
        self._across = torch.tensor([1.0, -1.0, 1.0])  # a mirror in the plane of forward and up
        self._hideable = torch.tensor([body not in LOWER_BODIES for body in bodies])
        self._mask_share = mask_share

    def __call__(
        self, features: torch.Tensor, targets: torch.Tensor, mean: torch.Tensor, random: torch.Generator
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Return changed windows; half of the batch is mirrored.

        Args:
            features: Raw features of windows that face forward, shape (B, W, F).
            targets: Their targets, shape (B, W, 3).
            mean: Of the features, shape (F,).
            random: Source of randomness.
        """
        count, vectors = len(features), 3 * len(self._other_side)
        seen, padding = features[..., :vectors], features[..., vectors:]
        seen = seen.unflatten(-1, (-1, 3))
        half = count // 2
        mirrored = seen[:half][:, :, self._other_side] * self._across
        seen = torch.cat([mirrored, seen[half:]])
        targets = torch.cat([targets[:half] * self._across, targets[half:]])
        hide = (torch.rand(count, 1, len(self._hideable), generator=random) < self._mask_share) & self._hideable
        seen = torch.where(hide[..., None], mean[:vectors].view(-1, 3), seen)
        return torch.cat([seen.flatten(2), padding], -1), targets
