"""What the stages of a cleaning made of a clip, and what of it a person should know."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from datasets.cleanup.foot_contacts import detect_foot_contacts
from datasets.cleanup.off_feet_spans import OffFeetSpan
from datasets.motion.clip import FPS, BodyMotion, Motion
from datasets.motion.frame_spans import true_spans
from datasets.motion.kinematics import resample, resample_to
from datasets.retarget.retarget import Retargeted, retarget_with
from envs.physics.overlap_memory import OverlapMemory
from envs.physics.self_collision import find_overlaps
from eval.clean.apply_edits import edited_contacts, frames_kept
from eval.clean.edits import Edits
from eval.clean.moved_joints import find_moved_spans
from eval.clean.notices import moved_line, overlap_line, pose_notices, root_notices
from eval.clean.restored_poses import RestoredPoses
from eval.clean.result import CleaningResult
from eval.clean.simulate_clip import SimulatedClip


class PlacedRecording(NamedTuple):
    """A recording on its ground.

    Attributes:
        retargeted: On the 20 bodies at its own rate.
        recorded: The same at 60 fps.
    """

    retargeted: Retargeted
    recorded: BodyMotion

    def cut(self, frames: slice, own: slice) -> "PlacedRecording":
        """Return some frames at 60 fps, and the same span at its own rate."""
        return PlacedRecording(self.retargeted.cut(own.start, own.stop), self.recorded.cut(frames.start, frames.stop))


def place_recording(recording: PlacedRecording, ground_m: float) -> PlacedRecording:
    """Return a recording on ground that is ``ground_m`` higher than was found [m]."""
    if not ground_m:
        return recording
    retargeted, found = recording
    moved = replace(retargeted, lift=retargeted.lift - retargeted.scale * ground_m)
    motion = replace(retarget_with(moved, retargeted.performer_clip.motion), rooted=retargeted.motion.rooted)
    return PlacedRecording(replace(moved, motion=motion), resample_to(motion, len(found), FPS))


class SolvedStages(NamedTuple):
    """What the stages made of a clip of T frames at 60 fps.

    Attributes:
        placed: Recording on its ground.
        found_poses: Restored poses before edits.
        poses: Restored poses as a person edited them.
        rooted: The same with a root.
        off_feet: Spans off the feet.
        flies: Frames in which the recorded root falls freely, shape (T,).
        repaired: Repaired without physics.
        simulated: Simulated as far as it is to be.
        stale: Frames that would be simulated, but were not, shape (T,).
        said: What a person said of both feet, shape (T, 2); None if nothing.
        usual_heights: Usual heights of the performer's left and right ankle over those of the 20 bodies [m].
    """

    placed: PlacedRecording
    found_poses: RestoredPoses
    poses: RestoredPoses
    rooted: BodyMotion
    off_feet: list[OffFeetSpan]
    flies: np.ndarray
    repaired: BodyMotion
    simulated: SimulatedClip
    stale: np.ndarray
    said: np.ndarray | None
    usual_heights: tuple[float, float]

    @property
    def contacts(self) -> np.ndarray:
        """Whether the left and the right foot stand, as a person said where one did, shape (T, 2)."""
        found = self.simulated.contacts
        return found if self.said is None else edited_contacts(found, self.said)


def compare_with_recording(
    stages: SolvedStages, output: Motion, edits: Edits, name: str, start_s: float, memory: OverlapMemory
) -> CleaningResult:
    """Return the result of a cleaning, without what is known from reading the file.

    Args:
        stages: What the stages made of the clip.
        output: Cleaned clip on the performer's own skeleton.
        edits: What a person changed.
        name: Name of the clip.
        start_s: Time of its first frame in the file [s].
        memory: Overlaps that were found in other versions of the clip.
    """
    placed, simulated, off_feet = stages.placed, stages.simulated, stages.off_feet
    cleaned = replace(resample(retarget_with(placed.retargeted, output), FPS), name=name)
    after_stage = {
        "restoring": stages.rooted,
        "planting feet and parting limbs": stages.repaired,
        "physics": simulated.motion,
        "holding feet": cleaned,
    }
    moved, overlaps = find_moved_spans(placed.recorded, after_stage, start_s), find_overlaps(cleaned, start_s, memory)
    kept = frames_kept(edits.spans, len(cleaned), FPS, start_s)
    return CleaningResult(
        name=name,
        before=placed.recorded,
        after=cleaned,
        contacts=np.where(kept[:, None], detect_foot_contacts(placed.recorded), stages.contacts) if kept.any() else stages.contacts,
        confidence=np.where(kept, 0.0, simulated.confidence),
        restarts=tuple(start_s + start / FPS for start in simulated.segment_starts[1:] if not kept[start]),
        assist=np.where(kept, 0.0, simulated.assist),
        notices=(
            *pose_notices(stages.found_poses, edits),
            *root_notices(stages.poses.motion, stages.rooted, off_feet, start_s),
            *([moved_line(moved)] if moved else []),
            *([overlap_line(overlaps)] if overlaps else []),
        ),
        misalignments=stages.found_poses.misalignments,
        moved=moved,
        overlaps=overlaps,
        start_s=start_s,
        found_contacts=None if edits.changes_nothing else simulated.contacts,
        off_feet=tuple(off_feet),
        stale=seconds_of(stages.stale & ~kept, start_s),
        kept_spans=seconds_of(kept, start_s),
        output=output,
        ground_m=edits.ground_m,
    )


def seconds_of(labels: np.ndarray, start_s: float) -> tuple[tuple[float, float], ...]:
    """Return the first instant of each run of labels (T,) and the one after its last [s]."""
    return tuple((start_s + start / FPS, start_s + stop / FPS) for start, stop in true_spans(labels).tolist())
