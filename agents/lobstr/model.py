"""LoBSTr network: predicts leg rotations and toe contacts from the motion of four trackers (paper, section 3.2)."""

from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple, Self

import torch
from torch import nn

from agents.lobstr.encoders import make_encoder
from agents.lobstr.spec import LobstrSpec
from agents.model_file import load_network, save_network
from datasets.motion.rotation import Array
from datasets.trackers.lower_body import LEG_JOINTS, ROTATION_6D_SIZE, change_thigh_frame, from_rotation_6d, pelvis_tilt, to_rotation_6d

POSE_SIZE = len(LEG_JOINTS) * ROTATION_6D_SIZE
MIN_STD = 1e-4  # least standard deviation of a feature, so that nearly constant ones are not amplified


class LowerBodyPrediction(NamedTuple):
    """Output of the network for frames.

    Attributes:
        pose: Forward and up axes of the eight joints, not orthonormal; ``leg_matrices`` converts them, shape (..., 48).
        contact: Logits of each toe-base without and with contact, shape (..., 2, 2).
    """

    pose: torch.Tensor
    contact: torch.Tensor


def pose_targets(spec: LobstrSpec, poses: Array, pelvis: Array) -> Array:
    """Return the pose targets of a network, NumPy or torch, shape (..., 48).

    Args:
        spec: Spec of the network.
        poses: Forward and up axes of the eight joints relative to their parents, shape (..., 48).
        pelvis: Rotations of the pelvis in the world, shape (..., 4).
    """
    if not spec.upright:
        return poses
    legs = change_thigh_frame(_legs(poses), pelvis_tilt(pelvis))
    return to_rotation_6d(legs).reshape(poses.shape)


def leg_matrices(spec: LobstrSpec, predicted: Array, pelvis: Array) -> Array:
    """Return the rotation matrices of the eight joints relative to their parents, NumPy or torch, shape (..., 8, 3, 3).

    Args:
        spec: Spec of the network.
        predicted: Predicted pose, shape (..., 48).
        pelvis: Rotations of the pelvis in the world, shape (..., 4).
    """
    legs = _legs(predicted)
    return change_thigh_frame(legs, pelvis_tilt(pelvis).swapaxes(-1, -2)) if spec.upright else legs


def _legs(poses: Array) -> Array:
    return from_rotation_6d(poses.reshape(*poses.shape[:-1], len(LEG_JOINTS), ROTATION_6D_SIZE))


class LobstrModel(nn.Module):
    """Encoder, latent layer and two linear heads, with the statistics of features and poses as part of the weights."""

    feature_mean: torch.Tensor
    feature_std: torch.Tensor
    pose_mean: torch.Tensor

    def __init__(self, spec: LobstrSpec) -> None:
        """Build an untrained network."""
        super().__init__()
        self.spec = spec
        self.encoder = make_encoder(spec.encoder, spec.features, spec.hidden)
        self.to_latent = nn.Linear(spec.hidden, spec.latent)
        self.from_pose = nn.Linear(POSE_SIZE, spec.latent) if spec.autoregressive else None
        wide = spec.latent * (2 if spec.autoregressive else 1)
        self.to_pose, self.to_contact = nn.Linear(wide, POSE_SIZE), nn.Linear(wide, 4)
        self.register_buffer("feature_mean", torch.zeros(spec.features))
        self.register_buffer("feature_std", torch.ones(spec.features))
        self.register_buffer("pose_mean", torch.zeros(POSE_SIZE))

    @torch.no_grad()
    def fit_normalisation(self, features: torch.Tensor, poses: torch.Tensor) -> None:
        """Set the normalisation to the statistics of features (..., F) and poses (..., 48)."""
        self.feature_mean.copy_(features.flatten(0, -2).mean(0))
        self.feature_std.copy_(features.flatten(0, -2).std(0).clamp(min=MIN_STD))
        self.pose_mean.copy_(poses.flatten(0, -2).mean(0))

    def forward(self, features: torch.Tensor, poses_before: torch.Tensor | None = None) -> LowerBodyPrediction:
        """Return the predictions for all S = T - 44 frames that end a window of a second.

        Args:
            features: Raw features of consecutive frames, shape (B, T, F).
            poses_before: Poses one frame before the predicted ones, shape (B, S, 48); for the autoregressive network only.
        """
        return self.decode(self.encoder(self.normalise(features)), poses_before)

    def normalise(self, features: torch.Tensor) -> torch.Tensor:
        """Return features with zero mean and unit variance."""
        return (features - self.feature_mean) / self.feature_std

    def decode(self, state: torch.Tensor, pose_before: torch.Tensor | None = None) -> LowerBodyPrediction:
        """Return the predictions from encoder states (..., hidden) and, if autoregressive, the poses before (..., 48)."""
        latent = torch.relu(self.to_latent(state))
        if self.from_pose is not None:
            assert pose_before is not None
            latent = torch.cat([latent, self.from_pose(pose_before - self.pose_mean)], -1)
        return LowerBodyPrediction(self.to_pose(latent) + self.pose_mean, self.to_contact(latent).unflatten(-1, (2, 2)))

    def save(self, path: Path, card: dict[str, Any]) -> None:
        """Write weights, statistics, spec and model card as safetensors."""
        save_network(self, path, asdict(self.spec), card)

    @classmethod
    def load(cls, path: Path) -> tuple[Self, dict[str, Any]]:
        """Return a network that ``save`` wrote, in evaluation mode, and its model card.

        Raises:
            InputError: If there is no such file, or it does not hold a LoBSTr network.
        """
        where = "python -m trainers.supervised --config configs/lobstr.yaml leaves one in runs/lobstr/best/model.safetensors"
        model, card = load_network(path, lambda **spec: cls(LobstrSpec(**spec)), "LoBSTr network", where)
        return model.eval(), card
