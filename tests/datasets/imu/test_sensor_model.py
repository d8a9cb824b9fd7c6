"""Sensor signals of clips whose physics is known."""

import numpy as np
import pytest

from datasets.imu.sensor_model import CALIBRATION_SAMPLES, CLIP_START_SAMPLE, EARTH_FIELD, SENSOR_BODIES, SuitNoise, simulate_sensors
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES
from datasets.motion.kinematics import align_quaternion_signs, resample
from datasets.motion.rotation import from_axis_angle, rotate

STANDING = 0.94
PERFECT = SuitNoise().scaled(0.0)
PELVIS = SENSOR_BODIES.index(0)


def clip(root: np.ndarray, pelvis: np.ndarray | None = None, fps: float = 60.0) -> BodyMotion:
    """Return a T-pose along ``root`` (T, 3) whose pelvis is turned by ``pelvis`` (T, 4)."""
    local = np.tile([1.0, 0.0, 0.0, 0.0], (len(root), BODY_COUNT, 1))
    if pelvis is not None:
        local[:, 0] = pelvis
    return BodyMotion(root, local, fps, "test")


def standing(frames: int = 120) -> BodyMotion:
    """Return a motionless T-pose."""
    return clip(np.tile([0.0, 0.0, STANDING], (frames, 1)))


def test_perfect_sensors_at_rest() -> None:
    """At rest a sensor measures 9.81 m/s^2, no turning and the earth's field of strength 1, whatever its mounting."""
    recording = simulate_sensors(standing(), PERFECT, np.random.default_rng(1))
    assert np.linalg.norm(recording.accelerations, axis=-1) == pytest.approx(9.81, abs=1e-6)
    assert recording.angular_velocities == pytest.approx(0.0, abs=1e-6)
    assert np.linalg.norm(recording.magnetic_fields, axis=-1) == pytest.approx(1.0)
    up = rotate(recording.orientations, recording.accelerations)
    assert up == pytest.approx(np.broadcast_to([0, 0, 9.81], up.shape), abs=1e-6)
    assert rotate(recording.orientations, recording.magnetic_fields) == pytest.approx(np.broadcast_to(EARTH_FIELD, up.shape))


def test_nineteen_sensors_and_the_prelude() -> None:
    """A clip of 120 frames at 60 fps lasts 119/60 s: 199 samples at 100 Hz after the prelude, on all bodies but the spine."""
    recording = simulate_sensors(standing(120), SuitNoise(), np.random.default_rng(1))
    assert recording.accelerations.shape == (CLIP_START_SAMPLE + 199, 19, 3)
    assert BODY_NAMES.index("spine") not in SENSOR_BODIES


def test_turntable_is_seen_by_the_gyroscopes() -> None:
    """A body that turns about the vertical at 1 rad/s shows 1 rad/s in every gyroscope, upwards in the world."""
    seconds = np.arange(180) / 60.0
    turntable = clip(np.tile([0.0, 0.0, STANDING], (180, 1)), from_axis_angle(np.array([0.0, 0.0, 1.0]), seconds))
    recording = simulate_sensors(turntable, PERFECT, np.random.default_rng(2))
    inside = slice(CLIP_START_SAMPLE + 50, CLIP_START_SAMPLE + 250)  # away from the ends, where the low-pass leans
    world = rotate(recording.orientations, recording.angular_velocities)[inside]
    assert world == pytest.approx(np.broadcast_to([0, 0, 1.0], world.shape), abs=1e-3)


def test_circle_is_seen_by_the_accelerometers() -> None:
    """A circle of 1 m at 2 rad/s is an acceleration of w^2 r = 4 m/s^2 towards its middle."""
    angle = 2.0 * np.arange(180) / 60.0
    root = np.column_stack([np.cos(angle), np.sin(angle), np.full(180, STANDING)])
    recording = simulate_sensors(clip(root), PERFECT, np.random.default_rng(3))
    free = rotate(recording.orientations, recording.accelerations)[:, PELVIS] - [0, 0, 9.81]
    at = np.arange(50, 250)  # samples of the clip; sample n is 2 n / 100 rad on
    towards = -4.0 * np.column_stack([np.cos(at / 50), np.sin(at / 50), np.zeros(len(at))])
    assert free[CLIP_START_SAMPLE + at] == pytest.approx(towards, abs=0.05)


def test_seed_decides() -> None:
    """The same seed gives the same recording, another seed another."""
    first, again, other = (simulate_sensors(standing(), SuitNoise(), np.random.default_rng(seed)) for seed in (5, 5, 6))
    assert np.array_equal(first.accelerations, again.accelerations)
    assert np.array_equal(first.magnetic_fields, again.magnetic_fields)
    assert not np.allclose(first.accelerations, other.accelerations)


def test_white_noise_has_its_level() -> None:
    """With nothing else wrong the standard deviations are those asked for: 0.05 m/s^2, 0.005 rad/s, 0.005 of the field."""
    noise = SuitNoise(**{**vars(PERFECT), "accelerometer_noise": 0.05, "gyroscope_noise": 0.005, "magnetometer_noise": 0.005})
    recording = simulate_sensors(standing(600), noise, np.random.default_rng(4))
    rest = slice(CALIBRATION_SAMPLES.start, CALIBRATION_SAMPLES.stop)
    for signal, level in (
        (recording.accelerations, 0.05),
        (recording.angular_velocities, 0.005),
        (recording.magnetic_fields, 0.005),
    ):
        assert signal[rest].std(axis=0).mean() == pytest.approx(level, rel=0.05)


def test_magnetic_disturbance_is_worst_at_the_floor() -> None:
    """Dipoles in the floor change the field at the feet more than at the head, which is over a metre further away."""
    noise = SuitNoise(**{**vars(PERFECT), "magnetic_disturbance": 0.4})
    errors = []
    for seed in range(5):
        recording = simulate_sensors(standing(), noise, np.random.default_rng(seed))
        errors.append(np.linalg.norm(rotate(recording.orientations, recording.magnetic_fields) - EARTH_FIELD, axis=-1).mean(axis=0))
    foot, head = (SENSOR_BODIES.index(BODY_NAMES.index(name)) for name in ("foot_l", "head"))
    mean = np.mean(errors, axis=0)
    assert mean[foot] > 5.0 * mean[head] > 0.0


def test_lost_packets_hold_the_last_value() -> None:
    """A tenth of the samples is lost: of noisy signals about a tenth repeats the sample before, in all three signals at once."""
    noise = SuitNoise(**{**vars(SuitNoise()), "packet_loss": 0.1})
    recording = simulate_sensors(standing(600), noise, np.random.default_rng(8))
    held = np.all(np.diff(recording.accelerations, axis=0) == 0.0, axis=-1)
    assert 0.05 < held.mean() < 0.11  # bursts overlap, so a little less than 0.1
    assert np.array_equal(held, np.all(np.diff(recording.magnetic_fields, axis=0) == 0.0, axis=-1))


def test_signs_never_flip() -> None:
    """A rotation and its negative are the same: the second is turned to the side of the first."""
    q = np.array([[1.0, 0, 0, 0], [-1.0, 0, 0, 0], [-0.8, -0.6, 0, 0], [0.6, 0.8, 0, 0]])
    # Products with the one before: -1 flips, +0.8 keeps the flip, -0.96 flips back.
    assert align_quaternion_signs(q) == pytest.approx(np.array([[1, 0, 0, 0], [1, 0, 0, 0], [0.8, 0.6, 0, 0], [0.6, 0.8, 0, 0]]))


def test_resampled_clips_follow_a_spline() -> None:
    """A fall z = -4.9 t^2 at 30 fps lies on the parabola at 100 Hz too; straight lines would miss it by up to 0.7 mm."""
    old, new = np.arange(31) / 30.0, np.arange(101) / 100.0
    fall = resample(clip(np.outer(-4.9 * old**2, [0.0, 0.0, 1.0]), fps=30.0), 100.0)
    assert len(fall) == 101
    assert fall.root_position[:, 2] == pytest.approx(-4.9 * new**2, abs=1e-9)


def test_severity_scales_every_level() -> None:
    """Half the severity is half of every level."""
    assert SuitNoise().scaled(0.5).calibration_error == pytest.approx(0.5 * SuitNoise().calibration_error)
    assert set(vars(PERFECT).values()) == {0.0}
    assert SuitNoise().scaled(1.0) == SuitNoise()


def test_short_clips_are_recorded() -> None:
    """One frame, or a handful, is a clip too."""
    for frames in (1, 2, 5):
        assert np.isfinite(simulate_sensors(standing(frames), SuitNoise(), np.random.default_rng(9)).accelerations).all()
