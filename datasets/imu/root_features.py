"""Frames of a clip for root models, at 100 Hz: joints relative to the pelvis, accelerations and heading; and the true path.

N frames, all vectors in the world's axes. Sensors are those of ``SENSOR_BODIES``.
"""

from typing import NamedTuple

import numpy as np

from configs.errors import InputError
from datasets.imu.sensor_model import SENSOR_BODIES, SENSOR_RATE_HZ
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, FOOT_AND_TOE_BODIES
from datasets.motion.kinematics import body_poses, centre_of_mass, resample
from datasets.motion.rotation import Array, array_namespace, heading, rotate

ROOT_RATE_HZ = SENSOR_RATE_HZ  # Hz, thesis 2.4.3 and 3.4.1
MAX_MEAN_LIFT_M_S2 = 3.0  # m/s^2, mean over a second or more: 0 between two rests, -5 over a whole long jump's flight
LOWER_BODIES: tuple[int, ...] = tuple(b for b, name in enumerate(BODY_NAMES) if name.startswith(("pelvis", "thigh", "shin", "foot", "toe")))
STANCE_BODIES = tuple(body for foot in FOOT_AND_TOE_BODIES for body in foot)  # ankle and toe joint of the left and of the right foot
# m, mean place of the toe joints of cmu/train in the humanoid's foot. The models in the package saw the humanoid's toe in its stead and
# have learnt how far that moves while such a foot rolls over its own.
USUAL_TOE_OFFSET = (0.117, 0.0, -0.037)


class RootFrames(NamedTuple):
    """Frames of one clip or of many one after the other.

    Attributes:
        joints: Origins of the 20 bodies relative to the pelvis' [m], shape (N, 20, 3).
        stance_points: Points that may carry the body, relative to the pelvis [m], shape (N, 4, 3): ``STANCE_BODIES``, with toes as far
            from the humanoid's as the performer's are from ``USUAL_TOE_OFFSET``.
        accelerations: Free accelerations of the 19 sensors, thesis eq. 3.2 [m/s^2], shape (N, 19, 3); zero where there are none.
        heading: Heading of the pelvis [rad], shape (N,).
        centre: Centre of mass of the pose relative to the pelvis [m], shape (N, 3).
        root: True path of the pelvis [m], shape (N, 3).
        com: True path of the centre of mass [m], shape (N, 3).
    """

    joints: Array
    stance_points: Array
    accelerations: Array
    heading: Array
    centre: Array
    root: Array
    com: Array


def root_frames(motion: BodyMotion, accelerations: np.ndarray | None = None, truth: BodyMotion | None = None) -> RootFrames:
    """Return the frames of a clip for root models.

    Args:
        motion: Clip of any rate, resampled to 100 Hz along splines; its root is used only where there is no other truth.
        accelerations: Free accelerations in the clip's world at 100 Hz [m/s^2], shape (N, 19, 3), from the clip's first frame on;
            a sample more or less than the clip has is accepted.
        truth: Clean clip behind a faulty one, of the same rate and length.

    Raises:
        InputError: If the accelerations have another shape or length, are not finite, or still hold gravity.
    """
    clip = resample(motion, ROOT_RATE_HZ)
    if accelerations is not None:
        accelerations = _checked(accelerations, motion.name, len(clip))
    positions, rotations = body_poses(clip)
    centre = centre_of_mass(positions, rotations) - positions[:, 0]
    real = resample(truth, ROOT_RATE_HZ) if truth else clip
    joints = positions - positions[:, :1]
    parts = (
        joints,
        _stance_points(joints, rotations, clip.toe_offsets),
        np.zeros((len(clip), len(SENSOR_BODIES), 3)) if accelerations is None else accelerations,
        heading(clip.local_rotations[:, 0]),
        centre,
        real.root_position,
        centre_of_mass(*body_poses(real)),
    )
    return RootFrames(*(part.astype(np.float32) for part in parts))


def _stance_points(joints: np.ndarray, rotations: np.ndarray, toe_offsets: np.ndarray | None) -> np.ndarray:
    """Return ``RootFrames.stance_points`` from joints about the pelvis (N, 20, 3) [m] and rotations (N, 20, 4) in the world."""
    points = joints[:, STANCE_BODIES]
    if toe_offsets is not None:
        for side, (foot, _) in enumerate(FOOT_AND_TOE_BODIES):
            shift = np.broadcast_to(toe_offsets[side] - USUAL_TOE_OFFSET, (len(joints), 3))
            points[:, 2 * side + 1] += rotate(rotations[:, foot], shift)
    return points


def _checked(accelerations: np.ndarray, name: str, frames: int) -> np.ndarray:
    """Return accelerations (frames, 19, 3) [m/s^2]; raise InputError unless they are such, finite and without gravity."""
    if accelerations.ndim != 3 or accelerations.shape[1:] != (len(SENSOR_BODIES), 3) or abs(len(accelerations) - frames) > 1:
        should = f"({frames}, {len(SENSOR_BODIES)}, 3): {ROOT_RATE_HZ:g} Hz of the clip itself"
        raise InputError(f"{name}: accelerations have shape {accelerations.shape}, should be {should}")
    bad = np.argwhere(~np.isfinite(accelerations))
    if len(bad):
        sample, sensor = bad[0][:2]
        raise InputError(
            f"{name}: acceleration of {BODY_NAMES[SENSOR_BODIES[sensor]]} at sample {sample} is not a finite number; cut or fill the gap"
        )
    lift = float(accelerations[:, 0, 2].mean())
    if frames >= ROOT_RATE_HZ and abs(lift) > MAX_MEAN_LIFT_M_S2:
        raise InputError(
            f"{name}: the pelvis accelerates by {lift:.1f} m/s^2 upwards on average, should be near 0: free accelerations have gravity "
            "taken away, in the world's axes with z up"
        )
    return np.concat([accelerations, accelerations[-1:]])[:frames]


def concatenate_frames(clips: list[RootFrames]) -> RootFrames:
    """Return the frames of many clips one after the other."""
    return RootFrames(*(np.concat(parts) for parts in zip(*clips, strict=True)))


def to_heading_frame(vectors: Array, heading: Array) -> Array:
    """Return vectors rotated about the vertical by minus ``heading``, so that the heading becomes x.

    Args:
        vectors: Vectors in the world's axes, shape (N, ..., 3), of NumPy or torch.
        heading: Heading for each first index [rad], shape (N,).
    """
    xp = array_namespace(vectors)
    shape = (-1, *(1,) * (vectors.ndim - 2))
    cosine, sine = xp.cos(heading).reshape(shape), xp.sin(heading).reshape(shape)
    x, y = vectors[..., 0], vectors[..., 1]
    return xp.stack([cosine * x + sine * y, cosine * y - sine * x, vectors[..., 2]], -1)
