"""Simulation of an IMU suit: orientations, pose and root path from the sensors' signals; a faulty clip beside the clean one.

N samples at 100 Hz of the clip itself, S = 19 sensors. The input is that of a suit's software: the raw signals, a T-pose facing a
known direction at the start, and the (slightly wrong) leg lengths that the wearer entered.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from vqf import VQF

from datasets.imu.sensor_model import (
    CALIBRATION_SAMPLES,
    CLIP_START_SAMPLE,
    GRAVITY_VECTOR_M_S2,
    SENSOR_BODIES,
    SENSOR_RATE_HZ,
    SensorSignals,
    SuitNoise,
    simulate_sensors,
)
from datasets.motion.clip import SIMULATED_SUIT, BodyMotion
from datasets.motion.humanoid import (
    BALL_OFFSET,
    BODIES,
    BODY_COUNT,
    BODY_NAMES,
    FOOT_AND_TOE_BODIES,
    HEEL_OFFSET,
    SKELETON,
    TOE_TIP_OFFSET,
)
from datasets.motion.kinematics import align_quaternion_signs, place_on_ground
from datasets.motion.rotation import conjugate, from_rotation_vector, from_yaw, multiply, normalise, rotate, to_rotation_vector
from datasets.motion.skeleton import forward_kinematics

_PELVIS = SENSOR_BODIES.index(BODY_NAMES.index("pelvis"))
_STANCE_HEIGHT = 0.03  # m, above the lowest sole point, within which another one may stand too
_STANCE_SPEED = 0.8  # m/s, of a sole point, above which it does not stand
_STANCE_FLOOR = 0.03  # weight of a moving lowest point: without it the root would drift away on its accelerations
_FREE_FALL = 3.0  # m/s^2, specific force below which a body does not stand; from twice as much on it may
_HOLD_SECONDS = 0.02  # s, within which the root takes over the velocity that keeps the standing foot where it was
_GROUND_SECONDS = 0.15  # s, within which the standing foot is pulled to the ground


@dataclass(frozen=True)
class SuitClip:
    """Clip as captured by a simulated suit, with the true clip.

    Attributes:
        faulty: Captured clip, of the same length and frame rate as ``clean``, named with "_suit".
        accelerations: Free accelerations in the world's axes, thesis eq. 3.2, at 100 Hz whatever the clip's rate [m/s^2],
            shape (N, 19, 3); the bodies are ``SENSOR_BODIES``, the first sample is the clip's first frame.
        clean: True clip.
    """

    faulty: BodyMotion
    accelerations: np.ndarray
    clean: BodyMotion


def simulate_suit(clean: BodyMotion, seed: int, severity: float = 1.0) -> SuitClip:
    """Return the clip as captured by a simulated IMU suit.

    Args:
        clean: Any clip, the truth.
        seed: Seed of all randomness: the same seed gives the same recording. Another seed is another session with the suit.
        severity: Factor of all errors of sensors and wearer; 0 is a perfect suit, 1 a usual one.

    Returns:
        Faulty clip, its accelerations and the clean clip. The root starts above the clean root's first position; its height
        is measured from the feet of the faulty pose.
    """
    rng = np.random.default_rng(seed)
    noise = SuitNoise().scaled(severity)
    recording = simulate_sensors(clean, noise, rng)
    leg_scale = 1.0 + noise.length_error * rng.standard_normal()
    sensors = sensor_orientations(recording)
    free = rotate(sensors, recording.accelerations)[CLIP_START_SAMPLE:] + GRAVITY_VECTOR_M_S2
    free.setflags(write=False)
    local = fit_skeleton(body_orientations(sensors, recording.heading)[CLIP_START_SAMPLE:])
    root = track_root(local, free[:, _PELVIS], leg_scale)
    root[:, :2] += clean.root_position[0, :2] - root[0, :2]
    root, local = _at_clip_rate(root, local, clean)
    faulty = replace(clean, root_position=root, local_rotations=local, name=f"{clean.name}_suit", system=SIMULATED_SUIT)
    return SuitClip(place_on_ground(faulty), free, clean)


def sensor_orientations(recording: SensorSignals) -> np.ndarray:
    """Return each sensor's orientation in the world as VQF estimates it from 9 axes, wxyz, shape (N, 19, 4).

    Source: Laidig and Seel 2023, "VQF"; its earth frame has magnetic north along +y, as ``EARTH_FIELD`` has.
    """
    signals = (recording.angular_velocities, recording.accelerations, recording.magnetic_fields)
    tracks = []
    for sensor in range(len(SENSOR_BODIES)):
        gyroscope, accelerometer, magnetometer = (np.ascontiguousarray(signal[:, sensor]) for signal in signals)
        tracks.append(VQF(1.0 / SENSOR_RATE_HZ).updateBatch(gyroscope, accelerometer, magnetometer)["quat9D"])
    return np.stack(tracks, axis=1)


def body_orientations(sensors: np.ndarray, heading: float) -> np.ndarray:
    """Return the orientations (N, 19, 4) of the bodies below the sensors, calibrated in the T-pose.

    Args:
        sensors: Estimated orientations from the first sample on, shape (N, 19, 4).
        heading: Heading of the wearer in the T-pose [rad].
    """
    standing = from_yaw(np.array(heading))
    seen = align_quaternion_signs(conjugate(sensors[CALIBRATION_SAMPLES]))
    to_body = multiply(normalise(seen.mean(axis=0)), standing)
    return multiply(sensors, to_body)


def fit_skeleton(bodies: np.ndarray) -> np.ndarray:
    """Return local rotations within the humanoid's hinges that follow the measured orientations.

    Three-hinge joints take over their body's orientation; an elbow or a knee keeps the part about its hinge, a hand
    follows its forearm, and the spine lies halfway between pelvis and chest.

    Args:
        bodies: Orientations of ``SENSOR_BODIES`` in the world, wxyz, shape (N, 19, 4).

    Returns:
        Rotations relative to the parent body, wxyz, shape (N, 20, 4).
    """
    measured = {body: bodies[:, sensor] for sensor, body in enumerate(SENSOR_BODIES)}
    pelvis, chest = measured[0], measured[BODY_NAMES.index("chest")]
    half = from_rotation_vector(0.5 * to_rotation_vector(multiply(conjugate(pelvis), chest)))
    measured[BODY_NAMES.index("spine")] = multiply(pelvis, half)
    world, local = [pelvis], [pelvis]
    for index, body in enumerate(BODIES[1:], start=1):
        parent = world[SKELETON.parents[index]]
        turn = _about_hinges(multiply(conjugate(parent), measured[index]), body.hinges)
        local.append(turn)
        world.append(multiply(parent, turn))
    return np.stack(local, axis=1)


def _about_hinges(local: np.ndarray, hinges: str) -> np.ndarray:
    """Return the part of the rotations (N, 4) that the hinges can make: the twist about a single one."""
    if len(hinges) == 3:
        return local
    kept = np.zeros_like(local)
    kept[:, 0] = local[:, 0] if hinges else 1.0
    for axis in hinges:
        kept[:, 1 + "xyz".index(axis)] = local[:, 1 + "xyz".index(axis)]
    return normalise(kept + np.array([1e-9, 0.0, 0.0, 0.0]))


def track_root(local: np.ndarray, pelvis_acceleration: np.ndarray, leg_scale: float) -> np.ndarray:
    """Return the root path of a suit's software: standing feet stay, and between steps the pelvis' acceleration is integrated.

    A sole point has the larger weight, the lower it is and the slower it moves by the software's estimate. The root takes over
    the velocity that keeps the standing points where they were and the height that puts them on the ground.

    Args:
        local: Rotations relative to the parent body, wxyz, shape (N, 20, 4).
        pelvis_acceleration: Free acceleration of the pelvis in the world [m/s^2], shape (N, 3).
        leg_scale: Entered leg lengths over true ones.

    Returns:
        Positions of the pelvis [m], shape (N, 3), starting above the origin.
    """
    soles = _sole_points(local, leg_scale)
    step = 1.0 / SENSOR_RATE_HZ
    towards = -np.gradient(soles, step, axis=0) if len(soles) > 1 else np.zeros_like(soles)  # root's velocity that holds a point still
    lowest = soles[:, :, 2].min(axis=1)
    weight = np.linalg.norm(pelvis_acceleration - GRAVITY_VECTOR_M_S2, axis=1)  # m/s^2, specific force of the pelvis
    loaded = np.clip((weight - _FREE_FALL) / _FREE_FALL, 0.0, 1.0)
    low = np.exp(-(((soles[:, :, 2] - lowest[:, None]) / _STANCE_HEIGHT) ** 2))
    velocity = np.einsum("p,pc->c", low[0], towards[0]) / low[0].sum()
    path = np.zeros((len(local), 3))
    path[0, 2] = -lowest[0]
    for n in range(1, len(local)):
        velocity = velocity + step * pelvis_acceleration[n]
        slip = np.sum((towards[n] - velocity) ** 2, axis=1)
        stands = low[n] * (_STANCE_FLOOR + np.exp(-slip / _STANCE_SPEED**2))
        surely = loaded[n] * stands.max() / (1.0 + _STANCE_FLOOR)
        held = stands @ towards[n] / stands.sum()
        velocity = velocity + (1.0 - np.exp(-surely * step / _HOLD_SECONDS)) * (held - velocity)
        path[n] = path[n - 1] + step * velocity
        above = path[n, 2] + lowest[n]  # height above the ground; no software lets a foot sink in for long
        path[n, 2] -= (1.0 - np.exp(-(surely if above > 0 else 3.0) * step / _GROUND_SECONDS)) * above
    return path


def _sole_points(local: np.ndarray, leg_scale: float) -> np.ndarray:
    """Return heel, ball and toe tip of both feet (N, 6, 3) [m] relative to the pelvis, on legs of the entered length."""
    offsets = np.broadcast_to(SKELETON.offsets, (len(local), BODY_COUNT, 3)).copy()
    legs = [BODY_NAMES.index(f"{part}_{side}") for side in "lr" for part in ("shin", "foot")]
    offsets[:, legs] *= leg_scale
    positions, rotations = forward_kinematics(SKELETON.parents, offsets, local)
    points = []
    for foot, toe in FOOT_AND_TOE_BODIES:
        for body, point in ((foot, HEEL_OFFSET), (foot, BALL_OFFSET), (toe, TOE_TIP_OFFSET)):
            points.append(positions[:, body] + rotate(rotations[:, body], np.array(point)))
    return np.stack(points, axis=1)


def _at_clip_rate(root: np.ndarray, local: np.ndarray, clean: BodyMotion) -> tuple[np.ndarray, np.ndarray]:
    """Return root path and local rotations at the instants of the clean clip's frames."""
    if len(root) < 2:
        return root[: len(clean)], local[: len(clean)]
    samples, frames = np.arange(len(root)) / SENSOR_RATE_HZ, np.arange(len(clean)) / clean.fps
    return CubicSpline(samples, root)(frames), normalise(CubicSpline(samples, align_quaternion_signs(local))(frames))
