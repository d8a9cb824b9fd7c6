"""Learner of a root model: updates it on batches of windows and scores it on windows of the held-out performer."""

from typing import Any

import torch
from torch.nn import functional

from agents.root.augmentation import RootAugmentation
from agents.root.model import RootModel
from agents.root.windows import window_features, window_targets
from datasets.imu.root_features import to_heading_frame
from trainers.algorithms.learner_state import get_state, set_state
from trainers.algorithms.schedules import linear_schedule
from trainers.supervised.clip_selection import evenly_spaced
from trainers.supervised.root_config import RootConfig
from trainers.supervised.root_data import RootClips, RootData, require_windows

LOSSES = {"l1": functional.l1_loss, "mse": functional.mse_loss}
NUM_NORMALISATION_WINDOWS = 20_000
NUM_SCORED_WINDOWS = 20_000  # of the held-out performer, at most


class RootLearner:
    """Owns model, optimiser and the random order of windows."""

    def __init__(self, config: RootConfig, data: RootData) -> None:
        """Build everything from the run's seed."""
        torch.manual_seed(config.seed)
        self.config = config.learner
        self.model = RootModel(config.model)
        self.random = torch.Generator().manual_seed(config.seed)
        self._training, self._starts = data.training, data.training.window_starts(config.model.window * config.learner.sequence)
        self._holdout, self._scored = data.holdout, evenly_spaced(data.holdout.window_starts(config.model.window), NUM_SCORED_WINDOWS)
        require_windows("training", self._starts, config.model.window * config.learner.sequence)
        require_windows("held-out", self._scored, config.model.window)
        self._augment = RootAugmentation(config.model, self.config.mask_share)
        self.model.fit_normalisation(*self._windows(self._training, self._sample_starts(NUM_NORMALISATION_WINDOWS)))
        self.optimiser = torch.optim.Adam(self.model.parameters(), lr=self.config.learning_rate, weight_decay=self.config.weight_decay)

    @property
    def samples(self) -> int:
        """Number of windows of an update."""
        return self.config.batch

    def learning_rate(self, progress: float) -> float:
        """Return Adam's learning rate at a ``progress`` from 0 to 1."""
        return linear_schedule(self.config.learning_rate, self.config.final_learning_rate, progress)

    def update(self, progress: float) -> torch.Tensor:
        """Improve the model on one batch of random windows; return its loss.

        Args:
            progress: Share of the training that is done.
        """
        for group in self.optimiser.param_groups:
            group["lr"] = self.learning_rate(progress)
        starts = self._sample_starts(self.config.batch)
        features, targets = self._windows(self._training, starts)
        features, targets = self._augment(features, targets, self.model.feature_mean, self.random)
        predicted = self.model.train().predict_paths(features)
        loss = self._loss(predicted, targets)
        if self.config.sequence > 1:
            loss = loss + self._drift_loss(predicted - targets, starts)
        self.optimiser.zero_grad()
        loss.backward()
        self.optimiser.step()
        return loss.detach()

    @torch.inference_mode()
    def score(self) -> dict[str, float]:
        """Return the loss and the mean error of a window's end [mm] on windows of the held-out performer."""
        self.model.eval()
        losses, ends = [], []
        for starts in self._scored.split(4096):
            features, targets = self._windows(self._holdout, starts)
            predicted = self.model(features)
            losses.append(self._loss(predicted, targets) * len(starts))
            ends.append((predicted - targets)[:, -1].norm(dim=-1).sum() * 1000.0)
        count = len(self._scored)
        return {"loss": float(sum(losses) / count), "window_end_error_mm": float(sum(ends) / count)}

    def _loss(self, predicted: torch.Tensor, targets: torch.Tensor) -> torch.Tensor:
        """Return the loss of paths (B, W, 3) [m], each in units of its standard deviation."""
        std = self.model.target_std
        return LOSSES[self.config.loss](predicted / std, targets / std)

    def _drift_loss(self, errors: torch.Tensor, starts: torch.Tensor) -> torch.Tensor:
        """Return how far the windows of a sequence drift together, in units of the standard deviation of one window's end.

        Args:
            errors: Errors of predicted paths [m], in each window's own axes, shape (B, W, 3).
            starts: First frames of the windows, shape (B,).
        """
        headings = self._training.frames.heading[starts].view(-1, self.config.sequence)
        turned = headings - headings[:, :1]
        turned[: len(turned) // 2] *= -1.0  # the mirrored ones
        together = to_heading_frame(errors[:, -1], -turned.flatten()).view(*turned.shape, 3).sum(1)
        return (together / self.model.target_std[-1]).abs().mean() / self.config.sequence**0.5

    def _sample_starts(self, count: int) -> torch.Tensor:
        """Return the first frames of random sequences of consecutive windows, one sequence after the other."""
        first = self._starts[torch.randint(len(self._starts), (count // self.config.sequence,), generator=self.random)]
        return (first[:, None] + self.model.spec.window * torch.arange(self.config.sequence)).flatten()

    def _windows(self, clips: RootClips, starts: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        spec = self.model.spec
        return window_features(spec, clips.frames, starts), window_targets(spec, clips.frames, starts)

    def get_state(self) -> dict[str, Any]:
        """Return everything that the next update depends on."""
        return get_state(self.model, self.optimiser, self.random)

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to a state that ``get_state`` returned."""
        set_state(self.model, self.optimiser, self.random, state)
