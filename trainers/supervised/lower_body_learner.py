"""Learner of a lower-body network: updates it on pieces of clips through worn trackers and scores it on the held-out performer."""

from typing import Any, NamedTuple, cast

import torch
from torch import nn
from torch.nn import functional
from torch.optim.swa_utils import AveragedModel

from agents.lower_body.model import LowerBodyModel, LowerBodyPrediction
from configs.errors import InputError
from datasets.motion.rotation import to_matrix
from datasets.trackers.joint_features import JointPoses, joint_features, reference_frame
from datasets.trackers.lower_body import LEG_JOINTS, leg_joint_positions
from datasets.trackers.trackers import PELVIS_TRACKER, TRACKER_NAMES, TRACKER_RATE_HZ
from trainers.algorithms.learner_state import get_state, set_state
from trainers.algorithms.schedules import cosine_schedule
from trainers.supervised.clip_selection import ClipSelection, evenly_spaced
from trainers.supervised.losses import masked_mean, safe_norm
from trainers.supervised.lower_body_augmentation import TrackerAugmentation
from trainers.supervised.lower_body_config import LowerBodyConfig
from trainers.supervised.lower_body_data import LowerBodyData

NUM_NORMALISATION_PIECES = 256
NUM_SCORED_PIECES = 128  # of the held-out performer, at most
SHORTEST_FRAMES = 47  # of a clip that anything is learnt from: a second's
WARM_UP_SHARE = 0.02  # of the training, in which the learning rate rises
MAX_GRADIENT_NORM = 1.0
AVERAGE_WARM_UP = 10  # updates, of which the average forgets the first quickly
_THIGHS = [0, 3]  # among the six leg joints


class Pieces(NamedTuple):
    """Pieces of clips, padded by their last frames.

    Attributes:
        positions: True positions of the joints that may be tracked [m], shape (B, T, 8, 3).
        rotations: True rotation matrices of these joints, shape (B, T, 8, 3, 3).
        legs: True rotation matrices of thighs in the world, of shins and feet relative to their parents, shape (B, T, 6, 3, 3).
        contacts: Contacts of the toe-bases, 0 or 1, shape (B, T, 2).
        inside: Whether each frame is one of the clip, shape (B, T).
    """

    positions: torch.Tensor
    rotations: torch.Tensor
    legs: torch.Tensor
    contacts: torch.Tensor
    inside: torch.Tensor


class LowerBodyLearner:
    """Owns network, optimiser and the random order of pieces."""

    def __init__(self, config: LowerBodyConfig, data: LowerBodyData) -> None:
        """Build everything from the run's seed."""
        torch.manual_seed(config.seed)
        self.config = config.learner
        self._network = LowerBodyModel(config.model)
        self.random = torch.Generator().manual_seed(config.seed)
        self._augment = TrackerAugmentation(config.learner, config.seed, self.random)
        frames = data.frames
        self._positions, self._rotations, self._contacts = frames.positions, to_matrix(frames.rotations), frames.contacts
        self._legs = to_matrix(frames.legs)
        self._legs[:, _THIGHS] = self._rotations[:, PELVIS_TRACKER, None] @ self._legs[:, _THIGHS]
        self._training, self._holdout = data.training, data.holdout
        self._drawn, self._scored = _long_frames(data.training), data.holdout.window_starts(self.config.frames)
        if not len(self._scored):  # only short clips
            self._scored = torch.tensor([clip.start for clip in data.holdout.clips if clip.frames >= SHORTEST_FRAMES], dtype=torch.long)
        for name, rows in (("training", self._drawn), ("held-out", self._scored)):
            if not len(rows):
                raise InputError(f"no {name} clip lasts a second; take longer clips")
        self._scored = evenly_spaced(self._scored, NUM_SCORED_PIECES)
        pieces = self._draw(NUM_NORMALISATION_PIECES)
        joints = self._augment(pieces.positions, pieces.rotations)
        rotations, pelvis = _targets(pieces, joints.seen)
        every = torch.ones_like(joints.seen)  # legs are tracked too rarely
        self._network.fit_normalisation(_features(joints._replace(seen=every, oriented=every)), rotations, pelvis)
        self._averaged = AveragedModel(self._network, avg_fn=self._average)
        self.optimiser = torch.optim.AdamW(self._network.parameters(), lr=self.config.learning_rate, weight_decay=self.config.weight_decay)

    @property
    def model(self) -> LowerBodyModel:
        """Network whose weights are averages over the last updates: the one that is scored and kept."""
        return cast(LowerBodyModel, self._averaged.module)

    @property
    def samples(self) -> int:
        """Number of frames of an update."""
        return self.config.batch * self.config.frames

    def learning_rate(self, progress: float) -> float:
        """Return AdamW's learning rate at a ``progress`` from 0 to 1."""
        falling = cosine_schedule(self.config.learning_rate, self.config.final_learning_rate, progress)
        return falling * min(1.0, (progress + 1e-4) / WARM_UP_SHARE)

    def update(self, progress: float) -> torch.Tensor:
        """Improve the network on one batch of random pieces; return its loss.

        Args:
            progress: Share of the training that is done.
        """
        for group in self.optimiser.param_groups:
            group["lr"] = self.learning_rate(progress)
        self._network.train()
        pieces = self._draw(self.config.batch)
        loss = self._losses(self._network, pieces, self._augment(pieces.positions, pieces.rotations))["loss"]
        self.optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self._network.parameters(), MAX_GRADIENT_NORM)
        self.optimiser.step()
        self._averaged.update_parameters(self._network)
        return loss.detach()

    @torch.inference_mode()
    def score(self) -> dict[str, float]:
        """Return the errors on pieces of the held-out performer with perfect trackers on head, hands and pelvis."""
        self.model.eval()
        totals: dict[str, float] = {}
        for starts in self._scored.split(32):
            pieces = self._cut(starts, self._holdout.frames_left(starts))
            seen = torch.zeros(pieces.positions.shape[:3], dtype=torch.bool)
            seen[..., : len(TRACKER_NAMES)] = True
            for name, value in self._losses(self.model, pieces, JointPoses(pieces.positions, pieces.rotations, seen, seen)).items():
                totals[name] = totals.get(name, 0.0) + float(value) * len(starts) / len(self._scored)
        return totals

    def _average(self, average: torch.Tensor, now: torch.Tensor, updates: torch.Tensor | int) -> torch.Tensor:
        """Return the average of weights after another of ``updates``."""
        return average.lerp(now, 1.0 - min(self.config.average, float(updates) / (float(updates) + AVERAGE_WARM_UP)))

    def _losses(self, network: nn.Module, pieces: Pieces, joints: JointPoses) -> dict[str, torch.Tensor]:
        """Return the loss of pieces, and errors that a reader understands: in degrees, cm and per cent."""
        with torch.autocast("cpu", torch.bfloat16, enabled=self.config.bfloat16):
            written = network(_features(joints), torch.stack([joints.seen, joints.oriented], -1))
        predicted = LowerBodyPrediction(*(part.float() for part in written))
        true_rotations, true_pelvis = _targets(pieces, joints.seen)
        inside = pieces.inside.clone()
        inside[:, : self.config.skipped_frames] = False
        moving = inside[:, 1:] & inside[:, :-1]
        known = joints.seen[..., PELVIS_TRACKER, None]
        rotations = torch.cat(
            [torch.where(known[..., None, None], true_rotations[:, :, :1], predicted.rotations[:, :, :1]), predicted.rotations[:, :, 1:]], 2
        )
        pelvis = torch.where(known, true_pelvis, predicted.pelvis)
        points, true_points = (
            leg_joint_positions(turned) + place[..., None, None, :]
            for turned, place in ((rotations, pelvis), (true_rotations, true_pelvis))
        )
        away = points - true_points  # (B, T, 2, 3, 3)
        chords = safe_norm((rotations - true_rotations).flatten(-2)) * 0.5**0.5
        # Both frames of a difference are in the reference frame of their own; the turn between them moves the true points as well.
        frame, origin = reference_frame(JointPoses(pieces.positions, pieces.rotations, joints.seen, joints.oriented))
        toes = (frame[:, :, None] @ points[:, :, :, 2, :, None])[..., 0] + origin[:, :, None]
        stands = pieces.contacts[:, 1:] * pieces.contacts[:, :-1] * moving[..., None]
        slide = safe_norm(toes.diff(dim=1)) * TRACKER_RATE_HZ
        velocity = safe_norm(away[:, :, :, 1:].diff(dim=1)) * TRACKER_RATE_HZ
        losses = {
            "rotation": masked_mean(chords.mean(-1), inside),
            "position": masked_mean(safe_norm(away).mean((-1, -2)), inside),
            "velocity": masked_mean(velocity.mean((-1, -2)), moving),
            "foot_lock": (slide * stands).sum() / stands.sum().clamp(min=1.0),
            "contact": masked_mean(
                functional.binary_cross_entropy_with_logits(predicted.contacts, pieces.contacts, reduction="none").mean(-1), inside
            ),
        }
        loss = sum((getattr(self.config, f"{name}_weight") * value for name, value in losses.items()), torch.zeros(()))
        if torch.is_grad_enabled():
            return {"loss": loss}
        angles = 2.0 * torch.asin((0.5 * chords[:, :, 1:]).clamp(max=1.0))
        right = ((predicted.contacts > 0.0) == (pieces.contacts > 0.5)).float().mean(-1)
        return {
            "loss": loss,
            "contact_accuracy": 100.0 * masked_mean(right, inside),
            "rotation_error_deg": torch.rad2deg(masked_mean(angles.sum(-1), inside)) / len(LEG_JOINTS),
            "toe_error_cm": 100.0 * masked_mean(safe_norm(away[:, :, :, 2]).mean(-1), inside),
            "stance_cm_s": 100.0 * losses["foot_lock"],
        }

    @property
    def _both(self) -> nn.Module:
        """Network that is trained, and the average of its weights."""
        return nn.ModuleList([self._network, self._averaged])

    def _draw(self, count: int) -> Pieces:
        """Return random pieces, in which every frame of the training clips is as likely as every other."""
        length = self.config.frames
        rows = self._drawn[torch.randint(len(self._drawn), (count,), generator=self.random)]
        left = self._training.frames_left(rows)
        first = rows + left - self._training.lengths(rows)
        starts = rows - (torch.rand(count, generator=self.random) * length).long()
        starts = torch.maximum(torch.minimum(starts, rows + left - length), first)
        pieces = self._cut(starts, rows + left - starts)
        pieces.positions[..., 2] += self.config.floor_m * torch.randn(count, 1, 1, generator=self.random)
        return pieces

    def _cut(self, starts: torch.Tensor, left: torch.Tensor) -> Pieces:
        """Return the pieces from ``starts`` (B,) on, of clips with ``left`` (B,) frames from there on."""
        steps = torch.arange(self.config.frames)
        rows = starts[:, None] + torch.minimum(steps, left[:, None] - 1)
        tracks = (self._positions, self._rotations, self._legs, self._contacts)
        return Pieces(*(track[rows] for track in tracks), inside=steps < left[:, None])

    def get_state(self) -> dict[str, Any]:
        """Return everything that the next update depends on."""
        return get_state(self._both, self.optimiser, self.random)

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to a state that ``get_state`` returned."""
        set_state(self._both, self.optimiser, self.random, state)


def _long_frames(clips: ClipSelection) -> torch.Tensor:
    """Return the frames of all clips that are long enough."""
    ranges = [torch.arange(clip.start, clip.start + clip.frames) for clip in clips.clips if clip.frames >= SHORTEST_FRAMES]
    return torch.cat(ranges) if ranges else torch.zeros(0, dtype=torch.long)


def _features(joints: JointPoses) -> torch.Tensor:
    """Return the features of pieces, in whose first frame nothing was seen before."""
    before = JointPoses(*(torch.cat([part[:, :1], part[:, :-1]], 1) for part in joints))
    before.seen[:, 0] = before.oriented[:, 0] = False
    return joint_features(before, joints)


def _targets(pieces: Pieces, seen: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Return the true rotations (B, T, 7, 3, 3), and positions of the pelvis (B, T, 3) [m], relative to the true reference frame."""
    frame, origin = reference_frame(JointPoses(pieces.positions, pieces.rotations, seen, seen))
    back = frame.transpose(-1, -2)[:, :, None]
    pelvis = back @ pieces.rotations[:, :, PELVIS_TRACKER, None]
    thighs = back @ pieces.legs[:, :, _THIGHS]
    rotations = torch.cat([pelvis, thighs[:, :, :1], pieces.legs[:, :, 1:3], thighs[:, :, 1:], pieces.legs[:, :, 4:]], 2)
    return rotations, ((pieces.positions[:, :, PELVIS_TRACKER] - origin)[:, :, None] @ frame)[:, :, 0]
