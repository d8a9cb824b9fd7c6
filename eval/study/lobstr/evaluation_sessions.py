"""Test clips of LoBSTr, of performers that no training saw, and sessions of virtual users of other sizes with displaced trackers."""

from collections.abc import Iterable, Sequence
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
from datasets.trackers.trackers import ALL_TRACKER_NAMES, TRACKER_RATE_HZ, TrackerPoses, tracker_poses
from datasets.trackers.virtual_user import draw_tracker_placement, simulate_t_pose, simulate_trackers
from eval.evaluation_recordings import TEST_FOLDERS
from eval.study.lobstr.variants import USER_HEIGHTS_CM

SITTING_PERFORMERS = 1000, 2  # seed and number of synthetic performers who sit down: no recorded test clip does
WEARINGS_PER_USER = 3  # tracker placements of each user
T_POSE_SECONDS = 1.0
FREE = "free"
CATEGORY_BY_KIND = {  # Table 3's category by a clip's kind; any other kind is free
    "walk": "walk", "turn": "walk", "run": "run", "jog": "run", "dash": "run", "sit": "sit_stand", "squat": "sit_stand",
    "raise": "static", "wave": "static", "bow": "static", "bye": "static", "stand": "static",
}  # fmt: skip


@dataclass(frozen=True)
class EvaluationClip:
    """Test clip at 45 Hz, with the truth about its legs in all frames that have a second behind them."""

    __test__ = False  # no test case of pytest

    motion: BodyMotion

    @cached_property
    def joints(self) -> TrackerPoses:
        """Poses of the joints with trackers, in all T frames."""
        return tracker_poses(self.motion)

    @property
    def every_joint(self) -> TrackerPoses:
        """Poses of all joints that may have trackers, in all T frames."""
        return tracker_poses(self.motion, len(ALL_TRACKER_NAMES))

    @cached_property
    def legs(self) -> np.ndarray:
        """Rotations of the eight joints, wxyz, shape (T - 45, 8, 4)."""
        return leg_rotations(self.motion.local_rotations[WINDOW_FRAMES:])

    @cached_property
    def toes(self) -> np.ndarray:
        """Positions of the toe-bases in the pelvis' frame [m], shape (T - 45, 2, 3)."""
        return toe_positions(to_matrix(self.legs))

    @cached_property
    def contacts(self) -> np.ndarray:
        """Ground contacts of the toe-bases, bool, shape (T - 45, 2)."""
        return toe_contacts(self.motion)[WINDOW_FRAMES:]

    @property
    def category(self) -> str:
        """Category of Table 3."""
        return CATEGORY_BY_KIND.get(self.motion.kind, FREE)

    @property
    def is_recorded(self) -> bool:
        """Whether the clip was recorded rather than synthesised."""
        return self.motion.system != SYNTHETIC_SOURCE


@dataclass(frozen=True)
class Session:
    """Clip as performed by a virtual user.

    Attributes:
        clip: Clip that is performed.
        height_cm: Height of the user [cm].
        size_ratio: Size of the user over the standard humanoid's.
        calibration: Calibration from the user's T-pose.
        trackers: Poses of the trackers, at the user's size.
        seed: Seed of everything else that is random in the session.
    """

    clip: EvaluationClip
    height_cm: int
    size_ratio: float
    calibration: TrackerCalibration
    trackers: TrackerPoses
    seed: tuple[int, ...]

    def joints(self, compensate_positions: bool) -> TrackerPoses:
        """Return the poses of the joints on the standard humanoid, with rotations alone or places compensated as well."""
        return (
            calibrated_joint_poses(self.calibration, self.trackers)
            if compensate_positions
            else rotation_calibrated_poses(self.calibration, self.trackers)
        )


def load_unseen_clips(data: Path) -> list[EvaluationClip]:
    """Return recorded clips on level ground that are longer than a second, and synthetic clips of sitting down and squatting.

    Raises:
        InputError: If a folder is not there.
    """
    recorded = [
        clip for name in TEST_FOLDERS for clip in load_clips(data / name, fps=TRACKER_RATE_HZ) if clip.kind not in ROUGH_GROUND_KINDS
    ]
    seed, people = SITTING_PERFORMERS
    made_up = [resample(clip, TRACKER_RATE_HZ) for clip in synthetic_clips(seed, people) if CATEGORY_BY_KIND.get(clip.kind) == "sit_stand"]
    return [EvaluationClip(clip) for clip in [*recorded, *made_up] if len(clip) > WINDOW_FRAMES + 1]


def simulate_sessions(clips: Iterable[EvaluationClip], heights: Sequence[int] = USER_HEIGHTS_CM, legs: bool = False) -> list[Session]:
    """Return the sessions of all clips by all users, each with ``WEARINGS_PER_USER`` tracker placements; seeds are fixed.

    Args:
        clips: Clips that are performed.
        heights: Heights of the users [cm].
        legs: Whether they wear trackers on feet and shins as well.
    """
    sessions = []
    clips = list(clips)
    for height in heights:
        for time in range(WEARINGS_PER_USER):
            rng = np.random.default_rng((height, time))
            wearing = draw_tracker_placement(rng, height / 100.0, legs)
            calibration = calibrate_trackers(simulate_trackers(simulate_t_pose(T_POSE_SECONDS, rng, legs), wearing, rng))
            for index, clip in enumerate(clips):
                trackers = simulate_trackers(clip.every_joint if legs else clip.joints, wearing, rng)
                sessions.append(Session(clip, height, height / 100.0 / STANDING_HEIGHT, calibration, trackers, (height, time, index)))
    return sessions
