"""Learner of a restoring network: updates it on windows of captured and true clips and scores it on the held-out performer."""

from typing import Any

import torch
from torch import nn
from torch.nn import functional

from agents.restore.features import heading_rotation
from agents.restore.kinematics import correct_rotations, joint_positions
from agents.restore.model import RestoreModel, RestorePrediction
from agents.restore.spec import PATCH_FRAMES, RESTORE_RATE_HZ, STEP_RATE_HZ
from configs.errors import InputError
from datasets.motion.humanoid import FOOT_AND_TOE_BODIES
from datasets.motion.rotation import conjugate, multiply, rotate, to_rotation_vector
from trainers.algorithms.learner_state import get_state, set_state
from trainers.algorithms.schedules import cosine_schedule
from trainers.runs.device import allow_tf32, resolve_device
from trainers.supervised.clip_selection import evenly_spaced
from trainers.supervised.losses import masked_mean, safe_norm
from trainers.supervised.restore_augmentation import augment_windows
from trainers.supervised.restore_config import RestoreConfig
from trainers.supervised.restore_data import RestoreData, RestoreFrames

NUM_NORMALISATION_WINDOWS = 256
NUM_SCORED_WINDOWS = 256  # of the held-out performer, at most
WARM_UP_SHARE = 0.01  # of the training, in which the learning rate rises
MAX_GRADIENT_NORM = 1.0
HEADING_STEPS = 15  # over which the difference of two headings is averaged, a second
_TOES = [toe for _, toe in FOOT_AND_TOE_BODIES]


class RestoreLearner:
    """Owns network, optimiser and the random order of windows."""

    def __init__(self, config: RestoreConfig, data: RestoreData) -> None:
        """Build everything from the run's seed."""
        torch.manual_seed(config.seed)
        self.config, self.device = config.learner, resolve_device(config.device)
        self.model = RestoreModel(config.model).to(self.device)
        self.random = torch.Generator().manual_seed(config.seed)  # of the CPU: a run may go on on another device
        self._frames = RestoreFrames(*(track.to(self.device) for track in data.frames))
        self._clips, self._window = data.training, config.model.window
        self._starts, scored = (clips.window_starts(self._shortest) for clips in (data.training, data.holdout))
        for name, starts in (("training", self._starts), ("held-out", scored)):
            if not len(starts):
                raise InputError(f"no {name} clip lasts {self.config.shortest_s:g} s; take longer clips or a smaller learner.shortest_s")
        self._scored = evenly_spaced(scored, NUM_SCORED_WINDOWS)
        self._scored_lengths = data.holdout.frames_left(self._scored).clamp(max=self._window)
        windows, mask = self._draw_windows(NUM_NORMALISATION_WINDOWS)
        self.model.fit_normalisation(augment_windows(self.config, windows, self.random).captured, mask)
        self.optimiser = torch.optim.AdamW(self.model.parameters(), lr=self.config.learning_rate, weight_decay=self.config.weight_decay)

    @property
    def samples(self) -> int:
        """Number of windows of an update."""
        return self.config.batch

    @property
    def _shortest(self) -> int:
        """Frames of the shortest pieces."""
        return min(round(self.config.shortest_s * RESTORE_RATE_HZ), self._window)

    def learning_rate(self, progress: float) -> float:
        """Return Adam's learning rate at a ``progress`` from 0 to 1."""
        falling = cosine_schedule(self.config.learning_rate, self.config.final_learning_rate, progress)
        return falling * min(1.0, (progress + 1e-4) / WARM_UP_SHARE)

    def update(self, progress: float) -> torch.Tensor:
        """Improve the network on one batch of random windows; return its loss.

        Args:
            progress: Share of the training that is done.
        """
        for group in self.optimiser.param_groups:
            group["lr"] = self.learning_rate(progress)
        windows, mask = self._draw_windows(self.config.batch)
        windows = augment_windows(self.config, windows, self.random)
        with allow_tf32(self.device):
            loss = self._losses(self.model.train()(windows.captured, mask), windows, mask)["loss"]
            self.optimiser.zero_grad()
            loss.backward()
        nn.utils.clip_grad_norm_(self.model.parameters(), MAX_GRADIENT_NORM)
        self.optimiser.step()
        return loss.detach()

    @torch.inference_mode()
    def score(self) -> dict[str, float]:
        """Return the errors on windows of the held-out performer."""
        self.model.eval()
        totals: dict[str, float] = {}
        for starts, lengths in zip(self._scored.split(32), self._scored_lengths.split(32), strict=True):
            windows, mask = self._windows(starts, lengths, self._window)
            windows = windows._replace(truth=windows.truth[:, ::PATCH_FRAMES])
            for name, value in self._losses(self.model(windows.captured, mask), windows, mask).items():
                totals[name] = totals.get(name, 0.0) + float(value) * len(starts) / len(self._scored)
        return totals

    def _losses(self, predicted: RestorePrediction, windows: RestoreFrames, mask: torch.Tensor) -> dict[str, torch.Tensor]:
        """Return the loss of windows with errors that a reader understands: in mm, degrees, cm/s and per cent."""
        truth = windows.truth
        captured, inside = windows.captured[:, ::PATCH_FRAMES], mask[:, ::PATCH_FRAMES]
        varying = predicted.varying
        restored = correct_rotations(captured, predicted.constant[:, None] + varying)
        true_joints = joint_positions(truth)
        away = self._distances(restored, truth, true_joints, inside)
        correction = to_rotation_vector(multiply(conjugate(captured), truth))
        count = inside.sum(1, keepdim=True)[..., None]
        constant = (correction * inside[..., None, None]).sum(1) / count
        rotation_error = to_rotation_vector(multiply(conjugate(restored), truth))
        moving = inside[:, 1:] & inside[:, :-1]
        velocity_error = away.diff(dim=1) * STEP_RATE_HZ
        toes = velocity_error[:, :, _TOES[0]] - velocity_error[:, :, _TOES[1]]
        stands = windows.contacts[:, ::PATCH_FRAMES, :2].amin(-1) > 0.5
        both = moving & stands[:, 1:] & stands[:, :-1]
        losses = {
            "position": masked_mean(safe_norm(away).mean(-1), inside),
            "velocity": masked_mean(safe_norm(velocity_error).mean(-1), moving),
            "constant": safe_norm(predicted.constant - constant).mean(),
            "rotation": masked_mean(safe_norm(rotation_error).mean(-1), inside),
            "stance": masked_mean(safe_norm(toes), both),
            "contact": masked_mean(
                functional.binary_cross_entropy_with_logits(predicted.contacts, windows.contacts, reduction="none").mean(-1), mask
            ),
            "root": masked_mean((predicted.root - windows.root).abs().mean(-1), mask),
            "uncertainty": _negative_log_likelihood(predicted.constant.detach() - constant, predicted.constant_log_std).mean()
            + masked_mean(
                _negative_log_likelihood(
                    safe_norm(varying.detach() - (correction - constant[:, None])) / 3.0**0.5, predicted.varying_log_std
                ).mean(-1),
                inside,
            ),
        }
        loss = sum((getattr(self.config, f"{name}_weight") * value for name, value in losses.items()), truth.new_zeros(()))
        if torch.is_grad_enabled():
            return {"loss": loss}
        right = ((predicted.contacts[..., :2] > 0.0) == (windows.contacts[..., :2] > 0.5)).float().mean(-1)
        return {
            "loss": loss,
            "restored_error_mm": 1000.0 * losses["position"],
            "before_mm": 1000.0 * masked_mean(safe_norm(self._distances(captured, truth, true_joints, inside)).mean(-1), inside),
            "contact_accuracy": 100.0 * masked_mean(right, mask),
            "constant_error_deg": torch.rad2deg(losses["constant"]),
            "constant_deg": torch.rad2deg(safe_norm(constant).mean()),
            "stance_cm_s": 100.0 * losses["stance"],
        }

    def _distances(self, rotations: torch.Tensor, truth: torch.Tensor, true_joints: torch.Tensor, mask: torch.Tensor) -> torch.Tensor:
        """Return the joints' offsets from the true ones with pelvises and headings aligned [m], shape (B, T, 20, 3)."""
        turn = _heading_lag(rotations[:, :, 0], truth[:, :, 0], mask)
        return joint_positions(rotations) - rotate(turn[:, :, None].expand(*true_joints.shape[:-1], 4), true_joints)

    def _draw_windows(self, count: int) -> tuple[RestoreFrames, torch.Tensor]:
        """Return windows of one random length with ``count`` times the frames of a whole one, and their masks.

        Half of the windows are whole ones; the others' logarithm of the length is uniform.
        """
        frames = self._window
        if torch.rand((), generator=self.random) < 0.5:
            longer = float(torch.rand((), generator=self.random))
            frames = round(self._shortest * (self._window / self._shortest) ** longer) // PATCH_FRAMES * PATCH_FRAMES
        starts = self._starts[torch.randint(len(self._starts), (count * self._window // frames,), generator=self.random)]
        return self._windows(starts, self._clips.frames_left(starts).clamp(max=frames), frames)

    def _windows(self, starts: torch.Tensor, lengths: torch.Tensor, frames: int) -> tuple[RestoreFrames, torch.Tensor]:
        """Return windows of ``frames`` frames from ``starts`` (B,) on and their masks (B, T), in which ``lengths`` (B,) frames count."""
        steps = torch.arange(frames)
        mask = steps < lengths[:, None]
        rows = (starts[:, None] + torch.minimum(steps, lengths[:, None] - 1)).to(self.device)
        return RestoreFrames(*(track[rows] for track in self._frames)), mask.to(self.device)

    def get_state(self) -> dict[str, Any]:
        """Return everything that the next update depends on."""
        return get_state(self.model, self.optimiser, self.random)

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to a state that ``get_state`` returned."""
        set_state(self.model, self.optimiser, self.random, state)


def _heading_lag(restored: torch.Tensor, truth: torch.Tensor, mask: torch.Tensor) -> torch.Tensor:
    """Return the rotation about the vertical between two pelvises (B, T, 4), averaged over about a second, shape (B, T, 4).

    The distance to the truth is measured with headings aligned (``align_drift``): nobody can tell where north is.
    """
    between = heading_rotation(multiply(restored, conjugate(truth))) * mask[..., None]
    near = between * (between * between[:, :1]).sum(-1, keepdim=True).sign()
    mean = functional.avg_pool1d(near.transpose(1, 2), HEADING_STEPS, 1, HEADING_STEPS // 2, count_include_pad=False).transpose(1, 2)
    return heading_rotation(mean)


def _negative_log_likelihood(error: torch.Tensor, log_std: torch.Tensor) -> torch.Tensor:
    """Return the negative logarithm of a Gaussian's density, less a constant."""
    return log_std + 0.5 * (error * torch.exp(-log_std)).square()
