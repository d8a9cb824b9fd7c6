"""Whether motion looks like people's, whatever it does: features of an instant, and a discriminator of two that follow each other."""

import torch
from torch import nn

from agents.policy.normaliser import Normaliser
from datasets.imu.root_features import face_forward
from datasets.library.motion_library import Rewarded
from datasets.motion.body_state import BodyState
from datasets.motion.humanoid import BODY_COUNT
from datasets.motion.rotation import Array, namespace

INSTANT_SIZE = 3 * (BODY_COUNT - 1) + 3 * BODY_COUNT + 1  # 118: positions but the root's, velocities, height
HIDDEN = (256, 128)
GRADIENT_PENALTY = 10.0  # w^gp of Peng et al. 2021


def instant_features(bodies: BodyState | Rewarded) -> Array:
    """Return what is seen of N worlds at one instant, in axes whose x points where the pelvis faces.

    Args:
        bodies: Simulated or of a reference, NumPy or torch.

    Returns:
        Positions of the 19 other bodies from the pelvis [m], velocities of all 20 [m/s] and the pelvis' height [m], shape (N, 118).
    """
    xp = namespace(bodies.pos)
    root, forward = bodies.pos[:, :1], bodies.rot[:, 0, :, 0]
    vectors = xp.concat([bodies.pos[:, 1:] - root, bodies.lin_vel], axis=1)
    turned = face_forward(vectors, xp.arctan2(forward[:, 1], forward[:, 0]))
    return xp.concat([turned.reshape(len(turned), -1), root[:, 0, 2:]], axis=1)


class Discriminator(nn.Module):
    """Tells transitions of people, near 1, from an agent's, near -1."""

    def __init__(self, size: int = 2 * INSTANT_SIZE) -> None:
        """Build the network for transitions of length ``size``: the features of two successive control steps."""
        super().__init__()
        self.normaliser = Normaliser(size)
        layers = [nn.Linear(size, HIDDEN[0]), nn.ReLU(), nn.Linear(*HIDDEN), nn.ReLU(), nn.Linear(HIDDEN[1], 1)]
        self.network = nn.Sequential(*layers)

    def forward(self, transitions: torch.Tensor) -> torch.Tensor:
        """Return the scores (M,) of transitions (M, size)."""
        return self.network(self.normaliser(transitions)).squeeze(-1)

    def loss(self, real: torch.Tensor, agent: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Return the least-squares loss with a gradient penalty on real samples, and both kinds' scores.

        Args:
            real: Transitions of people, shape (M, size).
            agent: Transitions of the agent, shape (K, size).

        Returns:
            The loss, and the scores (M,) and (K,). Source: Peng et al. 2021, eq. 8; the gradient is that by normalised features.
        """
        seen = self.normaliser(real).requires_grad_()
        of_real, of_agent = self.network(seen).squeeze(-1), self(agent)
        (slope,) = torch.autograd.grad(of_real.sum(), seen, create_graph=True)
        penalty = 0.5 * GRADIENT_PENALTY * slope.square().sum(-1).mean()
        return (of_real - 1.0).square().mean() + (of_agent + 1.0).square().mean() + penalty, of_real, of_agent


def style_reward(score: torch.Tensor) -> torch.Tensor:
    """Return the reward of a discriminator's scores, from 0 to 1, of the same shape. Source: Peng et al. 2021, eq. 7."""
    return (1.0 - 0.25 * (score - 1.0).square()).clamp_min(0.0)
