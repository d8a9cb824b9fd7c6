"""Matrix products of a PPO update and nothing else: the limit of its speed."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import torch

from agents.policy.mlp import is_onednn_quicker, onednn_linear
from trainers.algorithms.ppo_config import PpoConfig


def multiply_by_default(rows: torch.Tensor, columns: torch.Tensor) -> torch.Tensor:
    """Return ``rows @ columns.T`` as PyTorch does it by default."""
    return torch.mm(rows, columns.t())


def chosen_product() -> Callable[[torch.Tensor, torch.Tensor], torch.Tensor]:
    """Return the product that the policy's networks have chosen on this machine."""
    return onednn_linear if is_onednn_quicker() else multiply_by_default


class _Layer(NamedTuple):
    inputs: torch.Tensor  # (M, I)
    weights: torch.Tensor  # (O, I)
    gradients: torch.Tensor  # (M, O)
    first: bool  # whether the gradients of its inputs are not needed


class MatrixProducts:
    """All matrix products of an update of actor and critic, on random matrices of their shapes."""

    def __init__(self, config: PpoConfig, multiply: Callable[[torch.Tensor, torch.Tensor], torch.Tensor]) -> None:
        """Draw the matrices of a minibatch.

        Args:
            config: Run configuration, of which observations, network, batch, minibatches and epochs count.
            multiply: Returns ``a @ b.T`` of (M, K) and (N, K).
        """
        task, learner = config.task, config.learner
        self._multiply, self._epochs = multiply, learner.epochs
        self._samples = config.collect.envs * config.collect.horizon
        sizes = [[task.observation_size, *config.network.hidden, last] for last in (task.action_size, 1)]
        counts = {learner.minibatch, self._samples % learner.minibatch or learner.minibatch}
        random = torch.Generator().manual_seed(config.seed)
        self._minibatches = {count: [layer for one in sizes for layer in _layers(one, count, random)] for count in counts}
        self._minibatch = learner.minibatch

    @property
    def flops(self) -> float:
        """Floating-point operations of an update, multiplications and additions."""
        products = (len(x) * w.numel() * (2 if first else 3) for x, w, _, first in self._minibatches[self._minibatch])
        return 2.0 * sum(products) * self._epochs * self._samples / self._minibatch

    @torch.inference_mode()
    def run(self) -> float:
        """Do the products of one update; return its samples."""
        multiply = self._multiply
        for _ in range(self._epochs):
            for begin in range(0, self._samples, self._minibatch):
                for x, w, g, first in self._minibatches[min(self._minibatch, self._samples - begin)]:
                    multiply(x, w)
                    multiply(g.t(), x.t())
                    if not first:
                        multiply(g, w.t())
        return float(self._samples)


def _layers(sizes: Sequence[int], count: int, random: torch.Generator) -> list[_Layer]:
    """Return the matrices of one perceptron for ``count`` samples."""

    def draw(*shape: int) -> torch.Tensor:
        return torch.randn(shape, generator=random)

    return [_Layer(draw(count, into), draw(out, into), draw(count, out), into is sizes[0]) for into, out in pairwise(sizes)]
