"""The line that tells which limbs were left in each other."""

from envs.physics.self_collision import Overlap
from eval.clean.remaining_overlaps import overlap_notice


def test_the_deepest_are_named_and_the_others_counted() -> None:
    overlaps = tuple(Overlap(1.0 * start, start + 0.5, ("hand_l", "thigh_l"), 90.4 - start) for start in range(6))
    notice = overlap_notice(overlaps)
    assert notice.startswith(
        "Left overlapping, as parting would move a limb by more than 100 mm or one that stands: "
        "left hand in left thigh by 90 mm at 0.0 to 0.5 s, left hand in left thigh by 89 mm at 1.0 to 1.5 s, "
    )
    assert notice.endswith("at 3.0 to 3.5 s, and 2 more.")
    assert overlap_notice(overlaps[:1]).endswith("at 0.0 to 0.5 s.")
