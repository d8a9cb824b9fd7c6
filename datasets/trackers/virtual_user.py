"""Virtual users: people of any height who wear trackers as people do, and the trackers' simulated poses."""

from dataclasses import dataclass

import numpy as np

from datasets.motion.clip import BodyMotion
from datasets.motion.curves import smooth_noise
from datasets.motion.humanoid import HINGE_COUNT, HINGE_NAMES, rotations_from_hinges
from datasets.motion.rotation import from_rotation_vector, multiply, rotate
from datasets.motion.t_pose import PELVIS_HEIGHT, STANDING_HEIGHT
from datasets.trackers.trackers import ALL_TRACKER_NAMES, PELVIS_TRACKER, TRACKER_NAMES, TRACKER_RATE_HZ, TrackerPoses, tracker_poses

# Positions of worn trackers in the joint's frame: mean and spread to either side [m]. The eyes are 0.09 to 0.12 m in front of and above
# the head's joint; controllers lie in the palms; the belt runs 0.04 m above the pelvis' joint. Trackers of the feet lie on the insteps,
# those of the shins are strapped below the knees.
_PLACE = np.array([[0.10, 0.0, 0.10], [0.0, 0.08, -0.02], [0.0, -0.08, -0.02], [0.125, 0.0, 0.04]])
_SPREAD = np.array([[0.02, 0.01, 0.02], [0.02, 0.02, 0.02], [0.02, 0.02, 0.02], [0.025, 0.03, 0.04]])
_TILT = np.radians([25.0, 40.0, 40.0, 25.0])  # rad, largest tilt of each tracker about any axis
_LEG_PLACE = np.array([[0.07, 0.0, 0.01], [0.07, 0.0, 0.01], [0.06, 0.0, -0.08], [0.06, 0.0, -0.08]])
_LEG_SPREAD = np.array([[0.03, 0.02, 0.02], [0.03, 0.02, 0.02], [0.02, 0.04, 0.04], [0.02, 0.04, 0.04]])
_LEG_TILT = np.radians(30.0)  # rad

# The paper trains with five times as much noise (appendix 2), and states that its trackers are accurate to 2 mm, as these are.
POSITION_NOISE_STD_M = 0.002  # m, standard deviation of a tracker's displacement
MAX_ROTATION_NOISE_RAD = np.radians(0.3)  # rad

_STANCE = {
    "upper_arm_l_x": 4.0, "upper_arm_l_z": 4.0, "upper_arm_r_x": 4.0, "upper_arm_r_z": 4.0, "head_y": 4.0, "spine_y": 2.0,
}  # degrees, standard deviations of people's T-poses  # fmt: skip
_LEG_STANCE = {"thigh_x": 2.0, "thigh_z": 5.0, "foot_y": 2.0}  # degrees, standard deviations of each leg's hinges in T-poses
_ELBOWS = {"forearm_l_z": -1.0, "forearm_r_z": 1.0}  # hinge -> sign of its bend
_ELBOW = np.radians(10.0)  # rad, largest bend in a T-pose
_SWAY = np.radians(0.5)  # rad, amplitude of every hinge while standing
_SWAY_PERIOD = 2.0  # s


@dataclass(frozen=True)
class TrackerPlacement:
    """Placement of the trackers on one person.

    Attributes:
        scale: Height of the person over the standard humanoid's.
        offsets: Position of each of J trackers in its joint's frame, at the person's own size [m], shape (J, 3).
        tilts: Rotation of each tracker relative to its joint, wxyz, shape (J, 4).
    """

    scale: float
    offsets: np.ndarray
    tilts: np.ndarray


def draw_tracker_placement(rng: np.random.Generator, height: float = STANDING_HEIGHT, legs: bool = False) -> TrackerPlacement:
    """Return a random placement of the trackers on a person: the one on the pelvis in front or at the back.

    Args:
        rng: Random generator.
        height: Height of the person from sole to crown [m].
        legs: Whether feet and shins have trackers as well.
    """
    place = _PLACE.copy()
    if rng.uniform() < 0.5:
        place[PELVIS_TRACKER, 0] *= -1.0
    scale = height / STANDING_HEIGHT
    offsets = scale * (place + _SPREAD * rng.uniform(-1.0, 1.0, place.shape))
    tilts = _random_rotations(rng, _TILT * rng.uniform(0.0, 1.0, len(TRACKER_NAMES)))
    if legs:
        offsets = np.concat([offsets, scale * (_LEG_PLACE + _LEG_SPREAD * rng.uniform(-1.0, 1.0, _LEG_PLACE.shape))])
        tilts = np.concat([tilts, _random_rotations(rng, _LEG_TILT * rng.uniform(0.0, 1.0, len(_LEG_PLACE)))])
    return TrackerPlacement(scale, offsets, tilts)


def simulate_trackers(joints: TrackerPoses, wearing: TrackerPlacement, rng: np.random.Generator | None = None) -> TrackerPoses:
    """Return the poses of worn trackers during a motion.

    Args:
        joints: Poses of the joints of the standard humanoid, shape (..., J, ...).
        wearing: Placement of the trackers on the person.
        rng: Random generator of the trackers' noise; without noise if None.
    """
    positions = wearing.scale * joints.positions + rotate(joints.rotations, np.broadcast_to(wearing.offsets, joints.positions.shape))
    worn = TrackerPoses(positions, multiply(joints.rotations, np.broadcast_to(wearing.tilts, joints.rotations.shape)))
    return worn if rng is None else add_tracker_noise(worn, rng)


def add_tracker_noise(poses: TrackerPoses, rng: np.random.Generator) -> TrackerPoses:
    """Return poses with random displacements and rotations, independent for each tracker and frame.

    Args:
        poses: Poses of any leading shape.
        rng: Random generator.

    Source: LoBSTr, appendix 2: vectors of any direction whose length is drawn from a normal distribution, small rotations.
    """
    shape = poses.positions.shape[:-1]
    moved = rng.normal(0.0, POSITION_NOISE_STD_M, (*shape, 1)) * _random_directions(rng, shape)
    turned = _random_rotations(rng, rng.uniform(0.0, MAX_ROTATION_NOISE_RAD, shape))
    return TrackerPoses(poses.positions + moved, multiply(turned, poses.rotations))


def simulate_t_pose(seconds: float, rng: np.random.Generator | None = None, legs: bool = False) -> TrackerPoses:
    """Return poses of the standard humanoid's joints in a T-pose, soles on the ground, facing x, at ``TRACKER_RATE_HZ``.

    Args:
        seconds: Duration [s].
        rng: Random generator of a person's imperfection: arms, elbows and head a few degrees off, and sway. Perfect pose if None.
        legs: Whether feet and shins are among the joints, their stance then as imperfect as the arms.
    """
    frames = max(1, round(seconds * TRACKER_RATE_HZ))
    angles = np.zeros((frames, HINGE_COUNT))
    if rng is not None:
        angles += _SWAY * smooth_noise(np.arange(frames) / TRACKER_RATE_HZ, rng, HINGE_COUNT, _SWAY_PERIOD)
        for name, degrees in _STANCE.items():
            angles[:, HINGE_NAMES.index(name)] += np.radians(rng.normal(0.0, degrees))
        for name, sign in _ELBOWS.items():
            elbow = HINGE_NAMES.index(name)
            angles[:, elbow] = sign * np.abs(sign * rng.uniform(0.0, _ELBOW) + angles[:, elbow])
        for part, degrees in _LEG_STANCE.items() if legs else ():
            for side in "lr":
                joint, axis = part.split("_")
                angles[:, HINGE_NAMES.index(f"{joint}_{side}_{axis}")] += np.radians(rng.normal(0.0, degrees))
    root = np.tile([0.0, 0.0, PELVIS_HEIGHT], (frames, 1))
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1))
    pose = BodyMotion(root, rotations_from_hinges(upright, angles), TRACKER_RATE_HZ, "T-pose")
    return tracker_poses(pose, len(ALL_TRACKER_NAMES) if legs else len(TRACKER_NAMES))


def _random_directions(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Return random unit vectors (*shape, 3), uniform over directions."""
    v = rng.normal(size=(*shape, 3))
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def _random_rotations(rng: np.random.Generator, radians: np.ndarray) -> np.ndarray:
    """Return rotations (..., 4) by ``radians`` (...) about random axes."""
    return from_rotation_vector(radians[..., None] * _random_directions(rng, radians.shape))
