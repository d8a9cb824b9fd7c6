"""Some frames of a clip as the stages of cleaning take them: what the whole clip is needed for is known from when that was solved."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from datasets.cleanup.off_feet_spans import OffFeetSpan
from datasets.motion.clip import BodyMotion
from envs.physics.overlap_memory import OverlapMemory
from eval.clean.believed_root import LocatedRoot
from eval.clean.edits import Edits
from eval.clean.restored_poses import RestoredPoses
from eval.clean.simulate_clip import SimulatedClip
from eval.clean.solved_stages import PlacedRecording, SolvedStages
from eval.clean.stages import simulate_grounded_spans


@dataclass(frozen=True)
class ClipWindow:
    """Source of the stages of some frames of a clip that was solved before.

    Attributes:
        recording: The frames on the ground that was found.
        start_s: Time of the first one in the file [s].
        frames: Which frames they are of the whole clip, at 60 fps.
        solved: What the stages made of that.
        overlaps: Overlaps that were found in other versions of the clip.
    """

    recording: PlacedRecording
    start_s: float
    frames: slice
    solved: SolvedStages
    overlaps: OverlapMemory

    def restore(self, placed: PlacedRecording, edits: Edits) -> RestoredPoses:
        """Return the poses that the restoring network found."""
        found, restored = self.solved.found_poses, placed.recorded
        if found.motion is not self.solved.placed.recorded:
            restored = replace(restored, local_rotations=found.motion.local_rotations[self.frames])
        return found._replace(motion=restored, contacts=None if found.contacts is None else found.contacts[self.frames])

    def locate_root(self, placed: PlacedRecording, poses: RestoredPoses) -> LocatedRoot:
        """Return the frames with the root that the whole clip has."""
        solved, frames, rooted = self.solved, self.frames, poses.motion
        if solved.rooted is not solved.poses.motion:  # a root that the whole clip tells
            rooted = replace(rooted, root_position=solved.rooted.root_position[frames], rooted=solved.rooted.rooted)
        inside = [span for span in solved.off_feet if span.start < frames.stop and span.stop > frames.start]
        cut = [span._replace(start=max(span.start - frames.start, 0), stop=min(span.stop, frames.stop) - frames.start) for span in inside]
        return LocatedRoot(rooted, cut, solved.flies[frames])

    def simulate(
        self,
        edits: Edits,
        repaired: BodyMotion,
        off_feet: list[OffFeetSpan],
        contacts: np.ndarray | None,
        progress: Callable[[float], None],
    ) -> tuple[SimulatedClip, np.ndarray]:
        """Return the frames without physics."""
        return simulate_grounded_spans(None, repaired, off_feet, contacts, memory=self.overlaps), np.zeros(len(repaired), dtype=bool)

    def usual_heights(self, placed: PlacedRecording) -> tuple[float, float]:
        """Return the usual heights of the performer's ankles in the whole clip [m]."""
        return self.solved.usual_heights
