"""What LoBSTr sees of four trackers: velocities in the user's own frame (appendix 1), or poses for comparison.

The reference frame stands at the pelvis, upright, and faces where the pelvis faces. NumPy arrays or torch tensors.
"""

from datasets.motion.rotation import Array, Constant, array_namespace, conjugate, from_axis_angle, heading, multiply, rotate, to_matrix
from datasets.trackers.lower_body import to_rotation_6d
from datasets.trackers.trackers import PELVIS_TRACKER

VELOCITY, POSE, COMBINED = "velocity", "pose", "combined"
FEATURE_SIZES = {VELOCITY: 37, POSE: 37, COMBINED: 64}
_UP = Constant([0.0, 0.0, 1.0])


def tracker_features(kind: str, before: tuple[Array, Array], now: tuple[Array, Array]) -> Array:
    """Return what is seen of the trackers at an instant.

    Args:
        kind: "velocity" is the paper's own: eq. 2 and 3 and appendix 1, with the reference's turn as ERRATA has it. "pose" has head
            and hands relative to the reference in place of their velocities, "combined" both (section 4.1.3).
        before: Positions [m] (..., 4, 3) and rotations (..., 4, 4) of the frame before, at the standard skeleton's size.
        now: Those of this frame.

    Returns:
        Nine numbers of the reference, nine for each of head and hands, height of the reference [m]; shape (..., 37), and 27 more
        for "combined". Velocities are per frame.
    """
    xp = array_namespace(now[0])
    facing, place, turned = _in_reference(*now)
    facing_before, place_before, turned_before = _in_reference(*before)
    step = rotate(conjugate(facing), now[0][..., PELVIS_TRACKER, :] - before[0][..., PELVIS_TRACKER, :])
    parts = [step, to_rotation_6d(to_matrix(multiply(conjugate(facing_before), facing)))]
    poses = xp.concat([place, to_rotation_6d(to_matrix(turned))], axis=-1)
    moved = xp.concat([place - place_before, to_rotation_6d(to_matrix(multiply(conjugate(turned_before), turned)))], axis=-1)
    for seen, of in ((moved, (VELOCITY, COMBINED)), (poses, (POSE, COMBINED))):
        if kind in of:
            parts.append(seen.reshape(*seen.shape[:-2], -1))
    return xp.concat([*parts, now[0][..., PELVIS_TRACKER, 2:]], axis=-1)


def _in_reference(positions: Array, rotations: Array) -> tuple[Array, Array, Array]:
    """Return the reference's rotation (..., 4), and positions (..., 3, 3) and rotations (..., 3, 4) of head and hands in it."""
    facing = from_axis_angle(_UP.like(positions), heading(rotations[..., PELVIS_TRACKER, :]))
    back = conjugate(facing)[..., None, :]
    place = rotate(back, positions[..., :PELVIS_TRACKER, :] - positions[..., PELVIS_TRACKER:, :])
    spread = back + 0.0 * rotations[..., :PELVIS_TRACKER, :]
    return facing, place, multiply(spread, rotations[..., :PELVIS_TRACKER, :])
