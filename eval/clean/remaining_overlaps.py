"""What a person should know of limbs that still pass through the body after cleaning."""

from envs.physics.self_collision import MAX_SHIFT_M, Overlap

MAX_TOLD = 4  # overlaps in the notice, the deepest; the report lists all


def overlap_notice(overlaps: tuple[Overlap, ...]) -> str:
    """Return the line that tells an animator which overlaps were left, the deepest first.

    Args:
        overlaps: Overlaps of the cleaned clip, the deepest first; one at least.
    """
    more = len(overlaps) - MAX_TOLD
    listed = f"{', '.join(map(str, overlaps[:MAX_TOLD]))}{f', and {more} more' if more > 0 else ''}"
    return f"Left overlapping, as parting would move a limb by more than {1e3 * MAX_SHIFT_M:.0f} mm or one that stands: {listed}."
