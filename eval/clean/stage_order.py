"""The stages of a cleaning in their order, the same for a whole clip and for the seconds around an edit.

What differs between the two is where poses, root and simulation come from: their ``StageSource``.
"""

from collections.abc import Callable, Hashable
from functools import partial
from typing import Protocol

import numpy as np

from datasets.cleanup.foot_contacts import drop_missed_steps
from datasets.cleanup.off_feet_spans import OffFeetSpan
from datasets.motion.clip import FPS, BodyMotion, Motion
from envs.physics.overlap_memory import OverlapMemory
from eval.clean.apply_edits import edit_poses, said_contacts
from eval.clean.believed_root import LocatedRoot
from eval.clean.edits import RESTORE, Edits
from eval.clean.performer_output import to_performer
from eval.clean.progress import REPAIRING, RESTORING, ROOT, SIMULATING, TRANSFERRING
from eval.clean.restored_poses import RestoredPoses
from eval.clean.simulate_clip import SimulatedClip
from eval.clean.solved_stages import PlacedRecording, SolvedStages, place_recording
from eval.clean.stage_memory import StageMemory
from eval.clean.stages import repair_kinematically


class StageSource(Protocol):
    """T frames at 60 fps to clean: a ``WholeClip``, or a ``ClipWindow`` of one."""

    @property
    def recording(self) -> PlacedRecording:
        """The frames on the ground that was found."""
        ...

    @property
    def start_s(self) -> float:
        """Time of the first frame in the file [s]."""
        ...

    @property
    def overlaps(self) -> OverlapMemory:
        """Overlaps that were found in other versions of the clip."""
        ...

    def restore(self, placed: PlacedRecording, edits: Edits) -> RestoredPoses:
        """Return restored poses before edits of them."""
        ...

    def locate_root(self, placed: PlacedRecording, poses: RestoredPoses) -> LocatedRoot:
        """Return the clip with a root, the very motion of ``poses`` where that of the recording is believed."""
        ...

    def simulate(
        self,
        edits: Edits,
        repaired: BodyMotion,
        off_feet: list[OffFeetSpan],
        contacts: np.ndarray | None,
        progress: Callable[[float], None],
    ) -> tuple[SimulatedClip, np.ndarray]:
        """Return the clip simulated as far as it is to be, and the frames that are stale, shape (T,)."""
        ...

    def usual_heights(self, placed: PlacedRecording) -> tuple[float, float]:
        """Return what ``usual_height_offsets`` does of the whole recording [m]."""
        ...


def run_stages(
    source: StageSource,
    edits: Edits,
    memory: StageMemory,
    begin: Callable[[str, float], None] = lambda _stage, _share: None,
) -> tuple[SolvedStages, Motion]:
    """Return what the stages make of frames, and the cleaned clip on the performer's own skeleton.

    Args:
        source: The frames.
        edits: What a person changed.
        memory: What the stages returned for other edits of the same frames.
        begin: Called with the name of each stage of ``eval.clean.progress`` as it begins, and with the share of it that is done.
    """
    begin(RESTORING, 0.0)
    placed = memory.result("placed", edits.ground_m, lambda: place_recording(source.recording, edits.ground_m))
    grid = len(placed.recorded), FPS, source.start_s
    found = memory.result("restored", (edits.ground_m, RESTORE in edits.without), lambda: source.restore(placed, edits))
    poses = memory.result("poses", _pose_key(edits), lambda: _edit(found, placed, edits, grid))
    begin(ROOT, 0.0)
    rooted, off_feet, flies = memory.result("root", _pose_key(edits), lambda: source.locate_root(placed, poses))
    contacts = memory.result("contacts", _pose_key(edits), lambda: _standing(rooted, poses.contacts, flies))
    begin(REPAIRING, 0.0)
    said = said_contacts(edits.contacts, *grid) if edits.contacts else None
    key, given = (_pose_key(edits), edits.contacts), (rooted, off_feet, contacts, said, source.overlaps)
    repaired = memory.result("repaired", key, lambda: repair_kinematically(*given))
    begin(SIMULATING, 0.0)
    simulated, stale = source.simulate(edits, repaired, off_feet, contacts, partial(begin, SIMULATING))
    begin(TRANSFERRING, 0.0)
    usual = memory.result("usual heights", edits.ground_m, lambda: source.usual_heights(placed))
    told = edits, source.start_s, usual
    output = to_performer(placed.retargeted, simulated.motion, simulated.contacts, off_feet, *told, partial(begin, TRANSFERRING))
    return SolvedStages(placed, found, poses, rooted, off_feet, flies, repaired, simulated, stale, said, usual), output


def _edit(found: RestoredPoses, placed: PlacedRecording, edits: Edits, grid: tuple[int, float, float]) -> RestoredPoses:
    """Return restored poses as a person edited them; the same object where nothing of them is edited."""
    motion = edit_poses(found.motion, placed.recorded, edits, grid)
    return found if motion is found.motion else found._replace(motion=motion)


def _standing(rooted: BodyMotion, contacts: np.ndarray | None, flies: np.ndarray) -> np.ndarray | None:
    """Return the network's contacts (T, 2) but in free flight and in steps that it missed; None where there are none."""
    return None if contacts is None else drop_missed_steps(rooted, contacts) & ~flies[:, None]


def _pose_key(edits: Edits) -> Hashable:
    """Return what of the edits the poses and the root depend on."""
    restored_otherwise = any(RESTORE in span.without for span in edits.spans)
    return edits.ground_m, RESTORE in edits.without, edits.spans if restored_otherwise else (), edits.misalignments
