"""Learner of the recurrent root model: updates it on sequences of patches, by the path that they add up to.

B sequences of P patches. All is in the world's axes; half of each batch is mirrored.
"""

from typing import Any, NamedTuple

import torch

from agents.root.augmentation import mirror_bodies
from agents.root.model import RootModel
from agents.root.recurrent.patches import PATCH_FRAMES, PATCH_S, WINDOW_FRAMES, patch_features
from agents.root.recurrent.velocity_filter import PatchMotion, patch_displacements, patch_steps, patch_velocities
from datasets.cleanup.ballistic_flight import com_acceleration
from datasets.imu.root_features import LOWER_BODIES, STANCE_BODIES
from datasets.imu.sensor_model import SENSOR_BODIES
from datasets.motion.humanoid import BODY_COUNT
from trainers.algorithms.learner_state import get_state, set_state
from trainers.algorithms.schedules import linear_schedule
from trainers.supervised.clip_selection import evenly_spaced
from trainers.supervised.root_config import RootConfig
from trainers.supervised.root_data import RootClips, RootData, require_windows

HORIZONS = (1, 5, 25)  # patches over which displacements are compared, beside the whole sequence
MAX_GRADIENT_NORM = 1.0
JOINT_OFFSET_M = 0.02  # m, standard deviation of the constant offsets of joints, drawn anew for each sequence
MIN_DISTANCE_M = 1e-3  # m, under which the distance of the loss is smooth
NUM_NORMALISATION_SEQUENCES = 400
NUM_SCORED_SEQUENCES = 240  # of the held-out performer, at most
_REFLECTION = torch.tensor([1.0, -1.0, 1.0])


class Sequences(NamedTuple):
    """Sequences of patches, each with the frames that it sees.

    Attributes:
        joints: Joints relative to the pelvis [m], shape (B, P, 8, 20, 3).
        accelerations: Free accelerations of the sensors [m/s^2], shape (B, P, 8, 19, 3); None if the model sees none.
        felt: Mean free acceleration of the centre of mass during each patch [m/s^2], shape (B, P, 3).
        centre: Centre of mass relative to the pelvis in a patch's first frame and those after it [m], shape (B, P, 5, 3).
        heading: Heading of the pelvis in each patch's first frame [rad], shape (B, P).
        moved: True displacement of the pelvis in each patch [m], shape (B, P, 3).
    """

    joints: torch.Tensor
    accelerations: torch.Tensor | None
    felt: torch.Tensor
    centre: torch.Tensor
    heading: torch.Tensor
    moved: torch.Tensor


class RecurrentRootLearner:
    """Owns model, optimiser and the random order of sequences."""

    def __init__(self, config: RootConfig, data: RootData) -> None:
        """Build everything from the run's seed."""
        torch.manual_seed(config.seed)
        self.config = config.learner
        self.model = RootModel(config.model)
        self.random = torch.Generator().manual_seed(config.seed)
        frames = PATCH_FRAMES * (self.config.sequence - 1) + WINDOW_FRAMES
        self._training, self._starts = data.training, data.training.window_starts(frames)
        self._holdout, self._scored = data.holdout, evenly_spaced(data.holdout.window_starts(frames), NUM_SCORED_SEQUENCES)
        require_windows("training", self._starts, frames)
        require_windows("held-out", self._scored, frames)
        bodies = torch.tensor(config.model.bodies)
        is_sensor = torch.arange(len(bodies)) >= len(bodies) - len(SENSOR_BODIES) * 2 * config.model.accelerations
        self._column = bodies + BODY_COUNT * is_sensor  # which draw hides each vector: joints and sensors are hidden apart
        self._is_maskable = ~torch.isin(bodies, torch.tensor(LOWER_BODIES))
        self.model.fit_normalisation(self._features(self._sample(NUM_NORMALISATION_SEQUENCES)), torch.ones(1, WINDOW_FRAMES, 3))
        self.optimiser = torch.optim.Adam(self.model.parameters(), lr=self.config.learning_rate, weight_decay=self.config.weight_decay)

    @property
    def samples(self) -> int:
        """Number of patches of an update."""
        return self.config.batch

    def learning_rate(self, progress: float) -> float:
        """Return Adam's learning rate at a ``progress`` from 0 to 1."""
        return linear_schedule(self.config.learning_rate, self.config.final_learning_rate, progress)

    def update(self, progress: float) -> torch.Tensor:
        """Improve the model on one batch of random sequences; return its loss.

        Args:
            progress: Share of the training that is done.
        """
        for group in self.optimiser.param_groups:
            group["lr"] = self.learning_rate(progress)
        torch.manual_seed(int(torch.randint(2**62, (1,), generator=self.random)))  # of dropout, so that a resumed run drops the same
        sequences = _mirrored(self._sample(self.config.batch // self.config.sequence))
        features = self._hide(self._shift(self._features(sequences)))
        loss = path_loss(predict_displacements(self.model.train(), features, sequences) - sequences.moved)
        self.optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.model.parameters(), MAX_GRADIENT_NORM)
        self.optimiser.step()
        return loss.detach()

    @torch.inference_mode()
    def score(self) -> dict[str, float]:
        """Return the loss and the mean error of a sequence's end [mm] on sequences of the held-out performer."""
        self.model.eval()
        errors = []
        for starts in self._scored.split(self.config.batch // self.config.sequence):
            sequences = self._sequences(self._holdout, starts)
            errors.append(predict_displacements(self.model, self._features(sequences), sequences) - sequences.moved)
        every = torch.cat(errors)
        return {"loss": float(path_loss(every)), "sequence_end_error_mm": 1000.0 * float(every.sum(1).norm(dim=-1).mean())}

    def _sample(self, count: int) -> Sequences:
        """Return random sequences of the training clips."""
        return self._sequences(self._training, self._starts[torch.randint(len(self._starts), (count,), generator=self.random)])

    def _sequences(self, clips: RootClips, starts: torch.Tensor) -> Sequences:
        """Return the sequences that begin with the frames ``starts`` (B,)."""
        firsts = starts[:, None] + PATCH_FRAMES * torch.arange(self.config.sequence)
        seen, span = firsts[..., None] + torch.arange(WINDOW_FRAMES), firsts[..., None] + torch.arange(PATCH_FRAMES + 1)
        frames = clips.frames
        accelerations = frames.accelerations[seen] if self.model.spec.accelerations else None
        felt = torch.zeros(*firsts.shape, 3)
        if accelerations is not None:
            felt = torch.from_numpy(com_acceleration(accelerations[:, :, : PATCH_FRAMES + 1].mean(2).numpy())).float()
        moved = frames.root[firsts + PATCH_FRAMES] - frames.root[firsts]
        return Sequences(frames.joints[seen], accelerations, felt, frames.centre[span], frames.heading[firsts], moved)

    def _features(self, sequences: Sequences) -> torch.Tensor:
        """Return the features of sequences, shape (B, P, F)."""
        felt = None if sequences.accelerations is None else sequences.accelerations.flatten(0, 1)
        features = patch_features(sequences.joints.flatten(0, 1), sequences.heading.flatten(), felt)
        return features.view(*sequences.heading.shape, -1)

    def _shift(self, features: torch.Tensor) -> torch.Tensor:
        """Return features (B, P, F) in which each sequence has its joints elsewhere, but moving as they did.

        Skeletons disagree about where in a body a joint lies; velocities do not.
        """
        offsets = torch.randn(len(features), 1, 3 * BODY_COUNT, generator=self.random) * JOINT_OFFSET_M
        return torch.cat([features[..., : 3 * BODY_COUNT] + offsets, features[..., 3 * BODY_COUNT :]], -1)

    def _hide(self, features: torch.Tensor) -> torch.Tensor:
        """Return features (B, P, F) in which each sequence hides a share of the joints and sensors of trunk, head and arms.

        ``agents.root.augmentation`` says why.
        """
        hidden = torch.rand(len(features), 2 * BODY_COUNT, generator=self.random) < self.config.mask_share
        hidden = (hidden[:, self._column] & self._is_maskable).repeat_interleave(3, dim=1)
        return torch.where(hidden[:, None], self.model.feature_mean, features)

    def get_state(self) -> dict[str, Any]:
        """Return everything that the next update depends on."""
        return get_state(self.model, self.optimiser, self.random)

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to a state that ``get_state`` returned."""
        set_state(self.model, self.optimiser, self.random, state)


def predict_displacements(model: RootModel, features: torch.Tensor, sequences: Sequences) -> torch.Tensor:
    """Return the displacement of the pelvis in each patch [m], with gradients, shape (B, P, 3).

    Args:
        model: Recurrent model.
        features: Raw features, shape (B, P, F).
        sequences: Sequences of the features.
    """
    points = sequences.joints[:, :, : PATCH_FRAMES + 1, STANCE_BODIES]
    motion = PatchMotion(points, sequences.centre, sequences.felt, sequences.heading)
    steps = patch_steps(model.predict_outputs(features).flatten(0, 1), PatchMotion(*(part.flatten(0, 1) for part in motion)))
    steps = type(steps)(*(part.unflatten(0, features.shape[:2]).transpose(0, 1) for part in steps))  # patches first
    return patch_displacements(steps, patch_velocities(steps))[:, :, -1].transpose(0, 1)


def path_loss(errors: torch.Tensor) -> torch.Tensor:
    """Return the loss of the paths that patches add up to: the mean distance over each horizon, over the root of its seconds.

    Args:
        errors: Errors of the displacements in consecutive patches [m], shape (B, P, 3).
    """
    patches = errors.shape[1]
    path = torch.cat([torch.zeros_like(errors[:, :1]), errors.cumsum(1)], 1)
    losses = []
    for horizon in (*(horizon for horizon in HORIZONS if horizon < patches), patches):
        apart = path[:, horizon:] - path[:, :-horizon]
        losses.append((apart.square().sum(-1) + MIN_DISTANCE_M**2).sqrt().mean() / (horizon * PATCH_S) ** 0.5)
    return torch.stack(losses).sum()


def _mirrored(sequences: Sequences) -> Sequences:
    """Return sequences of which the first half is reflected in the plane of the world's x and z."""
    half = len(sequences.heading) // 2

    def reflected(vectors: torch.Tensor, twins: torch.Tensor | None = None) -> torch.Tensor:
        mine = vectors[:half] if twins is None else vectors[:half][..., twins, :]
        return torch.cat([mine * _REFLECTION, vectors[half:]])

    felt = sequences.accelerations
    return Sequences(
        reflected(sequences.joints, mirror_bodies(tuple(range(BODY_COUNT)))),
        None if felt is None else reflected(felt, mirror_bodies(SENSOR_BODIES)),
        reflected(sequences.felt),
        reflected(sequences.centre),
        torch.cat([-sequences.heading[:half], sequences.heading[half:]]),
        reflected(sequences.moved),
    )
