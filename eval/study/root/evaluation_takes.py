"""Test takes of root models: clips of performers that no training saw, from optical capture and through simulated suits."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from agents.weights.pretrained import load_pretrained_restore
from datasets.imu.root_features import ROOT_RATE_HZ, RootFrames, root_frames
from datasets.imu.suit_simulation import simulate_suit
from datasets.library.sources import ROUGH_GROUND_KINDS, SYNTHETIC_SOURCE, load_clips
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import body_poses, lowest_point_heights, resample
from datasets.motion.rotation import heading
from datasets.synthetic.clips import synthetic_clips
from eval.clean.restored_poses import restore_clip
from eval.evaluation_recordings import IMU_POSES, OPTICAL_POSES, RESTORED_POSES, TEST_FOLDERS

STAIR_PERFORMERS = 1000, 2  # seed and number of synthetic performers on stairs; trainings have the seeds from 0 on
SUITS_PER_CLIP = 3  # simulated recordings of each clip
MIN_AIRBORNE_HEIGHT_M = 0.05  # height of the lowest point of the body above which it is in the air


@dataclass(frozen=True)
class EvaluationTake:
    """Test clip as a root model gets it, at 100 Hz.

    Attributes:
        truth: Clean clip.
        observed: Clip with the pose that the model sees: the clean pose, or that of a suit, restored or not.
        accelerations: Free accelerations of a simulated suit, whatever the pose [m/s^2], shape (N, 19, 3).
    """

    truth: BodyMotion
    observed: BodyMotion
    accelerations: np.ndarray

    @cached_property
    def frames(self) -> RootFrames:
        """Input of the model, frame by frame."""
        return root_frames(self.observed, self.accelerations, self.truth)

    @cached_property
    def heading(self) -> np.ndarray:
        """Heading of the true pelvis [rad], shape (N,)."""
        return heading(self.truth.local_rotations[:, 0])

    @cached_property
    def airborne(self) -> np.ndarray:
        """Whether the true body is off the ground, which is at height zero, shape (N,)."""
        return lowest_point_heights(*body_poses(self.truth)).min(axis=-1) > MIN_AIRBORNE_HEIGHT_M

    @property
    def is_recorded(self) -> bool:
        """Whether the clip was recorded rather than synthesised."""
        return self.truth.system != SYNTHETIC_SOURCE

    @property
    def is_on_stairs(self) -> bool:
        """Whether the clip is on stairs."""
        return self.truth.kind in ROUGH_GROUND_KINDS


TakesByPose = dict[str, list[EvaluationTake]]  # by kind of observed poses


def load_unseen_clips(data: Path) -> list[BodyMotion]:
    """Return the recorded test clips and synthetic clips on stairs, all at 100 Hz.

    Raises:
        InputError: If a folder is not there.
    """
    recorded = [clip for name in TEST_FOLDERS for clip in load_clips(data / name, fps=ROOT_RATE_HZ)]
    seed, people = STAIR_PERFORMERS
    made_up = [resample(clip, ROOT_RATE_HZ) for clip in synthetic_clips(seed, people) if clip.kind in ROUGH_GROUND_KINDS]
    return recorded + made_up


def simulate_takes(clips: Iterable[BodyMotion]) -> TakesByPose:
    """Return the takes of clips: one each with optical poses, ``SUITS_PER_CLIP`` with those of simulated suits, and as many restored.

    Seeds are fixed.
    """
    takes: TakesByPose = {OPTICAL_POSES: [], IMU_POSES: [], RESTORED_POSES: []}
    restorer = load_pretrained_restore()
    for index, clip in enumerate(clips):
        suits = [simulate_suit(clip, SUITS_PER_CLIP * index + suit) for suit in range(SUITS_PER_CLIP)]
        takes[OPTICAL_POSES].append(EvaluationTake(clip, clip, suits[0].accelerations))
        takes[IMU_POSES] += [EvaluationTake(clip, suit.faulty, suit.accelerations) for suit in suits]
        restored = [restore_clip(restorer, suit.faulty).motion for suit in suits]
        takes[RESTORED_POSES] += [EvaluationTake(clip, seen, suit.accelerations) for seen, suit in zip(restored, suits, strict=True)]
    return takes
