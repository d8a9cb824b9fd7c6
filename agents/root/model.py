"""Root model: network and normalisation, from windows of features to paths in metres."""

from dataclasses import asdict
from pathlib import Path
from typing import Any, Self

import torch
from torch import nn

from agents.model_file import load_network, save_network
from agents.root.spec import NETWORKS, RootSpec
from agents.root.stance_points import stance_paths
from datasets.motion.rotation import Array

MIN_STD = 1e-3  # least standard deviation of a feature or target [m, m/s^2], so that nearly constant ones are not amplified


def decode_paths(spec: RootSpec, features: Array, output: Array, mean: Array, std: Array) -> Array:
    """Return the paths of a network's output [m], NumPy or torch, shape (B, W, 3).

    Args:
        spec: Spec of the model.
        features: Raw features of windows, shape (B, W, F).
        output: Output of the network, shape (B, W, ``spec.outputs``).
        mean: Means of the targets [m], shape (3,).
        std: Standard deviations of the targets [m], shape (W, 3).
    """
    paths = output[..., :3] * std + mean
    return paths + stance_paths(spec, features, output[..., 3:]) if spec.support else paths


class RootModel(nn.Module):
    """Network with the statistics of its features and targets as part of the weights."""

    feature_mean: torch.Tensor
    feature_std: torch.Tensor
    target_mean: torch.Tensor
    target_std: torch.Tensor

    def __init__(self, spec: RootSpec) -> None:
        """Build an untrained model."""
        super().__init__()
        self.spec = spec
        self.network = NETWORKS[spec.network](spec.features, spec.outputs)
        self.register_buffer("feature_mean", torch.zeros(spec.features))
        self.register_buffer("feature_std", torch.ones(spec.features))
        self.register_buffer("target_mean", torch.zeros(3))
        self.register_buffer("target_std", torch.ones(spec.window, 3))

    @torch.no_grad()
    def fit_normalisation(self, features: torch.Tensor, targets: torch.Tensor) -> None:
        """Set the normalisation to the statistics of features (B, W, F) and targets (B, W, 3).

        Of the targets only absolute heights have their mean subtracted: displacements have one as well, since people walk forwards,
        but a person who stands still must be predicted at zero.
        """
        self.feature_mean.copy_(features.mean((0, 1)))
        self.feature_std.copy_(features.std((0, 1)).clamp(min=MIN_STD))
        if self.spec.vertical == "height":
            self.target_mean[2] = targets[..., 2].mean()
        self.target_std.copy_((targets - self.target_mean).square().mean(0).sqrt().clamp(min=MIN_STD))

    def normalise(self, features: torch.Tensor) -> torch.Tensor:
        """Return features (B, W, F) with zero mean and unit variance."""
        return (features - self.feature_mean) / self.feature_std

    def predict_outputs(self, features: torch.Tensor) -> torch.Tensor:
        """Return the network's outputs for raw features (B, P, F), with gradients, shape (B, P, outputs)."""
        return self.network(self.normalise(features))

    def predict_paths(self, features: torch.Tensor) -> torch.Tensor:
        """Return the paths predicted from raw features (B, W, F), with gradients [m], shape (B, W, 3)."""
        return decode_paths(self.spec, features, self.predict_outputs(features), self.target_mean, self.target_std)

    @torch.inference_mode()
    def forward(self, features: torch.Tensor) -> torch.Tensor:
        """Return the same without gradients; ``agents.root.windows.window_targets`` defines the paths."""
        return self.predict_paths(features)

    def save(self, path: Path, card: dict[str, Any]) -> None:
        """Write weights, normalisation, spec and model card as safetensors."""
        save_network(self, path, asdict(self.spec), card)

    @classmethod
    def load(cls, path: Path) -> tuple[Self, dict[str, Any]]:
        """Return a model that ``save`` wrote, in evaluation mode, and its model card.

        Raises:
            InputError: If there is no such file, or it does not hold a root model.
        """
        where = "python -m trainers.supervised leaves one in runs/<name>/best/model.safetensors"
        model, card = load_network(path, lambda **spec: cls(RootSpec(**spec)), "root model", where)
        return model.eval(), card
