"""Removes self-penetration: moves limbs out of the body by the smallest change of the hinge angles, smoothly over time.

What overlaps may be a fault or a touch that the humanoid's shapes exaggerate: an arm raised beside the head, a thigh against the belly of
who kneels. So a limb is moved by little or not at all, and a leg that stands or rests on the ground is not moved out of anything but the
other leg. What is left overlapping is found by ``find_overlaps``.
"""

from dataclasses import dataclass, replace

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from datasets.cleanup.foot_contacts import debounce_labels
from datasets.motion.clip import BodyMotion
from datasets.motion.frame_spans import true_spans
from datasets.motion.frozen_array import frozen
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES, HINGES, body_in_words, hinge_angles, rotations_from_hinges, split_side
from datasets.motion.kinematics import body_poses, clip_lowest_heights
from envs.physics.humanoid_mjcf import build_overlap_model
from envs.physics.overlap_memory import OverlapMemory

# Compliance of hinges: that of arms is higher than that of legs, which stand; back, collars, head and feet keep their angles.
JOINT_COMPLIANCE = {"upper_arm": 1.0, "forearm": 1.0, "thigh": 0.1, "shin": 0.1}
MAX_SHIFT_M = 0.1  # m, farthest that a limb's joint is moved; what would have to move farther is left as it is
BEARING_HEIGHT_M = 0.05  # m, of the lowest point of a shin, foot or toe: below it the leg stands or rests on the ground
ALLOWED_OVERLAP_M = 0.008  # m, overlap that is left: soft tissue gives way
NUM_PASSES = 6  # over the clip: each restores what smoothing took away from the corrections
MAX_ITERATIONS = 8  # of the inverse kinematics of a frame in a pass
DAMPING = 1e-2  # m^2/rad^2, of the least squares: limits the turns of joints that hardly change an overlap
ARM_BLEND_S, LEG_BLEND_S = 0.15, 0.8  # s, in which corrections of arms and legs rise and fall; a leg's must not make its foot slide
# s, time constant of a frame's correction as the start of the next, so that a limb that went deep goes out on the side where it came in.
CORRECTION_DECAY_S = 0.05
NEGLIGIBLE_CHANGE_RAD = 1e-9  # rad, of a decaying change, under which it is none, so that frames far from overlaps are left alone
# s, farthest that smoothing carries a correction: SciPy cuts a Gaussian, whose deviation is half of the blend, off at four of them.
MAX_REACH_S = 4.0 * 0.5 * max(ARM_BLEND_S, LEG_BLEND_S) + ARM_BLEND_S
MIN_TOLD_OVERLAP_M, MERGED_GAP_S = 0.03, 0.5  # m and s: overlaps as deep as this are listed, those of one pair as near as this as one
_LIMB_NAMES = {"arm": ("upper_arm", "forearm", "hand"), "leg": ("thigh", "shin", "foot", "toe")}
_LIMBS = [[BODY_NAMES.index(f"{part}_{side}") for part in parts] for parts in _LIMB_NAMES.values() for side in "lr"]  # both arms, both legs
_LEGS = _LIMBS[2:]
_BODY_OF_HINGE = np.array([body for body, _ in HINGES])
_OF_LEGS = np.isin(_BODY_OF_HINGE, np.concat(_LEGS))
_NO_CHANGE = frozen(np.zeros(len(HINGES)))


@dataclass(frozen=True)
class Overlap:
    """Span of a clip in which two bodies pass through each other.

    Attributes:
        start_s: First instant [s].
        stop_s: Last instant [s].
        bodies: Names of the two bodies.
        depth_mm: Largest depth [mm].
    """

    start_s: float
    stop_s: float
    bodies: tuple[str, str]
    depth_mm: float

    def __str__(self) -> str:
        """Return the overlap as text."""
        one, other = map(body_in_words, self.bodies)
        return f"{one} in {other} by {self.depth_mm:.0f} mm at {self.start_s:.1f} to {self.stop_s:.1f} s"


def remove_self_penetration(motion: BodyMotion, memory: OverlapMemory | None = None) -> BodyMotion:
    """Return the clip with limbs that neither pass through each other nor through the trunk, as far as a small shift can do it.

    Args:
        motion: Clip of any rate, on its ground; its root, back and collars keep their pose.
        memory: What was found in other versions of the clip, whose poses are then not searched again.

    Source: damped least squares on the contacts that MuJoCo detects in each pose.
    """
    body, poses, bearing = _Body(memory), _generalised_positions(motion), _bearing_legs(motion)
    decay, reach = np.exp(-1.0 / (CORRECTION_DECAY_S * motion.fps)), round(MAX_REACH_S * motion.fps)
    own, seen = poses[:, 7:].copy(), np.ones(len(poses), dtype=bool)
    for _ in range(NUM_PASSES):
        away = body.corrections(poses, bearing, decay, seen)
        seen = _widened(np.any(away != 0.0, axis=1), reach)  # the others keep their poses, in which nothing was found
        if not seen.any():
            break
        for start, stop in true_spans(seen):  # corrections are zero at both ends of a span, unless the clip ends there
            poses[start:stop, 7:] += _smoothed(away[start:stop], motion.fps)
    changed = np.any(poses[:, 7:] != own, axis=1)
    return _without_far_shifts(motion, poses[:, 7:], changed) if changed.any() else motion


def find_overlaps(motion: BodyMotion, start_s: float = 0.0, memory: OverlapMemory | None = None) -> tuple[Overlap, ...]:
    """Return the spans of a clip that begins at a time [s] in which bodies overlap by ``MIN_TOLD_OVERLAP_M`` or more, the deepest first."""
    depths = overlap_depths(motion, memory)
    gap = round(MERGED_GAP_S * motion.fps) + 1
    found = []
    for pair, depth in depths.items():
        for start, stop in true_spans(debounce_labels(depth > MIN_TOLD_OVERLAP_M, shortest=0, gap=gap)).tolist():
            ends = start_s + start / motion.fps, start_s + (stop - 1) / motion.fps
            found.append(Overlap(*ends, pair, 1e3 * float(depth[start:stop].max())))
    return tuple(sorted(found, key=lambda overlap: -overlap.depth_mm))


def overlap_depths(motion: BodyMotion, memory: OverlapMemory | None = None) -> dict[tuple[str, str], np.ndarray]:
    """Return how deep the shapes of each pair of bodies that ever do overlap [m], shape (T,), by the names of both."""
    return _Body(memory).depths(_generalised_positions(motion))


def _generalised_positions(motion: BodyMotion) -> np.ndarray:
    """Return the generalised positions of a clip, shape (T, 50)."""
    return np.concat([motion.root_position, motion.local_rotations[:, 0], hinge_angles(motion.local_rotations)], axis=1)


def _bearing_legs(motion: BodyMotion) -> np.ndarray:
    """Return whether the left and the right leg stand or rest on the ground, shape (T, 2)."""
    heights = clip_lowest_heights(motion)
    return np.stack([heights[:, leg[1:]].min(axis=1) < BEARING_HEIGHT_M for leg in _LEGS], axis=1)


def _without_far_shifts(motion: BodyMotion, angles: np.ndarray, changed: np.ndarray) -> BodyMotion:
    """Return the clip with other hinge angles where a limb's joints stay near; what would move one far is undone from beginning to end.

    Args:
        motion: Clip of T frames.
        angles: Other hinge angles [rad], shape (T, 43).
        changed: Frames in which they differ, shape (T,).
    """
    local = motion.local_rotations.copy()
    for start, stop in true_spans(changed):
        part = motion.cut(start, stop)
        turned = rotations_from_hinges(part.local_rotations[:, 0], angles[start:stop])
        turned *= np.where(np.sum(turned * part.local_rotations, axis=-1, keepdims=True) < 0.0, -1.0, 1.0)  # no sign flips at the ends
        moved = np.linalg.norm(body_poses(replace(part, local_rotations=turned))[0] - body_poses(part)[0], axis=-1)
        for limb in _LIMBS:
            shift = moved[:, limb].max(axis=1)
            for begin, end in true_spans(shift > 1e-4).tolist():
                if shift[begin:end].max() > MAX_SHIFT_M:
                    turned[begin:end, limb] = part.local_rotations[begin:end, limb]
        local[start:stop] = turned
    return replace(motion, local_rotations=local)


def _widened(flags: np.ndarray, frames: int) -> np.ndarray:
    """Return flags (T,) that are also True up to so many frames before and after each."""
    wide = np.zeros_like(flags)
    for start, stop in true_spans(flags):
        wide[max(0, start - frames) : stop + frames] = True
    return wide


def _smoothed(away: np.ndarray, fps: float) -> np.ndarray:
    """Return corrections (T, 43) that rise and fall smoothly; they reach up to ``MAX_REACH_S`` farther."""
    arms = gaussian_filter1d(_extend_peaks(away, ARM_BLEND_S * fps), 0.5 * ARM_BLEND_S * fps, axis=0, mode="nearest")
    return np.where(_OF_LEGS, gaussian_filter1d(away, 0.5 * LEG_BLEND_S * fps, axis=0, mode="nearest"), arms)


def _extend_peaks(away: np.ndarray, width: float) -> np.ndarray:
    """Return corrections (T, 43) extended by ``width`` frames at both ends, so that smoothing keeps their peaks."""
    frames = 2 * round(width) + 1
    return maximum_filter1d(away.clip(0.0, None), frames, axis=0) - maximum_filter1d((-away).clip(0.0, None), frames, axis=0)


class _Body:
    """The posed humanoid and its overlapping shapes."""

    def __init__(self, memory: OverlapMemory | None) -> None:
        self._memory = memory or OverlapMemory(0)
        self._model = build_overlap_model()
        of_world = self._model.geom_bodyid == 0  # the ground, on which feet stand in most frames: no part of the body
        self._model.geom_contype[of_world] = self._model.geom_conaffinity[of_world] = 0
        self._data = mujoco.MjData(self._model)
        self._compliance = np.array([JOINT_COMPLIANCE.get(split_side(BODY_NAMES[body])[0], 0.0) for body, _ in HINGES])
        self._jacobians = np.zeros((2, 3, self._model.nv))
        self._limb_of_body = np.full(BODY_COUNT, -1)
        for limb, bodies in enumerate(_LIMBS):
            self._limb_of_body[bodies] = limb

    def depths(self, poses: np.ndarray) -> dict[tuple[str, str], np.ndarray]:
        """Return how deep the shapes of each pair of bodies overlap that ever do [m], shape (T,), for poses (T, 50)."""
        found: dict[tuple[str, str], np.ndarray] = {}
        for frame, pose in enumerate(poses):
            for pair, depth in self._memory.result(self._depths, pose):
                track = found.setdefault(pair, np.zeros(len(poses)))
                track[frame] = max(track[frame], depth)
        return found

    def _depths(self, pose: np.ndarray) -> list[tuple[tuple[str, str], float]]:
        """Return the names of both bodies and the depth [m] of each contact of a pose (50,)."""
        self._data.qpos[:] = pose
        return [((BODY_NAMES[bodies[1]], BODY_NAMES[bodies[0]]), depth) for bodies, depth, _ in self._contacts()]

    def corrections(self, poses: np.ndarray, bearing: np.ndarray, decay: float, seen: np.ndarray) -> np.ndarray:
        """Return the changes of the hinges that end the overlaps of poses [rad], shape (T, 43); zero where nothing overlaps nearby.

        Args:
            poses: Generalised positions, shape (T, 50).
            bearing: Whether the left and the right leg stand or rest on the ground, shape (T, 2).
            decay: Share of the previous frame's change from which each begins.
            seen: Frames that may overlap, shape (T,); in others nothing does.
        """
        away, change = np.zeros((len(poses), len(HINGES))), _NO_CHANGE
        is_moved = False
        for frame, look in enumerate(seen.tolist()):
            if look or is_moved:
                begun = change if change is _NO_CHANGE else decay * change
                change = self._memory.result(self._correction, poses[frame], bearing[frame], begun)
                away[frame], is_moved = change, change is not _NO_CHANGE
        return away

    def _correction(self, pose: np.ndarray, bearing: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Return the change of the hinges that ends the overlaps of a pose [rad], starting from ``change``, shape (43,).

        Args:
            pose: Generalised position, shape (50,).
            bearing: Whether the left and the right leg stand or rest on the ground, shape (2,).
            change: Change to start from [rad], shape (43,).
        """
        data, start = self._data, pose[7:]
        data.qpos[:] = pose
        data.qpos[7:] += change
        deep = self._deep_contacts()
        if change is _NO_CHANGE and not deep:
            return _NO_CHANGE  # as in most poses
        resting = {2 + leg for leg, is_bearing in enumerate(bearing.tolist()) if is_bearing}
        for _ in range(MAX_ITERATIONS):
            if not deep:
                break
            rows, depths = self._overlaps(deep, resting)
            weighted = rows * self._compliance
            data.qpos[7:] += weighted.T @ np.linalg.solve(weighted @ rows.T + DAMPING * np.eye(len(rows)), depths)
            deep = self._deep_contacts()
        change = data.qpos[7:] - start
        return _NO_CHANGE if np.abs(change).max() < NEGLIGIBLE_CHANGE_RAD else change

    def _deep_contacts(self) -> list[tuple[np.ndarray, float, int]]:
        """Return what ``_contacts`` does of bodies that overlap by more than is allowed."""
        return [contact for contact in self._contacts() if contact[1] > ALLOWED_OVERLAP_M]

    def _overlaps(self, deep: list[tuple[np.ndarray, float, int]], resting: set[int]) -> tuple[np.ndarray, np.ndarray]:
        """Return the Jacobians of the distances of overlapping pairs (P, 43) [m/rad], and the distances to gain (P,) [m].

        Args:
            deep: Contacts of the current pose, from ``_deep_contacts``.
            resting: Legs that stand or rest on the ground, by their place in ``_LIMBS``.
        """
        mujoco.mj_comPos(self._model, self._data)  # which Jacobians need
        rows = []
        for bodies, _, contact in deep:
            row = self._distance_jacobian(contact)
            limbs = set(self._limb_of_body[bodies].tolist())
            for limb in limbs & resting if limbs - {2, 3} else ():  # two legs part from each other wherever they are
                row[np.isin(_BODY_OF_HINGE, _LIMBS[limb])] = 0.0
            rows.append(row)
        return np.array(rows), np.array([depth for _, depth, _ in deep]) - 0.5 * ALLOWED_OVERLAP_M

    def _contacts(self) -> list[tuple[np.ndarray, float, int]]:
        """Return the two bodies (2,), the depth [m] and the index of each contact between bodies in the current pose."""
        model, data = self._model, self._data
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        if not data.ncon:
            return []
        bodies = model.geom_bodyid[data.contact.geom] - 1
        return [(pair, -depth, contact) for contact, (pair, depth) in enumerate(zip(bodies, data.contact.dist.tolist(), strict=True))]

    def _distance_jacobian(self, contact: int) -> np.ndarray:
        """Return the Jacobian of the distance between the two shapes of a contact with respect to the hinges, shape (43,) [m/rad]."""
        model, data = self._model, self._data
        for jacobian, body in zip(self._jacobians, model.geom_bodyid[data.contact.geom[contact]], strict=True):
            mujoco.mj_jac(model, data, jacobian, None, data.contact.pos[contact], body)
        normal = data.contact.frame[contact, :3]  # from the first shape to the second
        return (normal @ (self._jacobians[1] - self._jacobians[0]))[6:]
