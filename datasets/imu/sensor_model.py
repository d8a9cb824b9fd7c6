"""Sensor model of an IMU suit: raw signals of its 19 sensors during a clip, the first half of the suit's simulation.

N samples at 100 Hz, S = 19 sensors. The recording starts before the clip: the wearer stands in a T-pose, as suits require, and
eases from there into the clip's first frame, so that filter and calibration start as with a real suit.
"""

from dataclasses import asdict, dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import ANKLE_HEIGHT, BODY_COM_OFFSETS, BODY_COUNT, BODY_NAMES, GRAVITY_M_S2, LEG_LENGTH, SKELETON
from datasets.motion.kinematics import align_quaternion_signs, linear_acceleration, resample
from datasets.motion.rotation import (
    conjugate,
    from_rotation_vector,
    from_yaw,
    heading,
    multiply,
    normalise,
    rotate,
    to_rotation_vector,
)
from datasets.motion.skeleton import forward_kinematics

SENSOR_RATE_HZ = 100.0  # Hz
SENSOR_BODIES: tuple[int, ...] = tuple(b for b, name in enumerate(BODY_NAMES) if name != "spine")  # suits interpolate the spine
GRAVITY_VECTOR_M_S2 = np.array([0.0, 0.0, -GRAVITY_M_S2])  # m/s^2
EARTH_FIELD = np.array([0.0, np.cos(1.15), -np.sin(1.15)])  # unit strength, magnetic north along +y, dip 66 degrees (mid Europe)
STAND_SECONDS, EASE_SECONDS = 5.0, 2.0  # s, in the T-pose; from there into the clip
CALIBRATION_SAMPLES = slice(int(2.0 * SENSOR_RATE_HZ), int(STAND_SECONDS * SENSOR_RATE_HZ))  # over which the calibration averages
CLIP_START_SAMPLE = int((STAND_SECONDS + EASE_SECONDS) * SENSOR_RATE_HZ)  # index of the clip's first frame
MOTION_BANDWIDTH_HZ = 12.0  # Hz, of human motion; above it optical clips hold marker noise, which would drown in second derivatives
_STANDING_HEIGHT = LEG_LENGTH + ANKLE_HEIGHT - SKELETON.offsets[BODY_NAMES.index("thigh_l"), 2]
_SLIP_SECONDS = 2.0  # s, of brisk motion between the knots of the slow slip
_SLIP_ACCELERATION = 5.0  # m/s^2, slowly varying, that counts as brisk
_TISSUE_BANDWIDTH = 4.0  # Hz, of flesh under a strapped sensor
_FLESH = np.array([2.0 if BODY_NAMES[b].startswith(("thigh", "shin", "upper_arm")) else 1.0 for b in SENSOR_BODIES])  # muscle wobbles more
_STRAP = 0.3  # rad, largest tilt that a strap allows
_BURST = 6.0  # samples, mean length of a packet loss


@dataclass(frozen=True)
class SuitNoise:
    """Noise levels of the sensors and their placement; every level is a standard deviation unless stated otherwise.

    "GlobalPose" stands for the levels of Yi et al. 2025, "Improving Global Motion Estimation in Sparse IMU-based Motion
    Capture with Physics"; its walks are per sample. "Measured" levels are from two real recordings, 17 sensors
    at rest and 7 in a walk beside Vicon: ``python -m eval.study suit`` prints both sides.

    Attributes:
        gyroscope_noise: White noise [rad/s]. GlobalPose; measured 2e-3 to 6e-3 on a quiet wearer.
        gyroscope_bias: Bias at switch-on [rad/s]. 0.2 to 0.5 deg/s is usual on data sheets of such chips.
        gyroscope_walk: Random walk of the bias [rad/s per sample]. GlobalPose.
        accelerometer_noise: White noise [m/s^2]. GlobalPose; measured 3e-2.
        accelerometer_bias: Bias at switch-on [m/s^2]. Measured: the norm of gravity differs by 0.1 from sensor to sensor.
        accelerometer_walk: Random walk of the bias [m/s^2 per sample]. GlobalPose.
        magnetometer_noise: White noise [share of the earth's field]. GlobalPose; measured 3e-3.
        magnetic_disturbance: Field of a dipole under the floor, at the floor above it [share of the earth's field]. Chosen so that
            the norm varies in a walk as measured: by 0.01 at the pelvis and 0.15 at the feet. Decay with height as found by
            de Vries et al. 2009, "Magnetic distortion in motion labs".
        placement: Distance of a sensor from its body's centre [m].
        slip_position: Slow slip of a sensor on its body [m]. GlobalPose.
        slip_rotation: Slow slip of a sensor on its body [rad]. Chosen with the next towards the measured error in a walk.
        tissue_rotation: Tilt of a sensor by soft tissue per acceleration of its body [rad per m/s^2].
        calibration_error: Difference between the wearer's T-pose and the ideal one, per body [rad]. GlobalPose.
        length_error: Relative error of the leg lengths that the wearer entered: 2 % is 2 cm on a leg.
        packet_loss: Share of samples lost, in bursts [ratio]. A wireless link in a usual room.
    """

    gyroscope_noise: float = 5e-3
    gyroscope_bias: float = 5e-3
    gyroscope_walk: float = 1e-5
    accelerometer_noise: float = 5e-2
    accelerometer_bias: float = 0.1
    accelerometer_walk: float = 1e-4
    magnetometer_noise: float = 5e-3
    magnetic_disturbance: float = 0.4
    placement: float = 0.05
    slip_position: float = 1e-2
    slip_rotation: float = 0.06
    tissue_rotation: float = 1e-2
    calibration_error: float = 0.1
    length_error: float = 0.02
    packet_loss: float = 0.005

    def scaled(self, severity: float) -> "SuitNoise":
        """Return all levels times ``severity``: 0 is a perfect suit, 1 this one."""
        return SuitNoise(**{name: level * severity for name, level in asdict(self).items()})


@dataclass(frozen=True)
class SensorSignals:
    """Raw signals of the 19 sensors, each in its own frame, from the T-pose to the clip's end.

    Attributes:
        accelerations: Specific force, +9.81 upwards at rest [m/s^2], shape (N, 19, 3).
        angular_velocities: Angular velocity averaged over the interval that ends at the sample [rad/s], shape (N, 19, 3).
        magnetic_fields: Magnetic field [share of the earth's field], shape (N, 19, 3).
        heading: Heading of the wearer in the T-pose [rad]; suits let the wearer face a known direction.
        orientations: True rotations of the sensors in the world, wxyz, shape (N, 19, 4): to measure a filter with, never read by it.
    """

    accelerations: np.ndarray
    angular_velocities: np.ndarray
    magnetic_fields: np.ndarray
    heading: float
    orientations: np.ndarray


def simulate_sensors(clean: BodyMotion, noise: SuitNoise, rng: np.random.Generator) -> SensorSignals:
    """Return the signals of a suit's sensors during the clip ``clean``.

    Args:
        clean: Any clip, the truth.
        noise: Noise levels.
        rng: Random generator.

    Returns:
        Raw signals at 100 Hz; the clip's first frame is sample ``CLIP_START_SAMPLE``.
    """
    positions, rotations = _performance(clean, noise, rng)
    count = len(positions)
    bodies = list(SENSOR_BODIES)
    positions, rotations = positions[:, bodies], rotations[:, bodies]
    mounting = from_rotation_vector(rng.uniform(-np.pi, np.pi, (len(bodies), 3)) / np.sqrt(3.0))
    place = BODY_COM_OFFSETS[bodies] + noise.placement / np.sqrt(3.0) * rng.standard_normal((len(bodies), 3))
    swing = rotate(conjugate(rotations), sosfiltfilt(low_pass(_TISSUE_BANDWIDTH), linear_acceleration(positions, SENSOR_RATE_HZ), axis=0))
    positions = positions + rotate(rotations, place + noise.slip_position / np.sqrt(3.0) * _slip(swing, rng))
    tilt = noise.slip_rotation / np.sqrt(3.0) * _slip(swing, rng) + _tissue(swing, noise.tissue_rotation, rng)
    orientations = multiply(multiply(rotations, from_rotation_vector(tilt)), mounting)
    inverse = conjugate(orientations)
    force = rotate(inverse, linear_acceleration(positions, SENSOR_RATE_HZ) - GRAVITY_VECTOR_M_S2)
    turn = np.zeros_like(force)
    turn[1:] = to_rotation_vector(multiply(inverse[:-1], orientations[1:])) * SENSOR_RATE_HZ
    field = rotate(inverse, EARTH_FIELD + _disturbance(positions, noise, rng))
    signals = (
        force + _errors(force.shape, noise.accelerometer_noise, noise.accelerometer_bias, noise.accelerometer_walk, rng),
        turn + _errors(turn.shape, noise.gyroscope_noise, noise.gyroscope_bias, noise.gyroscope_walk, rng),
        field + _errors(field.shape, noise.magnetometer_noise, 0.0, 0.0, rng),
    )
    held = _last_arrived(count, noise.packet_loss, rng)
    accelerations, velocities, fields = (np.take_along_axis(signal, held[:, :, None], axis=0) for signal in signals)
    return SensorSignals(accelerations, velocities, fields, float(heading(clean.local_rotations[0, 0])), orientations)


def _performance(clean: BodyMotion, noise: SuitNoise, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (N, 20, 3) and rotations (N, 20, 4) of the bodies at 100 Hz: T-pose, ease, clip."""
    clip = resample(clean, SENSOR_RATE_HZ)
    root, local = clip.root_position, clip.local_rotations
    before_root, before_local = _standing(root, local, noise, rng)
    smooth = low_pass(MOTION_BANDWIDTH_HZ)
    root = sosfiltfilt(smooth, np.concat([before_root, root]), axis=0)
    local = normalise(sosfiltfilt(smooth, align_quaternion_signs(np.concat([before_local, local])), axis=0))
    offsets = np.broadcast_to(SKELETON.offsets, (len(root), BODY_COUNT, 3)).copy()
    offsets[:, 0] = root
    return forward_kinematics(SKELETON.parents, offsets, local)


def _standing(root: np.ndarray, local: np.ndarray, noise: SuitNoise, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return root path and local rotations of the T-pose and of a quintic ease that meets the clip with its velocity."""
    parents = np.array(SKELETON.parents)
    error = from_rotation_vector(noise.calibration_error / np.sqrt(3.0) * rng.standard_normal((BODY_COUNT, 3)))
    pose = np.concat([error[:1], multiply(conjugate(error[parents[1:]]), error[1:])])
    pose[0] = multiply(from_yaw(heading(local[0, 0])), pose[0])
    ahead = min(1, len(root) - 1)
    velocity = (root[ahead] - root[0]) * SENSOR_RATE_HZ
    turn = to_rotation_vector(multiply(conjugate(local[0]), local[ahead])) * SENSOR_RATE_HZ
    place = root[0] - 0.5 * EASE_SECONDS * velocity
    place[2] = _STANDING_HEIGHT
    s = np.maximum(0.0, (np.arange(CLIP_START_SAMPLE) / SENSOR_RATE_HZ - STAND_SECONDS) / EASE_SECONDS)
    leave, meet = 1 - 10 * s**3 + 15 * s**4 - 6 * s**5, EASE_SECONDS * (-4 * s**3 + 7 * s**4 - 3 * s**5)
    away = to_rotation_vector(multiply(conjugate(local[0]), pose))
    rotations = multiply(local[:1], from_rotation_vector(leave[:, None, None] * away + meet[:, None, None] * turn))
    return root[0] + leave[:, None] * (place - root[0]) + meet[:, None] * velocity, rotations


def low_pass(bandwidth: float) -> np.ndarray:
    """Return a filter for signals at 100 Hz that, run forward and backward, halves the amplitude at ``bandwidth`` [Hz]."""
    return np.asarray(butter(2, bandwidth, fs=SENSOR_RATE_HZ, output="sos"))


def _slip(swing: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return smooth random paths (N, 19, 3) of unit variance along which sensors slip while their bodies accelerate.

    Args:
        swing: Slow part of each body's acceleration in its own frame [m/s^2], shape (N, 19, 3). At rest nothing slips.
        rng: Random generator.
    """
    activity = np.minimum(np.linalg.norm(swing, axis=-1) / _SLIP_ACCELERATION, 1.0)
    moved = np.cumsum(activity, axis=0) / SENSOR_RATE_HZ / _SLIP_SECONDS
    knots = rng.standard_normal((int(len(swing) / SENSOR_RATE_HZ / _SLIP_SECONDS) + 3, len(SENSOR_BODIES), 3))
    paths = [CubicSpline(np.arange(len(knots)), knots[:, sensor])(moved[:, sensor]) for sensor in range(len(SENSOR_BODIES))]
    return np.stack(paths, axis=1)


def _tissue(swing: np.ndarray, compliance: float, rng: np.random.Generator) -> np.ndarray:
    """Return the tilt (N, 19, 3) [rad] of each sensor by soft tissue, which lags behind the acceleration of its body."""
    matrices = compliance / np.sqrt(3.0) * rng.standard_normal((len(SENSOR_BODIES), 3, 3))
    tilt = np.einsum("sij,nsj,s->nsi", matrices, swing, _FLESH)
    return _STRAP * np.tanh(tilt / _STRAP)


def _disturbance(positions: np.ndarray, noise: SuitNoise, rng: np.random.Generator) -> np.ndarray:
    """Return the field (N, 19, 3) of dipoles under the floor: pipes and reinforcement disturb feet most (de Vries 2009)."""
    low, high = positions.min(axis=(0, 1))[:2] - 1.0, positions.max(axis=(0, 1))[:2] + 1.0
    dipoles = int(np.clip(np.prod(high - low), 9, 24))  # about one a square metre
    depths = rng.uniform(0.1, 0.5, dipoles)
    places = np.column_stack([rng.uniform(low, high, (dipoles, 2)), -depths])
    moments = noise.magnetic_disturbance * depths[:, None] ** 3 * rng.standard_normal((dipoles, 3)) / np.sqrt(3.0)
    field = np.zeros_like(positions)
    for place, moment in zip(places, moments, strict=True):
        away = positions - place
        square = np.maximum(np.sum(away * away, axis=-1, keepdims=True), 0.1**2)  # no sensor is inside the iron
        field += (3 * away * (away @ moment)[..., None] / square - moment) / square**1.5
    return field


def _errors(shape: tuple[int, ...], white: float, bias: float, walk: float, rng: np.random.Generator) -> np.ndarray:
    """Return the additive error of one kind of sensor: white noise, a bias, and the bias' random walk."""
    drift = np.cumsum(walk * rng.standard_normal(shape), axis=0)
    return white * rng.standard_normal(shape) + bias * rng.standard_normal(shape[1:]) + drift


def _last_arrived(count: int, loss: float, rng: np.random.Generator) -> np.ndarray:
    """Return for each sample and sensor (N, 19) the index of the last sample that arrived; losses come in bursts."""
    shape = (count, len(SENSOR_BODIES))
    lost = np.zeros(shape, dtype=bool)
    starts = np.argwhere(rng.random(shape) < loss / _BURST)
    for (start, sensor), length in zip(starts, rng.geometric(1.0 / _BURST, len(starts)), strict=True):
        lost[max(start, 1) : start + length, sensor] = True
    return np.maximum.accumulate(np.where(lost, 0, np.arange(count)[:, None]), axis=0)
