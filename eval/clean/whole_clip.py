"""A whole clip as the stages of cleaning take it: poses by the restoring network, a root that is believed or reconstructed, physics."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from agents.restore.model import RestoreModel
from datasets.cleanup.off_feet_spans import OffFeetSpan, find_off_feet_spans
from datasets.cleanup.performer_foot_lock import usual_height_offsets
from datasets.formats.bvh import Bvh
from datasets.imu.recording import measured_accelerations
from datasets.motion.clip import FPS, BodyMotion
from envs.physics.overlap_memory import OverlapMemory
from eval.clean.apply_edits import frames_of_quality, frames_without
from eval.clean.believed_root import LocatedRoot, locate_root
from eval.clean.edited_simulation import EditedSimulation, SearchMemory
from eval.clean.edits import PHYSICS, RESTORE, Edits
from eval.clean.quality import QUALITIES, Simulator
from eval.clean.restored_poses import RestoredPoses, restore_clip
from eval.clean.simulate_clip import SimulatedClip
from eval.clean.solved_stages import PlacedRecording
from eval.clean.stages import simulate_grounded_spans


class Models(Protocol):
    """What cleans: a ``CleaningPipeline``."""

    @property
    def simulator(self) -> Simulator | None:
        """Policy and settings of the search; None leaves physics out."""
        ...

    @property
    def restorer(self) -> RestoreModel | None:
        """Restoring network; None leaves poses as they were captured."""
        ...


@dataclass(frozen=True)
class WholeClip:
    """Source of the stages of a whole clip.

    Attributes:
        recording: Clip on the ground that was found.
        start_s: Time of the first frame in the file [s].
        bvh: Contents of the file, which may hold accelerations.
        models: What cleans.
        searches: Searches of the simulation that were made.
        overlaps: Overlaps that were found in other versions of the clip.
        physics: Whether parts that are to be simulated and were not yet are simulated now.
    """

    recording: PlacedRecording
    start_s: float
    bvh: Bvh
    models: Models
    searches: SearchMemory
    overlaps: OverlapMemory
    physics: bool

    def restore(self, placed: PlacedRecording, edits: Edits) -> RestoredPoses:
        """Return the poses that the restoring network finds."""
        restorer = None if RESTORE in edits.without else self.models.restorer
        return restore_clip(restorer, placed.recorded, find_off_feet_spans(placed.recorded))

    def locate_root(self, placed: PlacedRecording, poses: RestoredPoses) -> LocatedRoot:
        """Return the clip with the root of the recording, or Root3D's where that cannot be believed."""
        return locate_root(poses.motion, measured_accelerations(self.bvh, placed.retargeted, poses.motion))

    def simulate(
        self,
        edits: Edits,
        repaired: BodyMotion,
        off_feet: list[OffFeetSpan],
        contacts: np.ndarray | None,
        progress: Callable[[float], None],
    ) -> tuple[SimulatedClip, np.ndarray]:
        """Return the clip simulated as far as it is to be, and the frames that are stale, shape (T,)."""
        simulator = None if PHYSICS in edits.without else self.models.simulator
        if simulator and edits.quality:
            search = replace(QUALITIES[edits.quality], assist_force_bw=simulator.search.assist_force_bw)
            simulator = replace(simulator, search=search)
        grid = len(repaired), FPS, self.start_s
        without = frames_without(PHYSICS, edits.spans, *grid)
        parts = EditedSimulation(self.searches, without, frames_of_quality(edits.spans, *grid), self.physics)
        return simulate_grounded_spans(simulator, repaired, off_feet, contacts, progress, parts, self.overlaps), parts.stale

    def usual_heights(self, placed: PlacedRecording) -> tuple[float, float]:
        """Return the usual heights of the performer's ankles over those of the 20 bodies [m]."""
        return usual_height_offsets(placed.retargeted)
