"""Spikes in a recording: frames in which a point of the body is far off, between two steps that no body can make.

Steps from frame to frame are compared with those beside them, so that what is quick for longer, such as a kick, a turn or a landing, is no
spike. Points are joints, and points around head, hands and feet, whose rotations move no joint.
"""

from typing import NamedTuple

import numpy as np

from datasets.motion.rotation import rotate

MIN_STEP_M = 0.1  # m, into and out of a spike of a single frame
MAX_ACCELERATION_M_S2 = 150.0  # m/s^2, from frame to frame; spikes of several frames exceed it, a boxer's hand hardly
MIN_SINGLE_RATIO, MIN_STEP_RATIO = 2.5, 3.0  # of the steps into and out of a spike of one frame, or several, over the two steps beside them
MIN_BURST_STEP_M, MIN_BURST_STEP_RATIO = 0.2, 5.0  # the same of a burst: longer than a spike, of much of the body or of the root
MAX_SPIKE_S, MIN_SPIKE_FRAMES = 0.1, 3  # longest spike: the longer of the two
MAX_BURST_S = 1.0  # s
MIN_BURST_SHARE = 0.25  # of the points that are far off in a burst
# Distance between the frames before and after a spike, over the steps into and out of it, or over what the steps beside it lead to in the
# time; beyond both the motion went elsewhere. The second counts for a burst only if its two steps are opposed: two jumps one way are none.
MAX_RETURN_RATIO, MAX_DRIFT_RATIO, MAX_OPPOSED_COSINE = 0.5, 1.5, -0.5
POINT_RADIUS_M = 0.15  # m, from head, hands and feet to the points around them
_ATTEMPTS = 4  # of steps back that are tried for a step out


def body_points(positions: np.ndarray, rotations: np.ndarray, pelvis: int, ends: list[int]) -> np.ndarray:
    """Return joints relative to the pelvis, points relative to those joints that they are around, and the pelvis, shape (T, points, 3).

    Args:
        positions: Position of each joint in the world [m], shape (T, J, 3).
        rotations: Rotation of each joint in the world, wxyz, shape (T, J, 4).
        pelvis: Joint of the pelvis.
        ends: Joints of head, hands, feet and toes.
    """
    root = positions[:, [pelvis]]
    joints = np.delete(positions, pelvis, axis=1) - root
    around = [rotate(rotations[:, ends], np.broadcast_to(POINT_RADIUS_M * axis, positions[:, ends].shape)) for axis in np.eye(3)]
    return np.concat([joints, *around, root], axis=1)


def find_spikes(points: np.ndarray, fps: float) -> np.ndarray:
    """Return the spans of spikes and bursts, first frame and frame after the last, shape (spans, 2), in the order of time.

    A span that begins with the clip has no step into it, one that reaches its end no step out of it.

    Args:
        points: Points of ``body_points`` [m], shape (T, points, 3).
        fps: Frame rate [1/s].
    """
    longest, frames = max(MIN_SPIKE_FRAMES, round(MAX_SPIKE_S * fps)), len(points)
    fast = MAX_ACCELERATION_M_S2 / fps**2
    single = _spans(points, MIN_STEP_M, MIN_SINGLE_RATIO, 1)
    several = _spans(points, max(MIN_STEP_M, fast), MIN_STEP_RATIO, longest)
    several = several[several[:, 1] - several[:, 0] > 1]
    bursts = _spans(points, max(MIN_BURST_STEP_M, fast), MIN_BURST_STEP_RATIO, round(MAX_BURST_S * fps), MAX_OPPOSED_COSINE)
    bursts = _of_much_of_the_body(bursts[bursts[:, 1] - bursts[:, 0] > longest], points.shape[1], frames)
    found = np.unique(np.concat([single, several, bursts])[:, :2], axis=0)
    floor, calm = max(MIN_BURST_STEP_M, fast), round(MAX_BURST_S * fps)
    head, tail = (_find_tail(way, floor, longest, calm) for way in (points[::-1], points))
    at_ends = ([] if head is None else [[0, frames - head]], [] if tail is None else [[tail, frames]])
    return np.concat([np.reshape(at_ends[0], (-1, 2)), found, np.reshape(at_ends[1], (-1, 2))]).astype(int)


def find_pose_jumps(points: np.ndarray, fps: float) -> np.ndarray:
    """Return the first frames after steps that much of the body makes at once, and no more before or after them, shape (jumps,).

    Args:
        points: Points of ``body_points`` [m], shape (T, points, 3).
        fps: Frame rate [1/s].
    """
    steps = _steps(points[:, :-1])
    floor = max(MIN_BURST_STEP_M, MAX_ACCELERATION_M_S2 / fps**2)
    alone = steps.size > np.maximum(floor, MIN_BURST_STEP_RATIO * np.maximum(steps.before, steps.after))
    return 1 + np.flatnonzero(alone.mean(axis=1) >= MIN_BURST_SHARE)


class Steps(NamedTuple):
    """Steps from each frame to the next, and the larger of the two before and of the two after, each (T - 1, points)."""

    size: np.ndarray
    before: np.ndarray
    after: np.ndarray


def steps_beside(size: np.ndarray) -> Steps:
    """Return steps (T - 1, points) with the larger of the two steps before and of the two after each."""
    padded = np.pad(size, ((2, 2), (0, 0)))
    return Steps(size, np.maximum(padded[1:-3], padded[:-4]), np.maximum(padded[3:-1], padded[4:]))


def _steps(points: np.ndarray) -> Steps:
    return steps_beside(np.linalg.norm(np.diff(points, axis=0), axis=-1))


def _spans(points: np.ndarray, floor: float, ratio: float, longest: int, max_cosine: float = np.inf) -> np.ndarray:
    """Return spans between a step out of calm motion and a step back into it: rows of first frame, frame after the last, point.

    Args:
        points: Points of the body [m], shape (T, points, 3).
        floor: Smallest step [m].
        ratio: Smallest ratio of a step and the two beside it.
        longest: Largest number of frames of a span.
        max_cosine: Largest cosine between the two steps of a span that lasts so long that the motion led elsewhere.
    """
    steps = _steps(points)
    leaves = steps.size > np.maximum(floor, ratio * steps.before)
    returns = steps.size > np.maximum(floor, ratio * steps.after)
    found = [np.zeros((0, 3), dtype=int)]
    for point in np.flatnonzero(leaves.any(axis=0) & returns.any(axis=0)):
        out, back = np.flatnonzero(leaves[:, point]), np.flatnonzero(returns[:, point])
        first = np.searchsorted(back, out, side="right")
        for attempt in range(_ATTEMPTS):
            known = first + attempt < len(back)
            out, first = out[known], first[known]
            to = back[first + attempt]
            near = (to - out <= longest) & ((out > 0) | (to < len(points) - 2))  # motion is known on one side at least
            out, first, to = out[near], first[near], to[near]
            size = np.minimum(steps.size[out, point], steps.size[to, point])
            beside = np.maximum(steps.before[out, point], steps.after[to, point])
            away, home = (points[step + 1, point] - points[step, point] for step in (out, to))
            cosine = np.sum(away * home, axis=-1) / (steps.size[out, point] * steps.size[to, point])
            drift = MAX_DRIFT_RATIO * (to - out + 1) * beside * (cosine <= max_cosine)
            bridge = np.linalg.norm(points[to + 1, point] - points[out, point], axis=-1)
            closes = bridge <= np.maximum(MAX_RETURN_RATIO * size, drift)
            found.append(np.stack([out + 1, to + 1, np.full(len(out), point)], axis=1)[closes])
            out, first = out[~closes], first[~closes]
    return np.concat(found)


def _of_much_of_the_body(spans: np.ndarray, num_points: int, frames: int) -> np.ndarray:
    """Return those of some spans of points in whose middle many points are far off, and those of the pelvis."""
    edges = np.zeros(frames + 1, dtype=int)
    np.add.at(edges, spans[:, 0], 1)
    np.add.at(edges, spans[:, 1], -1)
    count = np.cumsum(edges)[(spans[:, 0] + spans[:, 1]) // 2]
    return spans[(count >= MIN_BURST_SHARE * num_points) | (spans[:, 2] == num_points - 1)]


def _find_tail(points: np.ndarray, floor: float, longest: int, calm: int) -> int | None:
    """Return the first frame after a step out of calm motion, in the last frames of a clip, that is alone or much of the body's, or None.

    Args:
        points: Points of the body [m], shape (T, points, 3).
        floor: Smallest such step [m].
        longest: Largest number of frames after it.
        calm: Number of frames before it that are calm.
    """
    size = np.linalg.norm(np.diff(points[-longest - calm - 1 :], axis=0), axis=-1)
    for step in range(max(len(size) - longest, MIN_SPIKE_FRAMES), len(size)):
        before = np.maximum(floor, MIN_BURST_STEP_RATIO * size[max(step - calm, 0) : step].max(axis=0))
        after = MIN_BURST_STEP_RATIO * size[step + 1 :].max(axis=0, initial=0.0)
        if (size[step] > np.maximum(before, after)).any() or (size[step] > before).mean() >= MIN_BURST_SHARE:
            return len(points) - len(size) + step
    return None
