"""The cleaning pipeline, BVH in, clean BVH out: each stage is one line of ``CleaningPipeline.clean``."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Self

import numpy as np

from agents.restore.model import RestoreModel
from agents.weights.pretrained import PRETRAINED_POLICY, load_pretrained_restore
from datasets.cleanup.off_feet_spans import OffFeetSpan, find_off_feet_spans
from datasets.cleanup.performer_foot_lock import lock_performer_feet
from datasets.formats.bvh import Bvh
from datasets.imu.recording import measured_accelerations
from datasets.motion.clip import FPS, BodyMotion, Motion
from datasets.motion.kinematics import resample, resample_to
from datasets.performer.performer_clip import performer_clip_from_bvh
from datasets.performer.reading_options import ReadingOptions
from datasets.retarget.plausibility import find_implausible
from datasets.retarget.read_as import describe_reading
from datasets.retarget.retarget import Retargeted, retarget, retarget_with
from datasets.retarget.transfer_back import to_performer_bvh, to_zero_ground, transfer_back
from envs.physics.self_collision import find_overlaps
from eval.clean.believed_root import locate_root
from eval.clean.misalignments import misalignment_notice
from eval.clean.moved_joints import find_moved_spans, moved_notice
from eval.clean.progress import COMPARING, REPAIRING, RESTORING, RETARGETING, ROOT, SIMULATING, TRANSFERRING, WRITING
from eval.clean.remaining_overlaps import overlap_notice
from eval.clean.restored_poses import RestoredPoses, restore_clip
from eval.clean.result import CleaningResult
from eval.clean.samcon import GOOD, QUALITIES, SearchSettings, Simulator
from eval.clean.simulate_clip import SimulatedClip
from eval.clean.stages import frame_mask, repair_kinematically, simulate_grounded_spans
from trainers.algorithms.policy_file import load_policy

RESTORE, PHYSICS = "restore", "physics"
STAGES = (RESTORE, PHYSICS)  # that can be left out


@dataclass(frozen=True)
class CleaningPipeline:
    """The stages of cleaning with a policy and a restoring network.

    Attributes:
        simulator: Policy and settings of the search; None leaves physics out.
        restorer: Restoring network; None leaves the poses of suits as they were captured.
    """

    simulator: Simulator | None
    restorer: RestoreModel | None = None

    @classmethod
    def load(cls, threads: int, path: Path = PRETRAINED_POLICY, search: SearchSettings | None = None) -> Self:
        """Return the pipeline with the policy of a file, the package's by default, and the package's restoring network.

        Args:
            threads: Native threads of the simulation.
            path: File of the policy.
            search: Settings of the search; by default those of good quality.

        Raises:
            InputError: If there is no such file, or it holds no policy.
        """
        policy, _, spec = load_policy(path)
        return cls(Simulator(policy, spec, threads, search or QUALITIES[GOOD]), load_pretrained_restore())

    def without(self, stages: Collection[str]) -> Self:
        """Return the pipeline without some of ``STAGES``."""
        restorer = None if RESTORE in stages else self.restorer
        return replace(self, restorer=restorer, simulator=None if PHYSICS in stages else self.simulator)

    def clean(
        self,
        bvh: Bvh,
        name: str,
        reading: ReadingOptions | None = None,
        truth: BodyMotion | None = None,
        progress: Callable[[str, float], None] = lambda _stage, _share: None,
    ) -> tuple[Bvh, CleaningResult]:
        """Return a cleaned clip: the BVH to write, and the clip before and after for the report.

        Args:
            bvh: Parsed input file.
            name: Name of the clip in messages and in the report.
            reading: Joint names, unit, axes, rate and ground that the user gave.
            truth: Clean clip behind the input at 60 fps, where it is known; measured in the report, never used.
            progress: Called with the name of each stage of ``eval.clean.progress`` as it begins, and with the share of it that is done.

        Raises:
            InputError: If no human skeleton is found in the file.
        """
        progress(RETARGETING, 0.0)
        performer = performer_clip_from_bvh(bvh, name, reading)  # own skeleton, in metres, Z up
        retargeted = retarget(performer)  # 20 bodies, own rate
        recorded = resample(retargeted.motion, FPS)
        start_s = performer.dropped_frames / performer.motion.fps
        read, read_as = (*performer.notices, *find_implausible(retargeted)), describe_reading(retargeted)
        progress(RESTORING, 0.0)
        poses = restore_clip(self.restorer, recorded, find_off_feet_spans(recorded))
        progress(ROOT, 0.0)
        rooted, off_feet = locate_root(poses.motion, measured_accelerations(bvh, retargeted, poses.motion))
        progress(REPAIRING, 0.0)
        repaired = repair_kinematically(rooted, off_feet, poses.contacts)
        progress(SIMULATING, 0.0)
        simulated = simulate_grounded_spans(self.simulator, repaired, off_feet, poses.contacts, partial(progress, SIMULATING))
        progress(TRANSFERRING, 0.0)
        output = _to_performer(retargeted, simulated, off_feet)  # own skeleton again, own rate
        cleaned = replace(resample(retarget_with(retargeted, output), FPS), name=name)
        progress(COMPARING, 0.0)
        restarts = tuple(start_s + start / FPS for start in simulated.segment_starts[1:])
        after_stage = {
            "restoring": rooted,
            "planting feet and parting limbs": repaired,
            "physics": simulated.motion,
            "holding feet": cleaned,
        }
        moved = find_moved_spans(recorded, after_stage, start_s)
        overlaps = find_overlaps(cleaned, start_s)
        notices = (
            *read,
            *_pose_notices(poses),
            *_root_notices(rooted is not poses.motion, off_feet, start_s),
            *([moved_notice(moved)] if moved else []),
            *([overlap_notice(overlaps)] if overlaps else []),
        )
        result = CleaningResult(
            name,
            recorded,
            cleaned,
            simulated.contacts,
            simulated.confidence,
            restarts,
            simulated.assist,
            notices,
            poses.misalignments,
            moved,
            overlaps,
            truth,
            read_as,
            performer.damage,
            start_s,
        )
        progress(WRITING, 0.0)
        written = to_performer_bvh(bvh, performer, output)
        return (to_zero_ground(written, retargeted) if performer.reading.zero_ground else written), result


def _to_performer(retargeted: Retargeted, simulated: SimulatedClip, off_feet: list[OffFeetSpan]) -> Motion:
    """Return a simulated clip on its performer's skeleton at the recording's own rate, with locked feet.

    Contacts and level ground are those of the nearest frame at 60 fps.
    """
    motion = resample_to(simulated.motion, len(retargeted.motion), retargeted.motion.fps)
    frames = len(simulated.contacts)
    nearest = np.minimum(np.arange(len(motion)) * FPS / motion.fps + 0.5, frames - 1).astype(int)
    level = ~frame_mask(off_feet, frames)[nearest]
    return lock_performer_feet(transfer_back(retargeted, motion), retargeted, simulated.contacts[nearest], level)


def _pose_notices(poses: RestoredPoses) -> tuple[str, ...]:
    """Return what a person should know of the poses of a clip, if they were corrected or could not be."""
    if poses.unknown_poses:
        return ("The poses are unlike those of the suits that the restoring network knows; they were not corrected.",)
    return () if poses.contacts is None else (misalignment_notice(poses.misalignments),)


def _root_notices(reconstructed: bool, off_feet: list[OffFeetSpan], start_s: float) -> tuple[str, ...]:
    """Return what a person should know of the root of a clip that begins at ``start_s`` in its file, one line each."""
    guessed = "The recording does not say where the pelvis went, or lets the figure hover; its path was reconstructed."
    rootless = [guessed] if reconstructed else []
    seconds = [(start_s + span.start / FPS, start_s + span.stop / FPS) for span in off_feet]
    spans = [
        f"Somebody {span.reason} from {start:.1f} s to {stop:.1f} s: not for feet on level ground, left to itself."
        for span, (start, stop) in zip(off_feet, seconds, strict=True)
    ]
    return (*rootless, *spans)
