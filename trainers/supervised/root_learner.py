"""One update of a root model from a batch of windows, and its error on windows that it does not learn from."""

from typing import Any

import torch
from torch.nn import functional

from agents.root.augmentation import RootAugmentation
from agents.root.model import RootModel
from agents.root.windows import window_features, window_targets
from configs.errors import InputError
from datasets.imu.root_features import ROOT_RATE_HZ, to_heading_frame
from trainers.algorithms.learner_state import get_state, set_state
from trainers.supervised.root_config import RootConfig
from trainers.supervised.root_data import PackedClips, RootData

LOSSES = {"l1": functional.l1_loss, "mse": functional.mse_loss}
NUM_NORMALISATION_WINDOWS = 20_000  # windows from which the normalisation is taken
NUM_SCORED_WINDOWS = 20_000  # windows of the held-out performer that a score looks at


class RootLearner:
    """Owns model, optimiser and the random order of windows."""

    def __init__(self, config: RootConfig, data: RootData) -> None:
        """Build everything from the run's seed."""
        torch.set_num_threads(config.learner.threads)
        torch.manual_seed(config.seed)
        self.config = config.learner
        self.model = RootModel(config.model)
        self.random = torch.Generator().manual_seed(config.seed)
        self._training, self._starts = data.training, data.training.window_starts(config.model.window * config.learner.sequence)
        self._holdout, self._scored = data.holdout, _evenly_spaced_windows(data.holdout, config.model.window)
        for name, windows in (("training", self._starts), ("held-out", self._scored)):
            if not len(windows):
                raise InputError(
                    f"no {name} clip is as long as {config.model.window * config.learner.sequence + 1} frames at {ROOT_RATE_HZ:g} Hz; "
                    "take longer clips, a smaller learner.sequence, or another data.holdout"
                )
        self._augment = RootAugmentation(config.model, self.config.mask_share)
        self.model.fit_normalisation(*self._windows(self._training, self._sample_starts(NUM_NORMALISATION_WINDOWS)))
        self.optimiser = torch.optim.Adam(self.model.parameters(), lr=self.config.learning_rate, weight_decay=self.config.weight_decay)

    @property
    def samples(self) -> int:
        """Windows of an update."""
        return self.config.batch

    def learning_rate(self, progress: float) -> float:
        """Return Adam's rate at a share ``progress`` of the training."""
        return self.config.learning_rate + progress * (self.config.final_learning_rate - self.config.learning_rate)

    def update(self, progress: float) -> torch.Tensor:
        """Improve the model on one batch of random windows; return its loss.

        Args:
            progress: Share of the training that lies behind.
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
        """Return the error on windows of the held-out performer: the loss, and that of the end of a window [mm]."""
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
        """Return the loss of paths (B, W, 3) [m] in units of their standard deviations."""
        std = self.model.target_std
        return LOSSES[self.config.loss](predicted / std, targets / std)

    def _drift_loss(self, errors: torch.Tensor, starts: torch.Tensor) -> torch.Tensor:
        """Return how far the windows of a sequence drift together, in standard deviations of one window's end.

        Args:
            errors: Of predicted paths [m], in each window's own axes, shape (B, W, 3).
            starts: First frames of the windows, shape (B,).
        """
        headings = self._training.frames.heading[starts].view(-1, self.config.sequence)
        turned = headings - headings[:, :1]
        turned[: len(turned) // 2] *= -1.0  # which were mirrored
        together = to_heading_frame(errors[:, -1], -turned.flatten()).view(*turned.shape, 3).sum(1)
        return (together / self.model.target_std[-1]).abs().mean() / self.config.sequence**0.5

    def _sample_starts(self, count: int) -> torch.Tensor:
        """Return the starts of random windows: sequences of windows that follow one another, one sequence after the other."""
        first = self._starts[torch.randint(len(self._starts), (count // self.config.sequence,), generator=self.random)]
        return (first[:, None] + self.model.spec.window * torch.arange(self.config.sequence)).flatten()

    def _windows(self, clips: PackedClips, starts: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        spec = self.model.spec
        return window_features(spec, clips.frames, starts), window_targets(spec, clips.frames, starts)

    def get_state(self) -> dict[str, Any]:
        """Return everything that the next update depends on."""
        return get_state(self.model, self.optimiser, self.random)

    def set_state(self, state: dict[str, Any]) -> None:
        """Go back to a state that ``get_state`` returned."""
        set_state(self.model, self.optimiser, self.random, state)


def _evenly_spaced_windows(clips: PackedClips, window: int) -> torch.Tensor:
    """Return up to ``SCORED`` windows, evenly over all clips."""
    starts = clips.window_starts(window)
    return starts[:: max(1, -(-len(starts) // NUM_SCORED_WINDOWS))]
