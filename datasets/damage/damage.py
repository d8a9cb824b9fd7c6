"""Damage in a recording: frames that are far off or frozen are replaced by what lies between their neighbours, and listed.

Only the joints that are far off are replaced, and only in those frames: everything else keeps its value. What lasts longer than a second
is left, and told.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.ndimage import binary_closing, binary_dilation

from datasets.damage.local_tracks import LocalTracks
from datasets.damage.spikes import MIN_STEP_M, MIN_STEP_RATIO, Steps, body_points, find_pose_jumps, find_spikes, steps_beside
from datasets.joints.joint_tree import JointMap
from datasets.motion.frame_spans import true_spans
from datasets.motion.humanoid import split_side
from datasets.motion.rotation import rotation_angle
from datasets.motion.vectors import unit_vector

SPIKE, EMPTY, FROZEN, WILD, POSE_JUMP, ROOT_JUMP = "spike", "empty", "frozen", "wild", "pose jump", "root jump"
IN_WORDS = {SPIKE: "far off", EMPTY: "all rotations zero", FROZEN: "frozen", WILD: "jumping from frame to frame"}
JUMPS = (POSE_JUMP, ROOT_JUMP)
MAX_MENDED_S = 1.0  # s, on end
PART_S, PART_CONTEXT_S = 120.0, 10.0  # s, of the parts in which a long clip is looked through, and around them: damage lasts a second
MIN_FROZEN_FRAMES = 3  # that are equal, of which the first was recorded
MIN_FROZEN_SPEED = 3.0  # tolerances a second (24 degrees or 9 cm), of the quickest joint before and after frozen frames
MIN_TRACK_RATIO = 2.0  # of the steps of a joint that is far off over the steps beside them
MIN_WHOLE_SHARE, MIN_WHOLE_TRACKS = 1 / 3, 5  # of the tracks that move at all: where more are far off, the whole frame is replaced
MIN_WILD_ACCELERATION_M_S2 = 300.0  # m/s^2, of a quarter of the body's points in most frames
MIN_WILD_SHARE, MAX_WILD_GAP, MIN_WILD_FRAMES = 0.25, 3, 6  # of the points; frames between two such frames; on end
MIN_FROZEN_END_SPEED = 10.0  # the same of the root (0.3 m/s), in FROZEN_END_STEPS beside frames frozen at the beginning or end of a clip
FROZEN_END_STEPS = 3
SAME_STEP = 1e-9  # tolerances, up to which frames are equal
ZERO_TURN_RAD = 1e-6  # rad
LIMBS = (("thigh", "shin", "foot"), ("upper_arm", "forearm", "hand"))
MIN_REST_STRAIGHTNESS = np.cos(np.radians(35.0))  # cosine of the bend of knees and elbows at a rest pose
MAX_REST_DIFFERENCE_M = 0.1  # m, of the distances of the left and the right hand and foot from pelvis and head at a rest pose
END_PARTS = ("head", "hand", "foot", "toe")
MAX_TOLD_SPANS, MAX_TOLD_JOINTS = 6, 3


@dataclass(frozen=True)
class Damage:
    """Span of damaged frames.

    Attributes:
        kind: SPIKE, EMPTY, FROZEN, WILD, POSE_JUMP or ROOT_JUMP.
        start: First frame of the file, from 0; of a jump, the first one after it.
        stop: Frame after the last.
        joints: Names of the joints that are damaged, none if all are.
        mended: Whether the frames were replaced, or the root's jump kept out of the cleaning; else they are as they were.
    """

    kind: str
    start: int
    stop: int
    joints: tuple[str, ...] = ()
    mended: bool = True

    def moved(self, frames: int) -> Self:
        """Return the same damage so many frames later."""
        return replace(self, start=self.start + frames, stop=self.stop + frames)

    def __str__(self) -> str:
        """Return kind, frames, counted from 1 as the rows of a file, and joints as text."""
        frames = f"frame {self.start + 1}" if self.stop - self.start == 1 else f"frames {self.start + 1} to {self.stop}"
        more = len(self.joints) - MAX_TOLD_JOINTS
        joints = f", {', '.join(self.joints[:MAX_TOLD_JOINTS])}{f' and {more} more' if more > 0 else ''}" if self.joints else ""
        return f"{frames} ({IN_WORDS.get(self.kind, self.kind)}{joints})"


def damage_after(damage: Sequence[Damage], dropped: int) -> tuple[Damage, ...]:
    """Return the damage in the frames of a file that are left when its first ``dropped`` ones, a T-pose, are not read.

    How a T-pose jumps into the motion is no damage.
    """
    left = (one for one in damage if (one.start if one.kind == POSE_JUMP else one.stop) > dropped)
    return tuple(replace(one, start=max(one.start, dropped)) for one in left)


def damage_notices(damage: Sequence[Damage]) -> list[str]:
    """Return what a person should know of damage but the root's jumps: a line for what was replaced, for what was left, and for jumps."""
    spans = [one for one in damage if one.kind not in JUMPS]
    mended, left = ([one for one in spans if one.mended is wanted] for wanted in (True, False))
    lines = [f"Damaged frames were replaced by what lies between their neighbours: {_listed(mended)}."] if mended else []
    if left:
        lines.append(f"Damaged frames were left as they are, too many on end or without an end: {_listed(left)}; cut them out.")
    jumps = [f"{one.start + 1}" for one in damage if one.kind == POSE_JUMP]
    if jumps:
        told = f"{', '.join(jumps[:MAX_TOLD_SPANS])}{' and others' if len(jumps) > MAX_TOLD_SPANS else ''}"
        lines.append(f"The pose jumps at frame {told}, as where recordings are joined; it is smoothed. To keep it, cut the file there.")
    return lines


def _listed(damage: list[Damage]) -> str:
    more = len(damage) - MAX_TOLD_SPANS
    return f"{', '.join(map(str, damage[:MAX_TOLD_SPANS]))}{f' and {more} other spans' if more > 0 else ''}"


def mend_damage(tracks: LocalTracks, names: Sequence[str], joint_map: JointMap, fps: float) -> tuple[LocalTracks, tuple[Damage, ...]]:
    """Return a clip with its damaged frames replaced, and what was found in the order of time; the clip itself if nothing was.

    Args:
        tracks: Local poses of the clip.
        names: Joint names.
        joint_map: Joint of each body.
        fps: Frame rate [1/s].
    """
    if len(tracks.rotations) < MIN_FROZEN_FRAMES:
        return tracks, ()
    if len(tracks.rotations) <= PART_S * fps:
        return _mend(tracks, names, joint_map, fps)
    damage: list[Damage] = []
    changes: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []  # frames, and their positions and rotations
    for part, core in _parts(len(tracks.rotations), fps):
        own = tracks.cut(part)
        mended, found = _mend(own, names, joint_map, fps)
        damage += [one.moved(part.start) for one in found if core.start <= one.start + part.start < core.stop]
        if mended is not own:
            inside = slice(core.start - part.start, core.stop - part.start)
            changed = np.any(mended.positions[inside] != own.positions[inside], axis=(1, 2))
            changed |= np.any(mended.rotations[inside] != own.rotations[inside], axis=(1, 2))
            rows = np.flatnonzero(changed)
            changes.append((rows + core.start, mended.positions[inside][rows], mended.rotations[inside][rows]))
    return tracks.replaced(changes) if changes else tracks, tuple(damage)


def _parts(frames: int, fps: float) -> Iterator[tuple[slice, slice]]:
    """Yield the parts in which a long clip is looked through, and of each the frames that no other part answers for."""
    core, around = round(PART_S * fps), round(PART_CONTEXT_S * fps)
    for start in range(0, frames, core):
        stop = min(start + core, frames)
        yield slice(max(start - around, 0), min(stop + around, frames)), slice(start, stop)


def _mend(tracks: LocalTracks, names: Sequence[str], joint_map: JointMap, fps: float) -> tuple[LocalTracks, tuple[Damage, ...]]:
    """Return a clip, or a part of one, with its damaged frames replaced, and what was found in the order of time."""
    tracks, frozen = _thaw(tracks, fps)
    ends = [joint for body, joint in joint_map.items() if split_side(body)[0] in END_PARTS]
    places, turns = tracks.world_poses()
    points = body_points(places, turns, joint_map["pelvis"], ends)
    steps = steps_beside(tracks.steps())
    empty = _empty_frames(tracks.rotations, steps)
    spans = find_spikes(points, fps)
    first = {body: places[0, joint] for body, joint in joint_map.items()}
    if looks_at_rest(first, tracks.rotations[0]):  # as exporters put before the motion
        frozen, spans = [one for one in frozen if one.start > 0], spans[spans[:, 0] > 0]
    damaged = _far_off(steps, spans, empty)
    wild = _wild_spans(points, fps, np.all(damaged, axis=1))
    for start, stop in wild:
        damaged[start:stop] = False
    short = np.stack([_only_short(track, MAX_MENDED_S * fps) for track in damaged.T], axis=1)
    found = [
        *frozen,
        *_name_spans(short, empty, names, mended=True),
        *_name_spans(damaged & ~short, empty, names, mended=False),
        *(Damage(WILD, start, stop, mended=False) for start, stop in wild),
        *_pose_jumps(points, fps, np.any(damaged, axis=1)),
    ]
    return tracks.bridged(short) if short.any() else tracks, tuple(sorted(found, key=lambda one: one.start))


def _thaw(tracks: LocalTracks, fps: float) -> tuple[LocalTracks, list[Damage]]:
    """Return the clip without frames that repeat the one before them amid motion, and the spans of these frames."""
    each = tracks.steps()
    steps, moved = each.max(axis=1), each[:, len(tracks.parents) :].max(axis=1)
    found, damaged = [], np.zeros((len(tracks.rotations), tracks.count), dtype=bool)
    for first, last in true_spans(steps < SAME_STEP).tolist():  # the frame that is repeated, and the last of those that repeat it
        if last - first + 1 < MIN_FROZEN_FRAMES:
            continue
        if first == 0 or last == len(steps):  # nothing lies between, but somebody on the move does not stop from one frame to the next
            beside = moved[last : last + FROZEN_END_STEPS] if first == 0 else moved[max(first - FROZEN_END_STEPS, 0) : first]
            if beside.min(initial=np.inf) * fps > MIN_FROZEN_END_SPEED and len(beside):
                found.append(Damage(FROZEN, first + (first > 0), last + (first > 0), mended=False))
            continue
        recorded = steps[first - 1] <= MIN_STEP_RATIO * steps[max(first - 3, 0) : first - 1].max(
            initial=1.0
        )  # else what is held is no pose
        if recorded and min(steps[first - 1], steps[last]) * fps > MIN_FROZEN_SPEED:
            short = last - first <= MAX_MENDED_S * fps
            found.append(Damage(FROZEN, first + 1, last + 1, mended=short))
            damaged[first + 1 : last + 1] = short
    return tracks.bridged(damaged) if damaged.any() else tracks, found


def looks_at_rest(at: Mapping[str, np.ndarray], rotations: np.ndarray, min_arm: float = 0.0) -> bool:
    """Return whether a frame is a rest pose: no rotation, or straight limbs, alike on both sides.

    Args:
        at: Body -> position of its joint in the world [m], shape (3,).
        rotations: Rotation of each joint relative to its parent, wxyz, shape (J, 4).
        min_arm: Least angle between upper arms and trunk where joints are turned [rad].
    """
    if rotation_angle(rotations).max() < ZERO_TURN_RAD:
        return True
    limbs = [[at[f"{part}_{side}"] for part in chain] for chain in LIMBS for side in "lr"]
    straight = all(unit_vector(middle - upper) @ unit_vector(tip - middle) > MIN_REST_STRAIGHTNESS for upper, middle, tip in limbs)
    down = unit_vector(at["pelvis"] - at["head"])
    raised = all(unit_vector(at[f"forearm_{side}"] - at[f"upper_arm_{side}"]) @ down <= np.cos(min_arm) for side in "lr")
    left, right = (
        np.array([np.linalg.norm(at[f"{part}_{side}"] - at[middle]) for middle in ("pelvis", "head") for part in ("hand", "foot")])
        for side in "lr"
    )
    return straight and raised and float(np.abs(left - right).max()) < MAX_REST_DIFFERENCE_M


def _empty_frames(rotations: np.ndarray, steps: Steps) -> np.ndarray:
    """Return which frames have no rotation at all, with a jump before them, shape (T,)."""
    zero = rotation_angle(rotations).max(axis=1) < ZERO_TURN_RAD
    jumps = (steps.size / np.maximum(1.0, steps.before)).max(axis=1) > MIN_STEP_RATIO
    for start, stop in true_spans(zero).tolist():
        zero[start:stop] = start > 0 and jumps[start - 1]
    return zero


def _far_off(steps: Steps, spans: np.ndarray, empty: np.ndarray) -> np.ndarray:
    """Return which tracks are far off in which frames, shape (T, tracks).

    Args:
        steps: Steps of the tracks.
        spans: Spans in which points of the body are far off, shape (spans, 2).
        empty: Frames in which all of it is, shape (T,).
    """
    damaged = np.zeros((len(empty), steps.size.shape[1]), dtype=bool)
    for start, stop in spans.tolist():
        far = np.ones(steps.size.shape[1], dtype=bool)
        if start > 0:
            far &= steps.size[start - 1] > np.maximum(1.0, MIN_TRACK_RATIO * steps.before[start - 1])
        if stop < len(damaged):
            far &= steps.size[stop - 1] > np.maximum(1.0, MIN_TRACK_RATIO * steps.after[stop - 1])
        damaged[start:stop] |= far
    moving = np.count_nonzero(steps.size.max(axis=0) > SAME_STEP)
    damaged[empty | (np.count_nonzero(damaged, axis=1) > max(MIN_WHOLE_SHARE * moving, MIN_WHOLE_TRACKS))] = True
    return damaged


def _only_short(labels: np.ndarray, longest: float) -> np.ndarray:
    """Return labels (T,) without runs of more than ``longest`` frames."""
    short = labels.copy()
    for start, stop in true_spans(labels).tolist():
        short[start:stop] = stop - start <= longest
    return short


def _name_spans(damaged: np.ndarray, empty: np.ndarray, names: Sequence[str], mended: bool) -> list[Damage]:
    """Return the spans in which tracks are damaged (T, tracks)."""
    found, rows = [], damaged.sum(axis=1, dtype=int)
    for start, stop in true_spans(rows > 0).tolist():
        part = damaged[start:stop].sum(axis=0, dtype=int)
        joints = np.flatnonzero(part[: len(names)] + part[len(names) :])
        kind = EMPTY if np.any(empty[start:stop]) else SPIKE
        found.append(Damage(kind, start, stop, () if np.all(part) else tuple(names[joint] for joint in joints.tolist()), mended))
    return found


def _wild_spans(points: np.ndarray, fps: float, mended: np.ndarray) -> list[tuple[int, int]]:
    """Return the spans, but of frames that are mended (T,), in which much of the body (T, points, 3) [m] jumps again and again."""
    bend = np.linalg.norm(np.diff(points, n=2, axis=0), axis=-1)
    share = np.pad(np.mean(bend > max(MIN_STEP_M, MIN_WILD_ACCELERATION_M_S2 / fps**2), axis=1), 1)
    wild = np.pad((share > MIN_WILD_SHARE) & np.logical_not(binary_dilation(mended)), MAX_WILD_GAP)
    together = np.asarray(binary_closing(wild, np.ones(MAX_WILD_GAP + 1)))[MAX_WILD_GAP:-MAX_WILD_GAP] & ~mended
    return [(start, stop) for start, stop in true_spans(together).tolist() if stop - start >= MIN_WILD_FRAMES]


def _pose_jumps(points: np.ndarray, fps: float, damaged: np.ndarray) -> list[Damage]:
    """Return the jumps of the pose that are not beside damaged frames (T,)."""
    near = np.asarray(binary_dilation(damaged, iterations=2))
    return [Damage(POSE_JUMP, frame, frame + 1, mended=False) for frame in find_pose_jumps(points, fps).tolist() if not near[frame]]
