"""Network that predicts legs, toe contacts and a lost pelvis from whatever is tracked: residual LSTM layers, causal."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple, Self, cast

import torch
from torch import nn
from torch.nn import functional

from agents.lower_body.spec import LowerBodySpec
from agents.model_file import load_network, save_network
from datasets.trackers.joint_features import FEATURES_PER_JOINT, MASK_OF_FEATURE
from datasets.trackers.lower_body import LEG_BODIES, ROTATION_6D_SIZE, from_rotation_6d
from datasets.trackers.trackers import ALL_TRACKER_NAMES

NUM_ROTATIONS = 1 + len(LEG_BODIES)  # pelvis, then thigh, shin and foot, left and right
PARTS = NUM_ROTATIONS * ROTATION_6D_SIZE, 3, 2  # numbers of the rotations, of the pelvis' position, of the contacts
MASKS = 2  # of each joint: whether its position is tracked, whether its rotation is
MIN_STD = 1e-3  # least standard deviation of a feature, so that constant ones are not amplified
FORGET_BIAS = 2.0  # with which a layer's cell loses an eighth a frame before it is trained
MAX_FEATURE = 8.0  # standard deviations at which features are cut: a tracker that goes mad says no more than one that is far off


class LowerBodyPrediction(NamedTuple):
    """Output of the network for frames.

    Attributes:
        rotations: Rotation matrices of pelvis, thigh, shin and foot, left and right, shape (..., 7, 3, 3): those of pelvis and thighs
            relative to the reference frame, of shins and feet relative to their parents.
        pelvis: Position of the pelvis in the reference frame [m], shape (..., 3); for frames in which its tracker is not seen.
        contacts: Logits of the contact of each toe-base, shape (..., 2).
    """

    rotations: torch.Tensor
    pelvis: torch.Tensor
    contacts: torch.Tensor


LayerState = tuple[torch.Tensor, torch.Tensor]  # output and cell of a layer, shape (B, hidden) each


class LowerBodyModel(nn.Module):
    """Residual LSTM layers between a layer that reads features and one that writes poses; the statistics are part of the weights."""

    feature_mean: torch.Tensor
    feature_std: torch.Tensor
    pose_mean: torch.Tensor

    def __init__(self, spec: LowerBodySpec) -> None:
        """Build an untrained network."""
        super().__init__()
        self.spec = spec
        joints = len(ALL_TRACKER_NAMES)
        inputs = joints * (FEATURES_PER_JOINT + MASKS)
        self.read = nn.Sequential(nn.Linear(inputs, spec.hidden), nn.SiLU(), nn.Linear(spec.hidden, spec.hidden))
        self.norms = nn.ModuleList(nn.LayerNorm(spec.hidden) for _ in range(spec.layers))
        self.layers = nn.ModuleList(nn.LSTM(spec.hidden, spec.hidden, batch_first=True) for _ in range(spec.layers))
        with torch.no_grad():
            for layer in cast(list[nn.LSTM], self.layers):  # forget gates: an untrained layer remembers for a second
                layer.all_weights[0][2][spec.hidden : 2 * spec.hidden] += FORGET_BIAS
        self.write = nn.Sequential(
            nn.LayerNorm(spec.hidden), nn.Linear(spec.hidden, spec.hidden), nn.SiLU(), nn.Linear(spec.hidden, sum(PARTS))
        )
        self.dropout = nn.Dropout(spec.dropout)
        self.register_buffer("feature_mean", torch.zeros(joints, FEATURES_PER_JOINT))
        self.register_buffer("feature_std", torch.ones(joints, FEATURES_PER_JOINT))
        self.register_buffer("pose_mean", torch.zeros(sum(PARTS)))

    @torch.no_grad()
    def fit_normalisation(self, features: torch.Tensor, rotations: torch.Tensor, pelvis: torch.Tensor) -> None:
        """Set the normalisation to the statistics of frames in which everything is tracked.

        Args:
            features: Features of the joints, shape (..., 8, 15).
            rotations: True rotations as in ``LowerBodyPrediction``, shape (..., 7, 3, 3).
            pelvis: True positions of the pelvis, shape (..., 3).
        """
        flat = features.flatten(0, -3)
        self.feature_mean.copy_(flat.mean(0))
        self.feature_std.copy_(flat.std(0, correction=0).clamp(min=MIN_STD))
        six = torch.cat([rotations[..., 0], rotations[..., 2]], -1).flatten(-2)
        poses = torch.cat([six, pelvis], -1).flatten(0, -2).mean(0)
        self.pose_mean.copy_(functional.pad(poses, (0, PARTS[2])))

    def forward(self, features: torch.Tensor, masks: torch.Tensor) -> LowerBodyPrediction:
        """Return the predictions for consecutive frames, each from those up to it.

        Args:
            features: Features of the joints, shape (B, T, 8, 15).
            masks: Whether position and rotation of each joint are tracked, shape (B, T, 8, 2).
        """
        hidden = self.read(self._inputs(features, masks))
        for norm, layer in zip(self.norms, self.layers, strict=True):
            hidden = hidden + self.dropout(layer(norm(hidden))[0])
        return self._decode(self.write(hidden))

    def step(
        self, features: torch.Tensor, masks: torch.Tensor, states: Sequence[LayerState]
    ) -> tuple[LowerBodyPrediction, list[LayerState]]:
        """Return the predictions for one frame of B users, and the layers' states after it.

        Args:
            features: Features of the joints, shape (B, 8, 15).
            masks: Whether position and rotation of each joint are tracked, shape (B, 8, 2).
            states: States of the layers before the frame, all zero at the beginning.
        """
        hidden = self.read(self._inputs(features, masks))
        after: list[LayerState] = []
        for norm, layer, state in zip(self.norms, self.layers, states, strict=True):
            after.append(torch.lstm_cell(norm(hidden), state, *cast(nn.LSTM, layer).all_weights[0]))
            hidden = hidden + after[-1][0]
        return self._decode(self.write(hidden)), after

    def _inputs(self, features: torch.Tensor, masks: torch.Tensor) -> torch.Tensor:
        """Return normalised features with what is not tracked at zero, and the masks, shape (..., 136)."""
        mask = masks.to(features.dtype)
        normal = ((features - self.feature_mean) / self.feature_std).clamp(-MAX_FEATURE, MAX_FEATURE)
        return torch.cat([normal * mask[..., MASK_OF_FEATURE], mask], -1).flatten(-2)

    def _decode(self, written: torch.Tensor) -> LowerBodyPrediction:
        rotations, pelvis, contacts = (written.float() + self.pose_mean).split(PARTS, -1)
        return LowerBodyPrediction(from_rotation_6d(rotations.unflatten(-1, (NUM_ROTATIONS, ROTATION_6D_SIZE))), pelvis, contacts)

    def save(self, path: Path, card: dict[str, Any]) -> None:
        """Write weights, statistics, spec and model card as safetensors."""
        save_network(self, path, asdict(self.spec), card)

    @classmethod
    def load(cls, path: Path) -> tuple[Self, dict[str, Any]]:
        """Return a network that ``save`` wrote, in evaluation mode, and its model card.

        Raises:
            InputError: If there is no such file, or it does not hold such a network.
        """
        where = "python -m trainers.supervised --config configs/lower_body.yaml leaves one in runs/lower_body/best/model.safetensors"
        model, card = load_network(path, lambda **spec: cls(LowerBodySpec(**spec)), "lower-body network", where)
        return model.eval(), card
