"""Whole body of synthetic motion: balanced pelvis, legs and the 20 bodies' rotations from feet, trunk and arms."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.ik.leg_ik import leg_ik
from datasets.motion.clip import FPS
from datasets.motion.curves import smooth_below
from datasets.motion.humanoid import BODY_NAMES, GRAVITY_M_S2, HEAD_BODY, SKELETON
from datasets.motion.kinematics import centre_of_mass
from datasets.motion.rotation import conjugate, from_axis_angle, multiply, rotate
from datasets.motion.skeleton import forward_kinematics
from datasets.synthetic.balance import balance_correction, balanced_path, reachable_height
from datasets.synthetic.footsteps import FeetTrack

BALANCE_ITERATIONS = 5  # the last one moves the pelvis by a few millimetres in a run, by less than one elsewhere
_Y = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class PostureTrack:
    """Posture of the body above its feet, from which the pelvis' path and the legs follow.

    Attributes:
        pelvis: Yaw, pitch and roll of the pelvis in the world [rad], shape (T, 3).
        upper: Local rotations of the 20 bodies, wxyz, shape (T, 20, 4); those of pelvis, head and legs are not read.
        head: Yaw, pitch and roll of the head in the world [rad], shape (T, 3).
        height: Largest height of the pelvis [m], shape (T,).
        leg: Largest distance from hip to ankle [m].
        bounce: Height of the pelvis relative to touchdown in a run [m], shape (T,).
        flying: Weight of ``bounce``, 0 to 1, shape (T,).
    """

    pelvis: np.ndarray
    upper: np.ndarray
    head: np.ndarray
    height: np.ndarray
    leg: float
    bounce: np.ndarray
    flying: np.ndarray


def from_yaw_pitch_roll(angles: np.ndarray) -> np.ndarray:
    """Return rotations wxyz (T, 4) of yaw, pitch and roll (T, 3) [rad], about z, then y, then x of the body."""
    return Rotation.from_euler("ZYX", angles).as_quat(scalar_first=True)


def solve_whole_body(feet: FeetTrack, posture: PostureTrack) -> tuple[np.ndarray, np.ndarray]:
    """Return the root path (T, 3) [m] and the local rotations (T, 20, 4) of a body that keeps its balance.

    The pelvis starts on the path that would balance a point mass over the centre of pressure; then it is shifted until the ground's
    force on the 20 moving bodies acts at that point (after Kajita et al. 2003).
    """
    root_rotation = from_yaw_pitch_roll(posture.pelvis)
    local = posture.upper.copy()
    local[:, 0] = root_rotation
    pressure = feet.pressure
    root, wave = np.zeros_like(pressure), np.zeros(len(pressure))
    root[:, :2] = balanced_path(pressure[:, :2], np.full(len(pressure), GRAVITY_M_S2 / 0.9), FPS)
    for _ in range(BALANCE_ITERATIONS):
        root[:, 2] = _height(root, root_rotation, feet, posture) - posture.flying * wave
        _legs(local, root, root_rotation, feet)
        rotations = _poses(root, local)[1]
        local[:, HEAD_BODY] = multiply(conjugate(rotations[:, SKELETON.parents[HEAD_BODY]]), from_yaw_pitch_roll(posture.head))
        positions, rotations = _poses(root, local)
        centre = centre_of_mass(positions, rotations)
        wave = (centre - root)[:, 2] - (centre - root)[:, 2].mean()
        root[:, :2] += balance_correction(positions, rotations, pressure, FPS)
    root[:, 2] = _height(root, root_rotation, feet, posture) - posture.flying * wave
    _legs(local, root, root_rotation, feet)
    return root, local


def _poses(root: np.ndarray, local: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    offsets = np.broadcast_to(SKELETON.offsets, (len(root), *SKELETON.offsets.shape)).copy()
    offsets[:, 0] = root
    return forward_kinematics(SKELETON.parents, offsets, local)


def _hip_offset(root_rotation: np.ndarray, side: int) -> np.ndarray:
    """Return the hip relative to the pelvis in the world's axes [m], shape (T, 3)."""
    hip = SKELETON.offsets[BODY_NAMES.index(f"thigh_{'lr'[side]}")]
    return rotate(root_rotation, np.broadcast_to(hip, (len(root_rotation), 3)))


def _height(root: np.ndarray, root_rotation: np.ndarray, feet: FeetTrack, posture: PostureTrack) -> np.ndarray:
    """Return the pelvis' height (T,) [m]: as high as the legs allow, smoothed; that of ``bounce`` where the body flies."""
    reach = np.min([reachable_height(_hip_offset(root_rotation, s), root[:, :2], feet.ankle[:, s], posture.leg) for s in (0, 1)], axis=0)
    walking = smooth_below(np.minimum(reach, posture.height), 5.0)
    if not posture.flying.any():
        return walking
    flying = posture.bounce + smooth_below(reach - posture.bounce, 10.0)
    return walking + posture.flying * (flying - walking)


def _legs(local: np.ndarray, root: np.ndarray, root_rotation: np.ndarray, feet: FeetTrack) -> None:
    """Write the rotations of thighs, shins, feet and toes that follow the track of the feet into ``local`` (T, 20, 4)."""
    heading = np.arctan2(*(rotate(root_rotation, np.broadcast_to([1.0, 0.0, 0.0], root.shape))[:, axis] for axis in (1, 0)))
    for side, name in enumerate("lr"):
        thigh, shin, foot, toe = (BODY_NAMES.index(f"{part}_{name}") for part in ("thigh", "shin", "foot", "toe"))
        splay = feet.yaw[:, side] - heading
        knee = heading + 0.7 * (splay - 2.0 * np.pi * np.round(splay / (2.0 * np.pi)))
        forward = np.stack([np.cos(knee), np.sin(knee), 0.0 * knee], axis=1)
        hip = root + _hip_offset(root_rotation, side)
        thigh_w, flexion = leg_ik(hip, feet.ankle[:, side], forward)
        local[:, thigh] = multiply(conjugate(root_rotation), thigh_w)
        local[:, shin] = from_axis_angle(_Y, flexion)
        sole = from_yaw_pitch_roll(np.stack([feet.yaw[:, side], feet.pitch[:, side], 0.0 * flexion], axis=1))
        local[:, foot] = multiply(conjugate(multiply(thigh_w, local[:, shin])), sole)
        local[:, toe] = from_axis_angle(_Y, feet.toe_bend[:, side])
