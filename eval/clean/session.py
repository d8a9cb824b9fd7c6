"""A cleaning that can be solved again: what is read once is kept, and of the stages only those run again that an edit touches."""

from collections.abc import Callable, Hashable
from dataclasses import replace
from functools import partial
from typing import Protocol

import numpy as np

from agents.restore.model import RestoreModel
from datasets.cleanup.off_feet_spans import OffFeetSpan, find_off_feet_spans
from datasets.cleanup.performer_foot_lock import usual_height_offsets
from datasets.formats.bvh import Bvh
from datasets.imu.recording import measured_accelerations
from datasets.motion.clip import FPS, BodyMotion
from datasets.motion.kinematics import resample
from datasets.performer.performer_clip import performer_clip_from_bvh
from datasets.performer.reading_options import ReadingOptions
from datasets.retarget.plausibility import find_implausible
from datasets.retarget.read_as import describe_reading
from datasets.retarget.retarget import retarget
from datasets.retarget.transfer_back import to_performer_bvh, to_zero_ground
from envs.physics.overlap_memory import OverlapMemory
from eval.clean.apply_edits import (
    edit_poses,
    frames_of_quality,
    frames_without,
    said_contacts,
)
from eval.clean.believed_root import locate_root
from eval.clean.edited_simulation import EditedSimulation, SearchMemory
from eval.clean.edits import PHYSICS, RESTORE, Edits, check_within
from eval.clean.notices import Notice
from eval.clean.performer_output import to_performer
from eval.clean.preview import preview_edits, preview_window
from eval.clean.progress import COMPARING, REPAIRING, RESTORING, RETARGETING, ROOT, SIMULATING, TRANSFERRING
from eval.clean.restored_poses import RestoredPoses, restore_clip
from eval.clean.result import CleaningResult
from eval.clean.samcon import QUALITIES, Simulator
from eval.clean.simulate_clip import SimulatedClip
from eval.clean.solved_stages import PlacedRecording, SolvedStages, compare_with_recording, place_recording
from eval.clean.stage_memory import StageMemory
from eval.clean.stages import repair_kinematically, simulate_grounded_spans

MIN_REMEMBERED_S, REMEMBERED_CLIPS = 120.0, 4.0  # s of simulation that are remembered at least, and how many times the clip's length
REMEMBERED_POSES = 16  # of each frame, in which overlaps were looked for: before and after each pass of their removal, and when it is done


class CleaningCancelled(Exception):  # noqa: N818  # no error
    """A cleaning that whoever asked for it no longer wants."""


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


class CleaningSession:
    """One clip that is cleaned again and again, as a person edits it.

    Attributes:
        bvh: Contents of the file.
        name: Name of the clip in messages and in the report.
        performer: Clip on the performer's own skeleton.
        retargeted: Clip on the 20 bodies, at the file's rate.
        recorded: The same at 60 fps.
        read_as: Line that says what the file was taken for.
        notices: What a person should know of how it was read.
        start_s: Time of the first frame in the file [s].
    """

    def __init__(
        self,
        bvh: Bvh,
        name: str,
        models: Models,
        reading: ReadingOptions | None = None,
        progress: Callable[[str, float], None] = lambda _stage, _share: None,
    ) -> None:
        """Read and retarget a clip.

        Args:
            bvh: Parsed input file.
            name: Name of the clip.
            models: Pipeline with which it is cleaned.
            reading: Joint names, unit, axes, rate and ground that the user gave.
            progress: Called as that of ``solve``.

        Raises:
            InputError: If no human skeleton is found in the file.
        """
        progress(RETARGETING, 0.0)
        self.bvh, self.name, self._models = bvh, name, models
        self.performer = performer_clip_from_bvh(bvh, name, reading)  # own skeleton, in metres, Z up
        self.retargeted = retarget(self.performer)  # 20 bodies, own rate
        self.recorded = resample(self.retargeted.motion, FPS)
        self.start_s = self.performer.dropped_frames / self.performer.motion.fps
        read = (*self.performer.notices, *find_implausible(self.retargeted))
        self.notices, self.read_as = tuple(map(Notice, read)), describe_reading(self.retargeted)
        self._stages: SolvedStages | None = None  # of the last solving
        self._memory, self._overlaps = StageMemory(), OverlapMemory(REMEMBERED_POSES * len(self.recorded))
        self._searches = SearchMemory(round(max(MIN_REMEMBERED_S * FPS, REMEMBERED_CLIPS * len(self.recorded))))

    @property
    def seconds(self) -> float:
        """Duration of the clip [s]."""
        return self.recorded.seconds

    def solve(
        self,
        edits: Edits | None = None,
        physics: bool = True,
        progress: Callable[[str, float], None] = lambda _stage, _share: None,
        cancelled: Callable[[], bool] = lambda: False,
    ) -> CleaningResult:
        """Return the cleaned clip.

        Args:
            edits: What a person changed; how the file is read was settled when the session began.
            physics: Whether parts that are to be simulated and were not yet are simulated now; else they are ``stale`` in the result.
            progress: Called with the name of each stage of ``eval.clean.progress`` as it begins, and with the share of it that is done.
            cancelled: Asked between stages and between windows of the search whether the result is still wanted.

        Raises:
            CleaningCancelled: If it is not; the session can go on.
            EditError: If an edit is of a time outside the clip.
        """
        edits = edits or Edits()
        check_within(edits, self.start_s, self.start_s + (len(self.recorded) - 1) / FPS)

        def begin(stage: str, share: float = 0.0) -> None:
            if cancelled():
                raise CleaningCancelled
            progress(stage, min(share, 1.0))

        begin(RESTORING)
        placed, poses, found_poses = self._poses(edits)
        begin(ROOT)
        rooted, off_feet = self._memory.result("root", _pose_key(edits), lambda: self._root(placed, poses))
        begin(REPAIRING)
        said = said_contacts(edits.contacts, *self._grid) if edits.contacts else None
        repaired = self._memory.result(
            "repaired",
            (_pose_key(edits), edits.contacts),
            lambda: repair_kinematically(rooted, off_feet, poses.contacts, said, self._overlaps),
        )
        begin(SIMULATING)
        simulated, stale = self._simulate(edits, repaired, off_feet, poses.contacts, physics, lambda share: begin(SIMULATING, share))
        begin(TRANSFERRING)
        usual = self._memory.result("usual heights", edits.ground_m, lambda: usual_height_offsets(placed.retargeted))
        given = placed.retargeted, simulated.motion, simulated.contacts, off_feet, edits, self.start_s, usual
        output = to_performer(*given, partial(begin, TRANSFERRING))
        begin(COMPARING)
        self._stages = stages = SolvedStages(placed, found_poses, poses, rooted, off_feet, repaired, simulated, stale, said, usual)
        told = compare_with_recording(stages, output, edits, self.name, self.start_s, self._overlaps)
        return replace(told, notices=(*self.notices, *told.notices), read_as=self.read_as, damage=self.performer.damage)

    def preview(self, edits: Edits, shown: CleaningResult, before: Edits, near_s: float) -> CleaningResult | None:
        """Return a result with other edits in the seconds around them alone, at once, however long the clip; ``solve`` gives the whole one.

        Args:
            edits: What a person changed.
            shown: Result of ``solve`` or of ``preview`` for the edits before.
            before: Edits before.
            near_s: Time around which changes of the whole clip are previewed [s].

        Returns:
            A result that is not to be written; None where there is nothing to preview, or the whole is solved as quickly.
        """
        window = preview_window(edits, before, self.start_s, self.start_s + self.seconds, near_s)
        return preview_edits(self._recording, self._stages, shown, edits, window, self._overlaps) if window and self._stages else None

    def write(self, result: CleaningResult) -> Bvh:
        """Return the file to write for a result of ``solve``: the recorded one with the channel values of the cleaned clip.

        Unit and up axis that it was read with are stated, for formats that have their own.
        """
        if result.output is None or result.is_preview:
            raise ValueError(f"{result.name}: a preview, or a result without the clip on the performer's skeleton")
        written = to_performer_bvh(self.bvh, self.performer, result.output)
        written = replace(written, stated=replace(written.stated, unit=self.performer.unit, up_axis=self.performer.up_axis))
        return to_zero_ground(written, self._placed(result.ground_m).retargeted) if self.performer.reading.zero_ground else written

    def _placed(self, ground_m: float) -> PlacedRecording:
        """Return the recording on ground that is ``ground_m`` higher than was found [m]."""
        return self._memory.result("placed", ground_m, lambda: place_recording(self._recording, ground_m))

    @property
    def _recording(self) -> PlacedRecording:
        """The recording on the ground that was found."""
        return PlacedRecording(self.retargeted, self.recorded)

    def _poses(self, edits: Edits) -> tuple[PlacedRecording, RestoredPoses, RestoredPoses]:
        """Return the recording on its ground, and its restored poses with and without what a person changed of them."""
        placed, restorer = self._placed(edits.ground_m), None if RESTORE in edits.without else self._models.restorer
        unedited = self._memory.result(
            "restored",
            (edits.ground_m, restorer is None),
            lambda: restore_clip(restorer, placed.recorded, find_off_feet_spans(placed.recorded)),
        )

        def edit() -> RestoredPoses:
            motion = edit_poses(unedited.motion, placed.recorded, edits, self._grid)
            return unedited if motion is unedited.motion else unedited._replace(motion=motion)

        return placed, self._memory.result("poses", _pose_key(edits), edit), unedited

    def _root(self, placed: PlacedRecording, poses: RestoredPoses) -> tuple[BodyMotion, list[OffFeetSpan]]:
        return locate_root(poses.motion, measured_accelerations(self.bvh, placed.retargeted, poses.motion))

    def _simulate(
        self,
        edits: Edits,
        repaired: BodyMotion,
        off_feet: list[OffFeetSpan],
        contacts: np.ndarray | None,
        physics: bool,
        progress: Callable[[float], None],
    ) -> tuple[SimulatedClip, np.ndarray]:
        """Return the clip simulated as far as it is to be, and the frames that are stale, shape (T,)."""
        simulator = None if PHYSICS in edits.without else self._models.simulator
        if simulator and edits.quality:
            search = replace(QUALITIES[edits.quality], assist_force_bw=simulator.search.assist_force_bw)
            simulator = replace(simulator, search=search)
        without = frames_without(PHYSICS, edits.spans, *self._grid)
        parts = EditedSimulation(self._searches, without, frames_of_quality(edits.spans, *self._grid), physics)
        return simulate_grounded_spans(simulator, repaired, off_feet, contacts, progress, parts, self._overlaps), parts.stale

    @property
    def _grid(self) -> tuple[int, float, float]:
        """Number of frames at 60 fps, their rate [1/s] and the time of the first [s]."""
        return len(self.recorded), FPS, self.start_s


def _pose_key(edits: Edits) -> Hashable:
    """Return what of the edits the poses and the root depend on."""
    restored_otherwise = any(RESTORE in span.without for span in edits.spans)
    return edits.ground_m, RESTORE in edits.without, edits.spans if restored_otherwise else (), edits.misalignments
