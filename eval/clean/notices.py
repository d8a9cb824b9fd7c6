"""Lines that a person should read of a cleaning, each with the time that it belongs to."""

from collections.abc import Sequence
from dataclasses import dataclass

from datasets.cleanup.off_feet_spans import OffFeetSpan
from datasets.motion.clip import FPS, BodyMotion
from envs.physics.self_collision import Overlap
from eval.clean.edits import Edits
from eval.clean.misalignments import misalignment_notice
from eval.clean.moved_joints import MovedSpan, moved_notice
from eval.clean.remaining_overlaps import overlap_notice
from eval.clean.restored_poses import RestoredPoses


@dataclass(frozen=True)
class Notice:
    """A line, and the span of the clip that it is about.

    Attributes:
        text: The line.
        start_s: First instant in the file [s]; None where it is about the whole clip.
        stop_s: Last instant in the file [s]; None where it is about the whole clip.
    """

    text: str
    start_s: float | None = None
    stop_s: float | None = None

    def __str__(self) -> str:
        """Return the line."""
        return self.text


def pose_notices(poses: RestoredPoses, edits: Edits) -> tuple[Notice, ...]:
    """Return what a person should know of the poses of a clip, if they were corrected, could not be, or were by hand."""
    if poses.unknown_poses:
        told = ["The poses are unlike those of the suits that the restoring network knows; they were not corrected."]
    else:
        told = [] if poses.contacts is None else [misalignment_notice(poses.misalignments)]
    return tuple(map(Notice, told + edits_lines(edits)))


def edits_lines(edits: Edits) -> list[str]:
    """Return the line that says what a person changed; none where that is nothing."""
    kept = sum(span.keep for span in edits.spans)
    counted = {"contact": len(edits.contacts), "kept span": kept, "span with other settings": len(edits.spans) - kept}
    counted["misalignment"] = len(edits.misalignments)
    told = [f"{number} {_several(what) if number > 1 else what}" for what, number in counted.items() if number]
    told += [f"the ground {100.0 * edits.ground_m:+.1f} cm"] if edits.ground_m else []
    return [f"Edited by hand: {', '.join(told)}."] if told else []


def _several(what: str) -> str:
    noun, *rest = what.split(" with")
    return " with".join([f"{noun}s", *rest])


def root_notices(captured: BodyMotion, rooted: BodyMotion, off_feet: Sequence[OffFeetSpan], start_s: float) -> tuple[Notice, ...]:
    """Return what a person should know of the root of a clip, one line each.

    Args:
        captured: Clip with its root as captured.
        rooted: Clip with the root that it was given, the same object if that is the captured one.
        off_feet: Spans off level ground.
        start_s: Time of the first frame in the file [s].
    """
    lowered = "The figure hovers, but its jumps fall as gravity has it: its path was kept and its landings were put on the ground."
    guessed = "The recording does not say where the pelvis went, or lets the figure hover; its path was reconstructed."
    told = [] if rooted is captured else [Notice(lowered if rooted.rooted else guessed)]
    return (*told, *(off_feet_notice(span, start_s) for span in off_feet))


def off_feet_notice(span: OffFeetSpan, start_s: float) -> Notice:
    """Return the line about somebody off the feet, in a clip that begins at ``start_s`` in its file."""
    start, stop = start_s + span.start / FPS, start_s + span.stop / FPS
    text = f"Somebody {span.reason} from {start:.1f} s to {stop:.1f} s: not for feet on level ground, left to itself."
    return Notice(text, start, stop)


def moved_line(moved: tuple[MovedSpan, ...]) -> Notice:
    """Return the line about joints that were moved far; its time is that of the farthest."""
    farthest = max(moved, key=lambda span: span.distance_mm)
    return Notice(moved_notice(moved), farthest.start_s, farthest.stop_s)


def overlap_line(overlaps: tuple[Overlap, ...]) -> Notice:
    """Return the line about limbs that still pass through each other; its time is that of the deepest, which is the first."""
    return Notice(overlap_notice(overlaps), overlaps[0].start_s, overlaps[0].stop_s)
