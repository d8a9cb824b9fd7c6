"""Learner of a LoBSTr network: updates it on pieces of clips (section 3.3) and scores it on the held-out performer."""

from typing import Any

import torch
from torch.nn import functional

from agents.lobstr.model import LobstrModel, LowerBodyPrediction, pose_targets
from agents.lobstr.spec import WINDOW_FRAMES
from configs.errors import InputError
from datasets.motion.rotation import from_axis_angle, multiply, rotate
from datasets.trackers.features import tracker_features
from datasets.trackers.lower_body import LEG_JOINTS, ROTATION_6D_SIZE, from_rotation_6d, toe_positions
from datasets.trackers.trackers import PELVIS_TRACKER
from trainers.algorithms.learner_state import get_state, set_state
from trainers.algorithms.schedules import exponential_schedule
from trainers.supervised.clip_selection import evenly_spaced
from trainers.supervised.lobstr_config import LobstrConfig
from trainers.supervised.lobstr_data import LobstrData
from trainers.supervised.losses import safe_norm

NUM_NORMALISATION_PIECES = 512
NUM_SCORED_PIECES = 512  # of the held-out performer, at most


class LobstrLearner:
    """Owns network, optimiser and the random order of pieces."""

    def __init__(self, config: LobstrConfig, data: LobstrData) -> None:
        """Build everything from the run's seed."""
        torch.manual_seed(config.seed)
        self.config = config.learner
        self.model = LobstrModel(config.model)
        self.random = torch.Generator().manual_seed(config.seed)
        self._length = WINDOW_FRAMES + self.config.predicted_frames  # one more than features: they are differences
        self._frames = data.frames._replace(poses=pose_targets(config.model, data.frames.poses, data.frames.rotations[:, PELVIS_TRACKER]))
        self._starts, scored = data.training.window_starts(self._length), data.holdout.window_starts(self._length)
        for name, starts in (("training", self._starts), ("held-out", scored)):
            if not len(starts):
                raise InputError(
                    f"no {name} clip has {self._length} frames at 45 Hz; take longer clips or a smaller learner.predicted_frames"
                )
        self._scored = evenly_spaced(scored, NUM_SCORED_PIECES)
        starts = self._sample_starts(NUM_NORMALISATION_PIECES)
        self.model.fit_normalisation(self._features(starts, noisy=True), self._frames.poses[starts])
        self.optimiser = torch.optim.Adam(self.model.parameters(), lr=self.config.learning_rate)

    @property
    def samples(self) -> int:
        """Number of predicted frames of an update."""
        return self.config.batch * self.config.predicted_frames

    def learning_rate(self, progress: float) -> float:
        """Return Adam's learning rate at a ``progress`` from 0 to 1."""
        return exponential_schedule(self.config.learning_rate, self.config.final_learning_rate, progress)

    def update(self, progress: float) -> torch.Tensor:
        """Improve the network on one batch of random pieces; return its loss.

        Args:
            progress: Share of the training that is done.
        """
        for group in self.optimiser.param_groups:
            group["lr"] = self.learning_rate(progress)
        self.model.train()
        loss = self._losses(self._sample_starts(self.config.batch), noisy=True)["loss"]
        self.optimiser.zero_grad()
        loss.backward()
        self.optimiser.step()
        return loss.detach()

    @torch.inference_mode()
    def score(self) -> dict[str, float]:
        """Return the errors on pieces of the held-out performer with perfect trackers."""
        self.model.eval()
        parts = [self._losses(starts, noisy=False) for starts in self._scored.split(64)]
        weights = [len(starts) / len(self._scored) for starts in self._scored.split(64)]
        return {name: float(sum(w * part[name] for w, part in zip(weights, parts, strict=True))) for name in parts[0]}

    def _losses(self, starts: torch.Tensor, noisy: bool) -> dict[str, torch.Tensor]:
        """Return the loss of pieces with the errors of toe-bases [cm] and contacts that are right [%], which a reader understands."""
        rows = starts[:, None] + torch.arange(WINDOW_FRAMES, self._length)
        poses, contacts = self._frames.poses[rows], self._frames.contacts[rows].long()
        before = self._frames.poses[rows - 1] if self.model.spec.autoregressive else None
        features = self._features(starts, noisy)
        with torch.autocast("cpu", torch.bfloat16, enabled=self.config.bfloat16):
            predicted = LowerBodyPrediction(*(part.float() for part in self.model(features, before)))
        toes, true_toes = _toe_base_positions(predicted.pose), _toe_base_positions(poses)
        distances = safe_norm(toes - true_toes)
        losses = {
            "pose": (predicted.pose - poses).abs().mean(),
            "kinematics": distances.mean(),
            "velocity": safe_norm(toes.diff(dim=1) - true_toes.diff(dim=1)).mean(),  # predicted minus predicted: docs/errata.md
            "contact": functional.cross_entropy(predicted.contact.flatten(0, 2), contacts.flatten()),
        }
        right = (predicted.contact.argmax(-1) == contacts).float().mean()
        loss = sum((getattr(self.config, f"{name}_weight") * value for name, value in losses.items()), torch.zeros(()))
        return {"loss": loss, "toe_error_cm": 100.0 * distances.mean(), "contact_accuracy": 100.0 * right}

    def _sample_starts(self, count: int) -> torch.Tensor:
        """Return the first frames of random pieces; clips are drawn in proportion to their frames (appendix 3)."""
        return self._starts[torch.randint(len(self._starts), (count,), generator=self.random)]

    def _features(self, starts: torch.Tensor, noisy: bool) -> torch.Tensor:
        """Return the input features of pieces, shape (B, ``WINDOW_FRAMES`` - 1 + ``predicted_frames``, F)."""
        rows = starts[:, None] + torch.arange(self._length)
        trackers = self._frames.positions[rows], self._frames.rotations[rows]
        positions, rotations = self._add_tracker_noise(*trackers) if noisy else trackers
        return tracker_features(self.model.spec.inputs, (positions[:, :-1], rotations[:, :-1]), (positions[:, 1:], rotations[:, 1:]))

    def _add_tracker_noise(self, positions: torch.Tensor, rotations: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the trackers with random placement on the body and with measurement noise (appendix 2)."""
        shape = positions.shape[:-1]

        def normal(*size: int) -> torch.Tensor:
            return torch.randn(size, generator=self.random)

        placement_offset = normal(shape[0], 1, shape[2], 3) * self.config.placement_std_m
        position_noise = functional.normalize(normal(*shape, 3), dim=-1) * normal(*shape, 1) * self.config.position_noise_m
        angle = torch.rand(shape, generator=self.random) * torch.deg2rad(torch.tensor(self.config.rotation_noise_deg))
        rotation_noise = from_axis_angle(functional.normalize(normal(*shape, 3), dim=-1), angle)
        return positions + rotate(rotations, placement_offset.expand(positions.shape)) + position_noise, multiply(rotations, rotation_noise)

    def get_state(self) -> dict[str, Any]:
        """Return everything that the next update depends on."""
        return get_state(self.model, self.optimiser, self.random)

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to a state that ``get_state`` returned."""
        set_state(self.model, self.optimiser, self.random, state)


def _toe_base_positions(poses: torch.Tensor) -> torch.Tensor:
    """Return the positions of the toe-bases (..., 2, 3) [m] in poses (..., 48)."""
    return toe_positions(from_rotation_6d(poses.unflatten(-1, (len(LEG_JOINTS), ROTATION_6D_SIZE))))
