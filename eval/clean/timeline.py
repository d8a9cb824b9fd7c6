"""What happened to a clip, each with its time: for whoever wants to go there and look."""

from eval.clean.notices import Notice, off_feet_notice
from eval.clean.result import CleaningResult


def timeline_notices(result: CleaningResult) -> tuple[Notice, ...]:
    """Return a line for each span off the feet, damage, joint that was moved far, overlap and seam, in the order of time."""
    found = [
        *(off_feet_notice(span, result.start_s) for span in result.off_feet),
        *(Notice(f"Moved by cleaning: {span}.", span.start_s, span.stop_s) for span in result.moved),
        *(Notice(f"Left overlapping: {overlap}.", overlap.start_s, overlap.stop_s) for overlap in result.overlaps),
        *(Notice("The simulation began again.", time, time) for time in result.restarts),
    ]
    if result.output:
        fps = result.output.fps  # damage is of the file's frames
        found += [
            Notice(f"Damaged, {'mended' if one.mended else 'left as it is'}: {one}.", one.start / fps, (one.stop - 1) / fps)
            for one in result.damage
        ]
    return tuple(sorted(found, key=lambda notice: notice.start_s or 0.0))
