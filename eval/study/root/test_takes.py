"""What root models are tested on: clips of performers that no training saw, as optical capture and as simulated suits have them."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from datasets.imu.root_features import RATE, RootFrames, root_frames
from datasets.imu.suit_simulation import simulate_suit
from datasets.library.sources import ROUGH_GROUND_KINDS, SYNTHETIC, load_clips
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import body_poses, lowest_points, resample
from datasets.motion.rotation import heading
from datasets.synthetic.clips import synthetic_clips
from eval.recordings import FOLDERS, IMU, OPTICAL

CLIMBERS = 1000, 2  # seed and number of made-up people who take stairs; trainings have the seeds from 0 on
SUITS = 3  # recordings of each clip
AIRBORNE = 0.05  # m, of the lowest point of the body


@dataclass(frozen=True)
class Take:
    """A test clip as a root model gets it, at 100 Hz.

    Attributes:
        truth: The clean clip.
        seen: The clip with the pose that the model sees: the clean one's, or that of a suit.
        accelerations: Of a suit in any case [m/s^2], shape (N, 19, 3).
    """

    truth: BodyMotion
    seen: BodyMotion
    accelerations: np.ndarray

    @cached_property
    def frames(self) -> RootFrames:
        """What the model sees, frame by frame."""
        return root_frames(self.seen, self.accelerations, self.truth)

    @cached_property
    def heading(self) -> np.ndarray:
        """Of the true pelvis [rad], shape (N,)."""
        return heading(self.truth.local_rotations[:, 0])

    @cached_property
    def airborne(self) -> np.ndarray:
        """Whether the true body touches no ground, which is at zero, shape (N,)."""
        return lowest_points(*body_poses(self.truth)).min(axis=-1) > AIRBORNE

    @property
    def recorded(self) -> bool:
        """Whether somebody really moved so."""
        return self.truth.system != SYNTHETIC

    @property
    def climbs(self) -> bool:
        """Whether it is on stairs."""
        return self.truth.kind in ROUGH_GROUND_KINDS


Takes = dict[str, list[Take]]  # by the poses that are seen


def unseen_clips(data: Path) -> list[BodyMotion]:
    """Return the recorded clips and made-up people on stairs, all at 100 Hz.

    Raises:
        InputError: If a folder is not there.
    """
    recorded = [clip for name in FOLDERS for clip in load_clips(data / name, fps=RATE)]
    seed, people = CLIMBERS
    made_up = [resample(clip, RATE) for clip in synthetic_clips(seed, people) if clip.kind in ROUGH_GROUND_KINDS]
    return recorded + made_up


def wear_suits(clips: Iterable[BodyMotion]) -> Takes:
    """Return takes of clips: with optical poses one of each, with those of simulated suits ``SUITS``; seeds are fixed."""
    takes: Takes = {OPTICAL: [], IMU: []}
    for index, clip in enumerate(clips):
        suits = [simulate_suit(clip, SUITS * index + suit) for suit in range(SUITS)]
        takes[OPTICAL].append(Take(clip, clip, suits[0].accelerations))
        takes[IMU] += [Take(clip, suit.faulty, suit.accelerations) for suit in suits]
    return takes
