"""A cleaning that can be solved again: what is read once is kept, and of the stages only those run again that an edit touches."""

from collections.abc import Callable
from dataclasses import replace

from datasets.formats.bvh import Bvh
from datasets.motion.clip import FPS
from datasets.motion.kinematics import resample
from datasets.performer.performer_clip import performer_clip_from_bvh
from datasets.performer.reading_options import ReadingOptions
from datasets.retarget.plausibility import find_implausible
from datasets.retarget.read_as import describe_reading
from datasets.retarget.retarget import retarget
from datasets.retarget.transfer_back import to_performer_bvh, to_zero_ground
from envs.physics.overlap_memory import OverlapMemory
from eval.clean.edited_simulation import SearchMemory
from eval.clean.edits import Edits, check_within
from eval.clean.notices import Notice
from eval.clean.preview import preview_edits, preview_window
from eval.clean.progress import COMPARING, RETARGETING
from eval.clean.result import CleaningResult
from eval.clean.solved_stages import PlacedRecording, SolvedStages, compare_with_recording, place_recording
from eval.clean.stage_memory import StageMemory
from eval.clean.stage_order import run_stages
from eval.clean.whole_clip import Models, WholeClip

MIN_REMEMBERED_S, REMEMBERED_CLIPS = 120.0, 4.0  # s of simulation that are remembered at least, and how many times the clip's length
REMEMBERED_POSES = 16  # of each frame, in which overlaps were looked for: before and after each pass of their removal, and when it is done


class CleaningCancelled(Exception):  # noqa: N818  # no error
    """A cleaning that whoever asked for it no longer wants."""


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

        source = WholeClip(self._recording, self.start_s, self.bvh, self._models, self._searches, self._overlaps, physics)
        stages, output = run_stages(source, edits, self._memory, begin)
        begin(COMPARING)
        self._stages = stages
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
        if not self.performer.reading.zero_ground:
            return written
        return to_zero_ground(written, place_recording(self._recording, result.ground_m).retargeted)

    @property
    def _recording(self) -> PlacedRecording:
        """The recording on the ground that was found."""
        return PlacedRecording(self.retargeted, self.recorded)
