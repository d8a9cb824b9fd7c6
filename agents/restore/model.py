"""Restoring network: from the poses of a captured clip to the rotations that correct them, foot contacts and the root's movement.

B windows of T frames, T as in the spec; a mask says which of them belong to the clip.
"""

from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple, Self

import torch
from torch import nn
from torch.nn import functional

from agents.model_file import load_network, save_network
from agents.restore.features import FEATURE_COUNT, pose_features
from agents.restore.spec import PATCH_FRAMES, RestoreSpec
from datasets.motion.humanoid import BODY_COUNT

NUM_CONTACTS = 6  # left and right foot; left heel and toe, right heel and toe
NUM_ROOT_VALUES = 3  # height of the pelvis [m], its velocity ahead and to the left in its heading [m/s]
_VARYING = BODY_COUNT * 3
_OUTPUTS = [_VARYING, BODY_COUNT, PATCH_FRAMES * NUM_CONTACTS, PATCH_FRAMES * NUM_ROOT_VALUES]  # of each step
_USUAL_LOG_STD = -3.0  # log rad, of 3 degrees, from which standard deviations are learnt
MIN_STD = 1e-2  # least standard deviation of a feature, so that nearly constant ones are not amplified


class RestorePrediction(NamedTuple):
    """Prediction of B windows of T frames and S steps; a step's corrections are those of its first frame.

    Attributes:
        constant: Part of the correction that is constant over the window, rotation vectors in each body's own frame [rad],
            shape (B, 20, 3).
        constant_log_std: Logarithm of the standard deviation of ``constant``'s error [log rad], shape (B, 20, 3).
        varying: Part of the correction that varies, without mean over the window [rad], shape (B, S, 20, 3).
        varying_log_std: Logarithm of the standard deviation of its error, the same of all axes [log rad], shape (B, S, 20).
        contacts: Logits of contact of the left and the right foot, and of heel and toe of each, shape (B, T, 6).
        root: Height of the pelvis [m] and its velocity ahead and to the left in its heading [m/s], shape (B, T, 3).
    """

    constant: torch.Tensor
    constant_log_std: torch.Tensor
    varying: torch.Tensor
    varying_log_std: torch.Tensor
    contacts: torch.Tensor
    root: torch.Tensor


class _Block(nn.Module):
    """Residual block: normalisation and a dilated convolution over three steps, as one matrix."""

    def __init__(self, channels: int, dilation: int) -> None:
        super().__init__()
        self.dilation = dilation
        self.norm = nn.LayerNorm(channels)
        self.mix = nn.Linear(3 * channels, channels)

    def forward(self, x: torch.Tensor, mask: torch.Tensor) -> torch.Tensor:
        """Return (B, S, C) from (B, S, C); steps outside the clip stay out of the convolution."""
        seen = functional.pad(functional.relu(self.norm(x)) * mask, (0, 0, self.dilation, self.dilation))
        steps = x.shape[1]
        near = [seen[:, at : at + steps] for at in (0, self.dilation, 2 * self.dilation)]
        return x + self.mix(torch.cat(near, dim=-1))


class RestoreModel(nn.Module):
    """Network with the statistics of its features as part of the weights."""

    feature_mean: torch.Tensor
    feature_std: torch.Tensor

    def __init__(self, spec: RestoreSpec) -> None:
        """Build an untrained model, which corrects nothing."""
        super().__init__()
        self.spec, c = spec, spec.channels
        self.register_buffer("feature_mean", torch.zeros(FEATURE_COUNT))
        self.register_buffer("feature_std", torch.ones(FEATURE_COUNT))
        self.enter = nn.Linear(PATCH_FRAMES * FEATURE_COUNT, c)
        self.blocks = nn.ModuleList(_Block(c, dilation) for dilation in spec.dilations)
        self.feedback = nn.ModuleDict(
            {str(at): nn.Sequential(nn.Linear(2 * c, c), nn.ReLU(), nn.Linear(c, c)) for at in spec.pooled_blocks}
        )
        self.leave = nn.LayerNorm(c)
        self.steps = nn.Linear(c, sum(_OUTPUTS))
        out = nn.Linear(c, 2 * _VARYING)
        self.constants = nn.Sequential(nn.Linear(2 * c, c), nn.ReLU(), out)
        for last in (self.steps, out):
            nn.init.normal_(last.weight, std=1e-3)
            nn.init.zeros_(last.bias)

    @torch.no_grad()
    def fit_normalisation(self, rotations: torch.Tensor, mask: torch.Tensor) -> None:
        """Set the normalisation to the statistics of the features of windows (B, T, 20, 4), of the frames in the mask (B, T)."""
        features = pose_features(rotations)[mask]
        self.feature_mean.copy_(features.mean(0))
        self.feature_std.copy_(features.std(0).clamp(min=MIN_STD))

    def forward(self, rotations: torch.Tensor, mask: torch.Tensor) -> RestorePrediction:
        """Return the prediction for windows.

        Args:
            rotations: Captured rotations of the bodies in the world, wxyz, shape (B, T, 20, 4); anything outside the mask.
            mask: Which frames belong to the clip, bool, shape (B, T); each window begins with one.
        """
        batch, frames = mask.shape
        steps = frames // PATCH_FRAMES
        inside = mask.to(rotations.dtype)[..., None]
        features = (pose_features(rotations) - self.feature_mean) / self.feature_std * inside
        weight = inside.view(batch, steps, PATCH_FRAMES).amax(-1, keepdim=True)
        x = self.enter(features.view(batch, steps, -1))
        for index, block in enumerate(self.blocks):
            if str(index) in self.feedback:
                x = x + self.feedback[str(index)](_pool(x, weight))[:, None]
            x = block(x, weight)
        x = self.leave(x)
        varying, varying_log_std, contacts, root = self.steps(x).split(_OUTPUTS, -1)
        mean = (varying * weight).sum(1, keepdim=True) / weight.sum(1, keepdim=True)
        constant, constant_log_std = self.constants(_pool(x, weight)).view(batch, 2, BODY_COUNT, 3).unbind(1)
        constant = constant + mean.view(batch, BODY_COUNT, 3)  # so that each step has its say in what is constant
        return RestorePrediction(
            constant,
            constant_log_std + _USUAL_LOG_STD,
            (varying - mean).view(batch, steps, BODY_COUNT, 3),
            varying_log_std + _USUAL_LOG_STD,
            contacts.reshape(batch, frames, NUM_CONTACTS),
            root.reshape(batch, frames, NUM_ROOT_VALUES),
        )

    def save(self, path: Path, card: dict[str, Any]) -> None:
        """Write weights, normalisation, spec and model card as safetensors."""
        save_network(self, path, asdict(self.spec), card)

    @classmethod
    def load(cls, path: Path) -> tuple[Self, dict[str, Any]]:
        """Return a model that ``save`` wrote, in evaluation mode, and its model card.

        Raises:
            InputError: If there is no such file, or it does not hold a restoring network.
        """
        where = "python -m trainers.supervised --config configs/restore.yaml leaves one in runs/<name>/best/model.safetensors"
        model, card = load_network(path, lambda **spec: cls(RestoreSpec(**spec)), "restoring network", where)
        return model.eval(), card


def _pool(x: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    """Return mean and standard deviation over steps (B, 2 C) of (B, S, C), weighted (B, S, 1)."""
    total = weight.sum(1)
    mean = (x * weight).sum(1) / total
    variance = ((x - mean[:, None]).square() * weight).sum(1) / total
    return torch.cat([mean, (variance + 1e-6).sqrt()], -1)
