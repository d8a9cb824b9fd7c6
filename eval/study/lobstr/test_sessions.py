"""What LoBSTr is tested on: clips of performers that no training saw, and virtual users of other sizes who wear trackers as people do."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from agents.lobstr.spec import WINDOW_FRAMES
from datasets.library.sources import ROUGH_GROUND_KINDS, SYNTHETIC_SOURCE, load_clips
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import resample
from datasets.motion.rotation import to_matrix
from datasets.motion.t_pose import STANDING_HEIGHT
from datasets.synthetic.clips import synthetic_clips
from datasets.trackers.calibration import TrackerCalibration, calibrate_trackers, calibrated_joint_poses, rotation_calibrated_poses
from datasets.trackers.lower_body import leg_rotations, toe_contacts, toe_positions
from datasets.trackers.trackers import TRACKER_RATE_HZ, TrackerPoses, tracker_poses
from datasets.trackers.virtual_user import draw_tracker_placement, simulate_t_pose, simulate_trackers
from eval.recordings import TEST_FOLDERS
from eval.study.lobstr.variants import USER_HEIGHTS_CM

SITTING_PERFORMERS = 1000, 2  # seed and number of made-up people who sit down: no recorded test clip does
WEARINGS_PER_USER = 3  # times that each user puts the trackers on
T_POSE_SECONDS = 1.0
FREE = "free"
CATEGORY_BY_KIND = {  # Table 3's categories by what a clip's kind is; anything else is free
    "walk": "walk", "turn": "walk", "run": "run", "jog": "run", "dash": "run", "sit": "sit_stand", "squat": "sit_stand",
    "raise": "static", "wave": "static", "bow": "static", "bye": "static", "stand": "static",
}  # fmt: skip


@dataclass(frozen=True)
class EvaluationClip:
    """A clip at 45 Hz and what is true of its legs from the first frame on that has a second behind it."""

    __test__ = False  # whatever its name is

    motion: BodyMotion

    @cached_property
    def joints(self) -> TrackerPoses:
        """Of the joints that wear trackers, in all T frames."""
        return tracker_poses(self.motion)

    @cached_property
    def legs(self) -> np.ndarray:
        """Rotations of the eight joints, wxyz, shape (T - 45, 8, 4)."""
        return leg_rotations(self.motion.local_rotations[WINDOW_FRAMES:])

    @cached_property
    def toes(self) -> np.ndarray:
        """Toe-bases in the pelvis' frame [m], shape (T - 45, 2, 3)."""
        return toe_positions(to_matrix(self.legs))

    @cached_property
    def contacts(self) -> np.ndarray:
        """Of the toe-bases, bool, shape (T - 45, 2)."""
        return toe_contacts(self.motion)[WINDOW_FRAMES:]

    @property
    def category(self) -> str:
        """Of Table 3."""
        return CATEGORY_BY_KIND.get(self.motion.kind, FREE)

    @property
    def is_recorded(self) -> bool:
        """Whether somebody really moved so."""
        return self.motion.system != SYNTHETIC_SOURCE


@dataclass(frozen=True)
class Session:
    """A clip as performed by a virtual user.

    Attributes:
        clip: What is performed.
        height_cm: Of the user [cm].
        size_ratio: Of the user over the standard humanoid's.
        calibration: From the user's T-pose.
        trackers: What the four tell, at the user's size.
        seed: Of whatever else is random in it.
    """

    clip: EvaluationClip
    height_cm: int
    size_ratio: float
    calibration: TrackerCalibration
    trackers: TrackerPoses
    seed: tuple[int, ...]

    def joints(self, compensate_positions: bool) -> TrackerPoses:
        """Return what stands for the four joints on the standard humanoid: its places compensated as well, or rotations alone."""
        return (
            calibrated_joint_poses(self.calibration, self.trackers)
            if compensate_positions
            else rotation_calibrated_poses(self.calibration, self.trackers)
        )


def load_unseen_clips(data: Path) -> list[EvaluationClip]:
    """Return recorded clips on level ground that have a second and more, and made-up people who sit down and squat.

    Raises:
        InputError: If a folder is not there.
    """
    recorded = [
        clip for name in TEST_FOLDERS for clip in load_clips(data / name, fps=TRACKER_RATE_HZ) if clip.kind not in ROUGH_GROUND_KINDS
    ]
    seed, people = SITTING_PERFORMERS
    made_up = [resample(clip, TRACKER_RATE_HZ) for clip in synthetic_clips(seed, people) if CATEGORY_BY_KIND.get(clip.kind) == "sit_stand"]
    return [EvaluationClip(clip) for clip in [*recorded, *made_up] if len(clip) > WINDOW_FRAMES + 1]


def simulate_sessions(clips: Iterable[EvaluationClip]) -> list[Session]:
    """Return all clips by all users, each of whom wears the trackers in ``WEARINGS_PER_USER`` ways; seeds are fixed."""
    sessions = []
    clips = list(clips)
    for height in USER_HEIGHTS_CM:
        for time in range(WEARINGS_PER_USER):
            rng = np.random.default_rng((height, time))
            wearing = draw_tracker_placement(rng, height / 100.0)
            calibration = calibrate_trackers(simulate_trackers(simulate_t_pose(T_POSE_SECONDS, rng), wearing, rng))
            for index, clip in enumerate(clips):
                trackers = simulate_trackers(clip.joints, wearing, rng)
                sessions.append(Session(clip, height, height / 100.0 / STANDING_HEIGHT, calibration, trackers, (height, time, index)))
    return sessions
