"""The result of a cleaning: the clip before and after on the 20 bodies, and how far each frame is the simulation's."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from datasets.cleanup.off_feet_spans import OffFeetSpan
from datasets.damage.damage import Damage
from datasets.motion.clip import BodyMotion, Motion
from envs.physics.self_collision import Overlap
from eval.clean.misalignments import Misalignment
from eval.clean.moved_joints import MovedSpan
from eval.clean.notices import Notice

SIMULATED_CONFIDENCE = 0.5  # from which on a frame counts as simulated: its contacts are the simulation's
KEPT_CONFIDENCE = 0.05  # below which a frame has nothing of physics in it


class PreviewedFrames(NamedTuple):
    """Frames of a clip on the performer's own skeleton that a preview shows otherwise: of ten minutes only these are copied.

    Attributes:
        start: First of them.
        motion: The frames.
    """

    start: int
    motion: Motion


@dataclass(frozen=True)
class CleaningResult:
    """A clip before and after; T frames at 60 fps, the same of both.

    Attributes:
        name: Name of the clip in messages and in the report.
        before: The input, floor-calibrated, with its root.
        after: The output through the same retargeting and calibration.
        contacts: Whether the left and the right foot stand, shape (T, 2): in simulated frames, whether each carried 0.05 of body weight;
            elsewhere, as detected by speed and height.
        confidence: Share of the simulation in each frame, 0 to 1; 0 where the repaired input was kept, shape (T,).
        restarts: Times at which the simulation began again, as all times in the file [s].
        assist: Force that helped on the pelvis in simulated frames [body weights], shape (T,).
        notices: Lines that a person should read, with the time that they belong to.
        misalignments: Segments whose sensors were clearly misaligned, the largest first; corrected.
        moved: Spans in which a joint was moved far, in the order of time.
        overlaps: Spans in which bodies still pass through each other, the deepest first.
        truth: Clean clip behind a simulated suit, where it is known.
        read_as: Line that says what the recording was taken for.
        damage: Damaged frames of the file, in the order of time.
        start_s: Time of the first frame in the file, of which a rest pose at the beginning is no part [s].
        found_contacts: Contacts before a person's edits, shape (T, 2); None where there are no edits.
        off_feet: Spans off the feet.
        stale: Spans that would be simulated, but were not yet, as they were edited: first instant and the one after the last [s].
        kept_spans: Spans that came back as recorded by a person's wish: first instant and the one after the last [s].
        output: Cleaned clip on the performer's own skeleton, at the file's rate, as it was solved whole.
        ground_m: Height of the ground above the one that was found, as a person edited it, in the file's world [m].
        previewed: Frames of the output that previews since then show otherwise, the newest last.
    """

    name: str
    before: BodyMotion
    after: BodyMotion
    contacts: np.ndarray
    confidence: np.ndarray
    restarts: tuple[float, ...]
    assist: np.ndarray
    notices: tuple[Notice, ...]
    misalignments: tuple[Misalignment, ...] = ()
    moved: tuple[MovedSpan, ...] = ()
    overlaps: tuple[Overlap, ...] = ()
    truth: BodyMotion | None = None
    read_as: str = ""
    damage: tuple[Damage, ...] = ()
    start_s: float = 0.0
    found_contacts: np.ndarray | None = None
    off_feet: tuple[OffFeetSpan, ...] = ()
    stale: tuple[tuple[float, float], ...] = ()
    kept_spans: tuple[tuple[float, float], ...] = ()
    output: Motion | None = None
    ground_m: float = 0.0
    previewed: tuple[PreviewedFrames, ...] = ()

    @property
    def is_preview(self) -> bool:
        """Whether only the seconds around the last edit were solved by it."""
        return bool(self.previewed)

    def shown_output(self, start: int = 0, stop: int | None = None) -> Motion | None:
        """Return the frames of the output from ``start`` up to ``stop`` with what is previewed of them; None if there is no output."""
        if self.output is None:
            return None
        shown = self.output.cut(start, len(self.output) if stop is None else stop)
        if not self.previewed:
            return shown
        places, turns = shown.local_positions.copy(), shown.local_rotations.copy()
        for first, motion in self.previewed:
            begin, end = max(first - start, 0), min(first + len(motion) - start, len(shown))
            if begin < end:
                part = motion.cut(begin + start - first, end + start - first)
                places[begin:end], turns[begin:end] = part.local_positions, part.local_rotations
        return replace(shown, local_positions=places, local_rotations=turns)

    @property
    def simulated(self) -> np.ndarray:
        """Whether each frame counts as simulated, shape (T,)."""
        return self.confidence >= SIMULATED_CONFIDENCE

    @property
    def mean_assist(self) -> float:
        """Mean force that helped on the pelvis in simulated frames [body weights]; 0 where no frame is simulated."""
        return float(self.assist[self.simulated].mean()) if self.simulated.any() else 0.0

    @property
    def kept(self) -> np.ndarray:
        """Whether each frame keeps the repaired input, shape (T,)."""
        return self.confidence < KEPT_CONFIDENCE

    def __post_init__(self) -> None:
        """Check that everything is of the same frames."""
        shapes = {"contacts": (len(self.before), 2), "confidence": (len(self.before),), "assist": (len(self.before),)}
        for field, shape in shapes.items():
            if getattr(self, field).shape != shape:
                raise ValueError(f"{self.name}: {field} has shape {getattr(self, field).shape}, should be {shape}")
        frames, fps = len(self.before), self.before.fps
        for other in (self.after, *([self.truth] if self.truth else [])):
            if (len(other), other.fps) != (frames, fps):
                raise ValueError(f"{self.name}: {frames} frames at {fps:g} fps before, {len(other)} at {other.fps:g} in {other.name}")
