"""Trackers of pieces of clips as users wear them: calibration errors, builds, other skeletons' conventions, noise, and lost trackers."""

import numpy as np
import torch

from datasets.motion.rotation import from_axis_angle, to_matrix
from datasets.trackers.calibration_errors import draw_calibration_errors
from datasets.trackers.joint_features import JointPoses
from datasets.trackers.trackers import ALL_TRACKER_NAMES, FOOT_TRACKERS, HEAD_TRACKER, PELVIS_TRACKER, SHIN_TRACKERS, TRACKER_NAMES
from trainers.supervised.lower_body_config import LowerBodyLearnerConfig

LONGEST_LOSS_FRAMES = 90  # for which a tracker is lost at most
# Standard deviations of the heading of IMUs, which know no north indoors: at a piece's beginning, and what it drifts by until the end.
IMU_HEADING_RAD, IMU_DRIFT_RAD = np.radians([4.0, 3.0])
_USUAL = len(TRACKER_NAMES)


class TrackerAugmentation:
    """Draws how the trackers of pieces are worn, what they measure wrongly and which are seen."""

    def __init__(self, config: LowerBodyLearnerConfig, seed: int, random: torch.Generator) -> None:
        """Draw the virtual users from ``seed``; everything else comes from ``random``."""
        self._config, self._random = config, random
        errors = draw_calibration_errors(config.users, np.random.default_rng(seed))
        self._scales, self._offsets, rotations = (torch.from_numpy(part.astype(np.float32)) for part in errors)
        self._rotations = to_matrix(rotations)

    def __call__(self, positions: torch.Tensor, rotations: torch.Tensor) -> JointPoses:
        """Return joints as seen through worn trackers.

        Args:
            positions: True positions of the joints of B pieces [m], shape (B, T, 8, 3).
            rotations: True rotation matrices, shape (B, T, 8, 3, 3).
        """
        positions, rotations = self._measure(*self._wear(*self._build(positions, rotations)))
        seen, oriented = self._draw_tracked(*positions.shape[:2])
        return JointPoses(positions, self._drift(rotations, oriented & ~seen), seen, oriented)

    def _normal(self, *size: int) -> torch.Tensor:
        return torch.randn(size, generator=self._random)

    def _uniform(self, *size: int) -> torch.Tensor:
        return torch.rand(size, generator=self._random)

    def _build(self, positions: torch.Tensor, rotations: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the joints of people with another length of trunk and arms, whose head is where it was in a T-pose, as is calibrated."""
        pieces = len(positions)
        scale = 1.0 + self._config.build * self._normal(pieces, 1, _USUAL, 1)
        scale[:, :, 2] = scale[:, :, 1]  # both arms
        scale[:, :, PELVIS_TRACKER] = 1.0
        pelvis = positions[:, :, PELVIS_TRACKER, None]
        moved = pelvis + scale * (positions[:, :, :_USUAL] - pelvis)
        return torch.cat([moved, positions[:, :, _USUAL:]], 2), rotations

    def _wear(self, positions: torch.Tensor, rotations: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the joints with the calibration errors of a user for each piece."""
        pieces = len(positions)
        user = torch.randint(len(self._rotations), (pieces,), generator=self._random)
        worn = self._uniform(pieces) >= self._config.perfect_share
        scales = torch.where(worn, self._scales[user], 1.0)
        offsets = torch.where(worn[:, None, None], self._offsets[user], 0.0)
        turns = torch.where(worn[:, None, None, None], self._rotations[user], torch.eye(3))
        turns = turns @ self._conventions(pieces)
        positions = scales[:, None, None, None] * positions + (rotations @ offsets[:, None, ..., None])[..., 0]
        return positions, rotations @ turns[:, None]

    def _conventions(self, pieces: int) -> torch.Tensor:
        """Return a constant pitch of pelvis and head for each piece, as matrices (B, 8, 3, 3)."""
        pitch = torch.zeros(pieces, len(ALL_TRACKER_NAMES))
        pitch[:, [HEAD_TRACKER, PELVIS_TRACKER]] = np.radians(self._config.convention_deg) * self._normal(pieces, 2)
        axis = torch.tensor([0.0, 1.0, 0.0]).expand(*pitch.shape, 3)
        return to_matrix(from_axis_angle(axis, pitch))

    def _measure(self, positions: torch.Tensor, rotations: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the joints with noise in each frame."""
        moved = self._config.position_noise_m * self._normal(*positions.shape)
        turned = _small_rotations(np.radians(self._config.rotation_noise_deg) * self._normal(*positions.shape))
        return positions + moved, rotations @ turned

    def _drift(self, rotations: torch.Tensor, is_imu: torch.Tensor) -> torch.Tensor:
        """Return the rotations, where ``is_imu`` (B, T, 8) with a heading that is wrong and drifts."""
        time = torch.linspace(0.0, 1.0, rotations.shape[1])[None, :, None]
        start, drift = self._normal(2, len(rotations), 1, rotations.shape[2])
        yaw = torch.where(is_imu, IMU_HEADING_RAD * start + IMU_DRIFT_RAD * drift * time, 0.0)
        return to_matrix(from_axis_angle(torch.tensor([0.0, 0.0, 1.0]).expand(*yaw.shape, 3), yaw)) @ rotations

    def _draw_tracked(self, pieces: int, frames: int) -> tuple[torch.Tensor, torch.Tensor]:
        """Return whether position and rotation of each joint are tracked, (B, T, 8) each.

        Some pieces have no pelvis tracker, some have trackers or IMUs on feet or shins, and some trackers are lost a while.
        """
        seen = torch.ones(pieces, frames, len(ALL_TRACKER_NAMES), dtype=torch.bool)
        seen[:, :, FOOT_TRACKERS] = (self._uniform(pieces) < self._config.feet_share)[:, None, None]
        seen[:, :, SHIN_TRACKERS] = (self._uniform(pieces) < self._config.shins_share)[:, None, None]
        lost = self._uniform(pieces, len(ALL_TRACKER_NAMES)) < self._config.lost_share
        start = (self._uniform(*lost.shape) * frames).long()
        stop = start + 1 + (self._uniform(*lost.shape) * LONGEST_LOSS_FRAMES).long()
        time = torch.arange(frames)[:, None]
        seen &= ~(lost[:, None] & (time >= start[:, None]) & (time < stop[:, None]))
        seen[:, :, PELVIS_TRACKER] &= (self._uniform(pieces) >= self._config.no_pelvis_share)[:, None]
        seen[:, :, HEAD_TRACKER] |= ~seen[:, :, PELVIS_TRACKER]  # one of the two is the reference
        is_imu = torch.zeros(pieces, 1, len(ALL_TRACKER_NAMES), dtype=torch.bool)
        is_imu[:, :, FOOT_TRACKERS], is_imu[:, :, SHIN_TRACKERS] = (
            (self._uniform(pieces, 1, 1) < self._config.imu_share) for _ in range(2)
        )
        return seen & ~is_imu, seen


def _small_rotations(v: torch.Tensor) -> torch.Tensor:
    """Return the rotation matrices (..., 3, 3) of small rotation vectors (..., 3) [rad], to the second order."""
    q = torch.cat([torch.ones_like(v[..., :1]), 0.5 * v], -1)
    return to_matrix(q / q.norm(dim=-1, keepdim=True))
