"""Foot contacts of a whole clip on ground of any level, detected by the height and the speed of sole points."""

import numpy as np
from scipy.ndimage import uniform_filter1d

from datasets.motion.clip import BodyMotion
from datasets.motion.frame_spans import true_spans
from datasets.motion.kinematics import clip_sole_points, linear_velocity, support_steps

# Measured on 21 synthetic clips whose plants are known: precision and recall 0.95 and 1.00 on the clean ones, 0.94 and 0.81 on
# what a simulated suit makes of them; in the walks of cmu/train no contact is found in 4 % of the frames. At 0.3 m/s, or with
# velocities that are not smoothed, that share is twice as large; at 0.5 m/s feet that leave the ground count as standing for longer.
MAX_CONTACT_SPEED_M_S = 0.4  # m/s, of a sole point in contact
VELOCITY_SMOOTHING_S = 1.0 / 15.0  # s, over which velocities are averaged
SUPPORT_POINT_MARGIN_M = 0.02  # m, above the foot's lowest sole point, within which another one may carry it
STANDING_HEIGHT_MARGIN_M = 0.06  # m, above its lowest place in a slow span, or above the other foot, within which a foot stands
# A foot is slow at the top of a jump, too, but there it is this much lower soon before and soon after: in a jump of 3 cm it falls by 8 mm
# while it is slow and by 22 after that. A foot that stands sinks by up to 16 mm, on Bandai's skeleton, when it is loaded and rolls off.
JUMP_TOP_M, JUMP_TOP_S = 0.02, 0.15
MIN_STEP_M = 0.08  # m, of two feet relative to each other, faster than a contact: a step, and not how a foot lands, rolls or lifts off
MIN_CONTACT_S = 0.05  # s, 5 frames of the thesis's 100 Hz; a shorter contact is removed
MIN_CONTACT_GAP_S = 0.15  # s, 15 frames of the thesis's 100 Hz; a shorter gap between contacts is filled


def detect_foot_contacts(motion: BodyMotion) -> np.ndarray:
    """Return whether the left and the right foot stand in each frame, shape (T, 2).

    A foot may stand while one of its lowest sole points is slow. It does where in the same slow span it is the lower foot at
    least once, for no foot rests in the air while the other is below it, and as long as it stays at the height that it has then:
    so the level of the ground need not be known, and stairs count as ground.

    Args:
        motion: Clip with a root path; floating or sinking as a whole does no harm.

    Source: thesis 2.5 after Lee et al. 2002: positions and velocities against thresholds, then ``debounce_labels``.
    """
    points = clip_sole_points(motion)
    velocities = linear_velocity(points, motion.fps)
    speeds = np.linalg.norm(_averaged(velocities, motion.fps), axis=-1)
    heights = points[..., 2].min(axis=-1)
    slow = np.where(points[..., 2] < heights[..., None] + SUPPORT_POINT_MARGIN_M, speeds, np.inf).min(axis=-1) < MAX_CONTACT_SPEED_M_S
    above = heights - heights.min(axis=1, keepdims=True)
    around = round(JUMP_TOP_S * motion.fps)
    labels = np.stack([_standing(slow[:, side], heights[:, side], above[:, side], around) for side in (0, 1)], axis=1)
    return debounce_contacts(labels, motion.fps)


def drop_missed_steps(motion: BodyMotion, contacts: np.ndarray) -> np.ndarray:
    """Return contacts (T, 2) without those of a foot that takes a step while both are said to stand.

    Two feet that stand do not move relative to each other, wherever the root goes. If they do, by ``MIN_STEP_M`` in one go, the one that
    goes farther under the clip's root does not stand.
    All contacts are debounced, so that of a step quicker than ``MIN_CONTACT_GAP_S`` nothing is dropped.

    Args:
        motion: Clip with a root path.
        contacts: Whether the left and the right foot are said to stand, shape (T, 2).
    """
    steps = _averaged(support_steps(clip_sole_points(motion)), motion.fps)
    apart = np.append(np.linalg.norm(steps[:, 0] - steps[:, 1], axis=-1), 0.0)
    way, stands = np.linalg.norm(steps, axis=-1), contacts.copy()
    for start, stop in true_spans(contacts.all(axis=1) & (apart * motion.fps > MAX_CONTACT_SPEED_M_S)):
        if apart[start:stop].sum() > MIN_STEP_M:
            stands[start:stop, way[start:stop].sum(axis=0).argmax()] = False
    return debounce_contacts(stands, motion.fps)


def _averaged(track: np.ndarray, fps: float) -> np.ndarray:
    """Return the mean of a track (T, ...) over ``VELOCITY_SMOOTHING_S``."""
    return uniform_filter1d(track, 2 * round(0.5 * VELOCITY_SMOOTHING_S * fps) + 1, axis=0, mode="nearest")


def debounce_contacts(contacts: np.ndarray, fps: float) -> np.ndarray:
    """Return contacts of both feet (T, 2) without those shorter than ``MIN_CONTACT_S`` and gaps shorter than ``MIN_CONTACT_GAP_S``."""
    shortest, gap = (int(np.ceil(seconds * fps - 1e-6)) for seconds in (MIN_CONTACT_S, MIN_CONTACT_GAP_S))
    return np.stack([debounce_labels(contacts[:, side], shortest, gap) for side in (0, 1)], axis=1)


def debounce_labels(labels: np.ndarray, shortest: int, gap: int) -> np.ndarray:
    """Return contact labels (T,) without flicker: first short contacts are removed, then short gaps between the rest are filled.

    Args:
        labels: Contact labels of one foot, shape (T,).
        shortest: Shortest contact [frames]; a shorter one is removed, unless the clip begins or ends in it, where it may be longer.
        gap: Shortest gap [frames]; a shorter one between two contacts is filled.

    Source: thesis 2.5, with 5 and 15 frames.
    """
    cleaned = np.array(labels, dtype=bool)
    for start, stop in true_spans(cleaned):
        if stop - start < shortest and start > 0 and stop < len(cleaned):
            cleaned[start:stop] = False
    for start, stop in true_spans(~cleaned):
        if stop - start < gap and start > 0 and stop < len(cleaned):
            cleaned[start:stop] = True
    return cleaned


def _standing(slow: np.ndarray, heights: np.ndarray, above: np.ndarray, around: int) -> np.ndarray:
    """Return whether a foot stands in each frame, shape (T,).

    Args:
        slow: Whether the foot is slow, shape (T,).
        heights: Height of its lowest sole point [m], shape (T,).
        above: Height of its lowest sole point above that of the lower foot [m], shape (T,).
        around: Frames before and after a slow span, within which a foot at the top of a jump is clearly lower.
    """
    standing = np.zeros_like(slow)
    for start, stop in true_spans(slow):
        lower = above[start:stop] < STANDING_HEIGHT_MARGIN_M
        here = heights[start:stop]
        beside = heights[max(start - around, 0) : start], heights[stop : stop + around]
        fall = min(here[0], here[-1]) - max(side.min(initial=np.inf) for side in beside)  # of the side on which it falls less
        if lower.any() and fall <= JUMP_TOP_M:
            standing[start:stop] = here < here[lower].min() + STANDING_HEIGHT_MARGIN_M
    return standing
