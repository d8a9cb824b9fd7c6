"""What the 19 sensors of an IMU suit measure while a clip is performed: the first half of making a clip faulty.

N samples at 100 Hz, S = 19 sensors. The recording starts before the clip: the wearer stands in a T-pose, as suits ask
for, and eases from there into the clip's first frame, so that filter and calibration start as they do in life.
"""

from dataclasses import asdict, dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from datasets.humanoid import ANKLE_HEIGHT, BODY_COUNT, CENTRES, LEG_LENGTH, NAMES, SKELETON
from datasets.kinematics import continuous, resample
from datasets.motion import BodyMotion
from datasets.rotation import about_axis, conjugate, from_rotation_vector, heading, multiply, normalise, rotate, to_rotation_vector
from datasets.skeleton import forward_kinematics

SENSOR_RATE = 100.0  # Hz
SENSOR_BODIES: tuple[int, ...] = tuple(b for b, name in enumerate(NAMES) if name != "spine")  # a suit interpolates the spine
GRAVITY = np.array([0.0, 0.0, -9.81])  # m/s^2
EARTH_FIELD = np.array([0.0, np.cos(1.15), -np.sin(1.15)])  # unit strength, magnetic north along +y, dip 66 degrees (mid Europe)
STAND_SECONDS, EASE_SECONDS = 5.0, 2.0  # in the T-pose; from there into the clip
CALIBRATION = slice(int(2.0 * SENSOR_RATE), int(STAND_SECONDS * SENSOR_RATE))  # samples that the calibration averages
START = int((STAND_SECONDS + EASE_SECONDS) * SENSOR_RATE)  # sample of the clip's first frame
BANDWIDTH = 12.0  # Hz, of human motion; above it optical clips hold marker noise, which would drown in second derivatives
_STANDING_HEIGHT = LEG_LENGTH + ANKLE_HEIGHT - SKELETON.offsets[NAMES.index("thigh_l"), 2]
_SLIP_SECONDS = 2.0  # s, between the knots of the slow slip
_TISSUE_BANDWIDTH = 4.0  # Hz, of flesh under a strapped sensor
_BURST = 6.0  # samples, mean length of a packet loss


@dataclass(frozen=True)
class SuitNoise:
    """How wrong the sensors and their placement are; every level is a standard deviation unless it says otherwise.

    GlobalPose stands for Yi et al. 2025, "Improving Global Motion Estimation in Sparse IMU-based Motion Capture with
    Physics"; its walks are per sample. The others are measured or argued where they stand.

    Attributes:
        gyroscope_noise: White [rad/s]. GlobalPose.
        gyroscope_bias: At switch-on [rad/s].
        gyroscope_walk: Random walk of the bias [rad/s per sample]. GlobalPose.
        accelerometer_noise: White [m/s^2]. GlobalPose.
        accelerometer_bias: At switch-on [m/s^2].
        accelerometer_walk: Random walk of the bias [m/s^2 per sample]. GlobalPose.
        magnetometer_noise: White [share of the earth's field]. GlobalPose.
        magnetic_disturbance: Field of a hidden dipole at the floor above it [share of the earth's field].
        placement: Distance of a sensor from its body's centre [m].
        slip_position: Slow wander of a sensor on its body [m]. GlobalPose.
        slip_rotation: Slow wander of a sensor on its body [rad].
        tissue_rotation: Tilt of a sensor by soft tissue per acceleration of its body [rad per m/s^2].
        calibration_error: Difference between the wearer's T-pose and the ideal one, per body [rad]. GlobalPose.
        length_error: Relative error of the leg lengths that the wearer typed in.
        packet_loss: Share of samples lost, in bursts [ratio].
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
class Recording:
    """Raw signals of the 19 sensors, each in its own frame, from the T-pose to the clip's end.

    Attributes:
        accelerations: Specific force, +9.81 upwards at rest [m/s^2], shape (N, 19, 3).
        angular_velocities: Mean over the interval that ends at the sample [rad/s], shape (N, 19, 3).
        magnetic_fields: In units of the earth's field, shape (N, 19, 3).
        heading: Of the wearer in the T-pose [rad]; suits let the wearer face a known direction.
        orientations: The truth of the sensors in the world, wxyz, shape (N, 19, 4): to measure a filter with, never read by it.
    """

    accelerations: np.ndarray
    angular_velocities: np.ndarray
    magnetic_fields: np.ndarray
    heading: float
    orientations: np.ndarray


def record(clean: BodyMotion, noise: SuitNoise, rng: np.random.Generator) -> Recording:
    """Return what a suit's sensors measure while ``clean`` is performed.

    Args:
        clean: Any clip, the truth.
        noise: Levels of all errors.
        rng: Source of all randomness.

    Returns:
        Raw signals at 100 Hz; the clip's first frame is sample ``START``.
    """
    positions, rotations = _performance(clean, noise, rng)
    count = len(positions)
    bodies = list(SENSOR_BODIES)
    positions, rotations = positions[:, bodies], rotations[:, bodies]
    acceleration = _second_difference(positions)
    mounting = from_rotation_vector(rng.uniform(-np.pi, np.pi, (len(bodies), 3)) / np.sqrt(3.0))
    place = CENTRES[bodies] + noise.placement / np.sqrt(3.0) * rng.standard_normal((len(bodies), 3))
    place = place + noise.slip_position * _slow_wander(count, rng)
    positions = positions + rotate(rotations, place)
    tilt = noise.slip_rotation / np.sqrt(3.0) * _slow_wander(count, rng) + _tissue(acceleration, rotations, noise, rng)
    orientations = multiply(multiply(rotations, from_rotation_vector(tilt)), mounting)
    inverse = conjugate(orientations)
    force = rotate(inverse, _second_difference(positions) - GRAVITY)
    turn = np.zeros_like(force)
    turn[1:] = to_rotation_vector(multiply(inverse[:-1], orientations[1:])) * SENSOR_RATE
    field = rotate(inverse, EARTH_FIELD + _disturbance(positions, noise, rng))
    signals = (
        force + _errors(force.shape, noise.accelerometer_noise, noise.accelerometer_bias, noise.accelerometer_walk, rng),
        turn + _errors(turn.shape, noise.gyroscope_noise, noise.gyroscope_bias, noise.gyroscope_walk, rng),
        field + _errors(field.shape, noise.magnetometer_noise, 0.0, 0.0, rng),
    )
    held = _last_arrived(count, noise.packet_loss, rng)
    accelerations, velocities, fields = (np.take_along_axis(signal, held[:, :, None], axis=0) for signal in signals)
    return Recording(accelerations, velocities, fields, float(heading(clean.local_rotations[0, 0])), orientations)


def _performance(clean: BodyMotion, noise: SuitNoise, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (N, 20, 3) and rotations (N, 20, 4) of the bodies at 100 Hz: T-pose, ease, clip."""
    clip = resample(clean, SENSOR_RATE)
    root, local = clip.root_position, clip.local_rotations
    before_root, before_local = _standing(root, local, noise, rng)
    low_pass = butter(2, BANDWIDTH, fs=SENSOR_RATE, output="sos")
    root = sosfiltfilt(low_pass, np.concat([before_root, root]), axis=0)
    local = normalise(sosfiltfilt(low_pass, continuous(np.concat([before_local, local])), axis=0))
    offsets = np.broadcast_to(SKELETON.offsets, (len(root), BODY_COUNT, 3)).copy()
    offsets[:, 0] = root
    return forward_kinematics(SKELETON.parents, offsets, local)


def _standing(root: np.ndarray, local: np.ndarray, noise: SuitNoise, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return root and local rotations of the T-pose and of a quintic ease that meets the clip with its velocity."""
    parents = np.array(SKELETON.parents)
    error = from_rotation_vector(noise.calibration_error / np.sqrt(3.0) * rng.standard_normal((BODY_COUNT, 3)))
    pose = np.concat([error[:1], multiply(conjugate(error[parents[1:]]), error[1:])])
    up = np.array([0.0, 0.0, 1.0])
    pose[0] = multiply(about_axis(up, np.asarray(heading(local[0, 0]))), pose[0])
    ahead = min(1, len(root) - 1)
    velocity = (root[ahead] - root[0]) * SENSOR_RATE
    turn = to_rotation_vector(multiply(conjugate(local[0]), local[ahead])) * SENSOR_RATE
    place = root[0] - 0.5 * EASE_SECONDS * velocity
    place[2] = _STANDING_HEIGHT
    s = np.maximum(0.0, (np.arange(START) / SENSOR_RATE - STAND_SECONDS) / EASE_SECONDS)
    leave, meet = 1 - 10 * s**3 + 15 * s**4 - 6 * s**5, EASE_SECONDS * (-4 * s**3 + 7 * s**4 - 3 * s**5)
    away = to_rotation_vector(multiply(conjugate(local[0]), pose))
    rotations = multiply(local[:1], from_rotation_vector(leave[:, None, None] * away + meet[:, None, None] * turn))
    return root[0] + leave[:, None] * (place - root[0]) + meet[:, None] * velocity, rotations


def _second_difference(positions: np.ndarray) -> np.ndarray:
    """Return accelerations [m/s^2] at 100 Hz, those at the ends repeated."""
    inner = (positions[2:] - 2 * positions[1:-1] + positions[:-2]) * SENSOR_RATE**2
    return np.concat([inner[:1], inner, inner[-1:]])


def _slow_wander(count: int, rng: np.random.Generator) -> np.ndarray:
    """Return smooth random paths (N, 19, 3) of unit variance that change within seconds."""
    knots = rng.standard_normal((int(count / SENSOR_RATE / _SLIP_SECONDS) + 3, len(SENSOR_BODIES), 3))
    return CubicSpline(np.arange(len(knots)) * _SLIP_SECONDS, knots)(np.arange(count) / SENSOR_RATE)


def _tissue(acceleration: np.ndarray, rotations: np.ndarray, noise: SuitNoise, rng: np.random.Generator) -> np.ndarray:
    """Return the tilt (N, 19, 3) [rad] of each sensor as the flesh below it lags behind the acceleration of its body."""
    compliance = noise.tissue_rotation / np.sqrt(3.0) * rng.standard_normal((len(SENSOR_BODIES), 3, 3))
    swing = sosfiltfilt(butter(2, _TISSUE_BANDWIDTH, fs=SENSOR_RATE, output="sos"), acceleration, axis=0)
    tilt = np.einsum("sij,nsj->nsi", compliance, rotate(conjugate(rotations), swing))
    return 0.3 * np.tanh(tilt / 0.3)  # straps hold: no sensor tilts further


def _disturbance(positions: np.ndarray, noise: SuitNoise, rng: np.random.Generator) -> np.ndarray:
    """Return the field (N, 19, 3) of dipoles hidden in the floor: pipes and reinforcement disturb feet most (de Vries 2009)."""
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
