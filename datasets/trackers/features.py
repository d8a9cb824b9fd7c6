"""Features of four trackers for LoBSTr: velocities in the user's own frame (appendix 1), or poses for comparison.

The reference frame is at the pelvis, upright, with the pelvis' heading. NumPy arrays or torch tensors.
"""

from datasets.motion.rotation import Array, array_namespace, conjugate, from_yaw, heading, multiply, rotate, to_matrix
from datasets.trackers.lower_body import to_rotation_6d
from datasets.trackers.trackers import PELVIS_TRACKER

VELOCITY, POSE, COMBINED = "velocity", "pose", "combined"
FEATURE_SIZES = {VELOCITY: 37, POSE: 37, COMBINED: 64}


def tracker_features(kind: str, before: tuple[Array, Array], now: tuple[Array, Array]) -> Array:
    """Return the features of the trackers at one frame.

    Args:
        kind: "velocity" is the paper's: eq. 2 and 3 and appendix 1, with the reference's turn as in docs/errata.md. "pose" has head
            and hands relative to the reference in place of their velocities, "combined" both (section 4.1.3).
        before: Positions (..., 4, 3) [m] and rotations (..., 4, 4) in the previous frame, at the standard skeleton's size.
        now: Positions and rotations in this frame.

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
    """Return the rotation of the reference frame (..., 4), and positions (..., 3, 3) and rotations (..., 3, 4) of head and hands in it."""
    facing = from_yaw(heading(rotations[..., PELVIS_TRACKER, :]))
    back = conjugate(facing)[..., None, :]
    place = rotate(back, positions[..., :PELVIS_TRACKER, :] - positions[..., PELVIS_TRACKER:, :])
    spread = back + 0.0 * rotations[..., :PELVIS_TRACKER, :]
    return facing, place, multiply(spread, rotations[..., :PELVIS_TRACKER, :])
