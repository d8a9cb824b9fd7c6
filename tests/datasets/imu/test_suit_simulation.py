"""Simulated suits: right with perfect sensors, wrong in the known ways with real ones."""

import time
from dataclasses import replace

import numpy as np
import pytest

from datasets.imu.sensor_model import CALIBRATION_SAMPLES, CLIP_START_SAMPLE, SENSOR_BODIES, SuitNoise, simulate_sensors
from datasets.imu.suit_simulation import body_orientations, fit_skeleton, sensor_orientations, simulate_suit, track_root
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES, hinge_angles, rotations_from_hinges
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import conjugate, from_axis_angle, multiply, rotation_angle

STANDING = 0.94  # m, of the pelvis
X, Y, Z = np.eye(3)


def squats(seconds: float = 6.0, fps: float = 60.0) -> BodyMotion:
    """Return squats with planted feet and swinging arms: thigh and shin are 0.42 and 0.41 m, so the ankle stays nearly below."""
    time_ = np.arange(int(seconds * fps)) / fps
    bend = 0.5 * (1 - np.cos(2 * np.pi * 0.5 * time_))  # rad, 0 to 1
    local = np.tile([1.0, 0.0, 0.0, 0.0], (len(time_), BODY_COUNT, 1))
    for side, s in (("l", 1.0), ("r", -1.0)):
        local[:, BODY_NAMES.index(f"thigh_{side}")] = from_axis_angle(Y, -bend)
        local[:, BODY_NAMES.index(f"shin_{side}")] = from_axis_angle(Y, 2 * bend)
        local[:, BODY_NAMES.index(f"foot_{side}")] = from_axis_angle(Y, -bend)
        local[:, BODY_NAMES.index(f"upper_arm_{side}")] = from_axis_angle(X, -s * (1.2 - bend))
        local[:, BODY_NAMES.index(f"forearm_{side}")] = from_axis_angle(Z, -s * bend)
    root = np.zeros((len(time_), 3))
    root[:, 0] = -0.01 * np.sin(bend) + 0.01  # (0.41 - 0.42) sin: keeps the ankles where they are
    root[:, 2] = 0.03 + 0.83 * np.cos(bend) + 0.08
    return BodyMotion(root, local, fps, "squats", "somebody", "synthetic", "squat")


def error_degrees(clip: BodyMotion, truth: BodyMotion) -> np.ndarray:
    """Return the mean angle [deg] between the bodies of two clips, shape (20,)."""
    return np.degrees(rotation_angle(multiply(conjugate(body_poses(truth)[1]), body_poses(clip)[1]))).mean(axis=0)


def test_clean_squats_are_what_they_claim() -> None:
    """The fixture's feet do not move, else the tests below would test nothing."""
    feet = body_poses(squats())[0][:, [BODY_NAMES.index("foot_l"), BODY_NAMES.index("foot_r")]]
    assert feet == pytest.approx(np.broadcast_to(feet[:1], feet.shape), abs=1e-9)
    assert feet[..., 2] == pytest.approx(0.08)


def test_perfect_suit_returns_the_clip() -> None:
    """With severity 0 only filter and root tracker err: within 1.5 degrees and 3 cm."""
    clean = squats()
    clip = simulate_suit(clean, seed=1, severity=0.0)
    assert error_degrees(clip.faulty, clean).max() < 1.5
    assert np.linalg.norm(clip.faulty.root_position - clean.root_position, axis=1).max() < 0.03


def test_faulty_clip_is_a_pair_of_the_clean_one() -> None:
    """Same frames, rate, performer and kind; its own name and system; accelerations at 100 Hz."""
    clean = squats(3.0)  # 180 frames: 179/60 s, so samples 0 .. 298
    clip = simulate_suit(clean, seed=2)
    assert clip.clean is clean
    assert (len(clip.faulty), clip.faulty.fps) == (180, 60.0)
    assert (clip.faulty.name, clip.faulty.system) == ("squats_suit", "imu_suit")
    assert (clip.faulty.performer, clip.faulty.kind) == ("somebody", "squat")
    assert clip.accelerations.shape == (299, 19, 3)
    assert clip.faulty.root_position[0, :2] == pytest.approx(clean.root_position[0, :2])


def test_faulty_pose_is_one_that_the_hinges_can_take() -> None:
    """The hinge angles reproduce every rotation, knees and hands included."""
    faulty = simulate_suit(squats(2.0), seed=3).faulty
    again = rotations_from_hinges(faulty.local_rotations[:, 0], hinge_angles(faulty.local_rotations))
    assert rotation_angle(multiply(conjugate(again), faulty.local_rotations)).max() < 1e-6


def test_seed_decides() -> None:
    """Same seed, same clip; another seed, another session."""
    first, again, other = (simulate_suit(squats(2.0), seed) for seed in (4, 4, 5))
    assert np.array_equal(first.faulty.local_rotations, again.faulty.local_rotations)
    assert np.array_equal(first.accelerations, again.accelerations)
    assert not np.allclose(first.faulty.local_rotations, other.faulty.local_rotations)


def test_errors_grow_with_severity() -> None:
    """Averaged over sessions, a worse suit gives a worse pose."""
    clean = squats(2.0)

    def error(severity: float) -> float:
        return float(np.mean([error_degrees(simulate_suit(clean, seed, severity).faulty, clean) for seed in range(3)]))

    mean = [error(0.0), error(0.5), error(1.0)]
    assert mean[0] < mean[1] < mean[2]
    assert 2.0 < mean[2] < 20.0


def test_vqf_finds_the_sensors() -> None:
    """At rest, with perfect sensors, the filter finds every orientation within half a degree, heading included."""
    still = squats().cut(0, 2)
    recording = simulate_sensors(still, SuitNoise().scaled(0.0), np.random.default_rng(6))
    found = sensor_orientations(recording)[CALIBRATION_SAMPLES]
    assert np.degrees(rotation_angle(multiply(conjugate(recording.orientations[CALIBRATION_SAMPLES]), found))).max() < 0.5


def test_calibration_removes_mounting_and_heading() -> None:
    """Sensors mounted at random that stand still show the T-pose with the wearer's heading, and a later turn as a turn."""
    rng = np.random.default_rng(7)
    mounting = rng.standard_normal((19, 4))
    mounting /= np.linalg.norm(mounting, axis=1, keepdims=True)
    heading, turned = from_axis_angle(Z, np.array(0.7)), from_axis_angle(Z, np.array(1.2))
    sensors = np.tile(multiply(heading, mounting), (CLIP_START_SAMPLE + 1, 1, 1))
    sensors[-1] = multiply(turned, mounting)
    bodies = body_orientations(sensors, 0.7)
    assert rotation_angle(multiply(conjugate(heading), bodies[0])) == pytest.approx(0.0, abs=1e-7)
    assert rotation_angle(multiply(conjugate(turned), bodies[-1])) == pytest.approx(0.0, abs=1e-7)


def test_spine_lies_halfway() -> None:
    """A chest that is bent forward by 0.6 rad bends spine and chest by 0.3 each."""
    bodies = np.tile([1.0, 0.0, 0.0, 0.0], (1, 19, 1))
    upper = [i for i, b in enumerate(SENSOR_BODIES) if not BODY_NAMES[b].startswith(("pelvis", "thigh", "shin", "foot", "toe"))]
    bodies[:, upper] = from_axis_angle(Y, np.array(0.6))
    local = fit_skeleton(bodies)
    for name in ("spine", "chest"):
        assert local[0, BODY_NAMES.index(name)] == pytest.approx(from_axis_angle(Y, np.array(0.3)))


def test_knee_keeps_only_its_hinge() -> None:
    """A shin measured as bent by 0.8 rad and twisted by 0.3 bends by 0.8 and twists not at all; the foot stays as measured."""
    bodies = np.tile([1.0, 0.0, 0.0, 0.0], (1, 19, 1))
    bodies[0, SENSOR_BODIES.index(BODY_NAMES.index("shin_l"))] = multiply(
        from_axis_angle(Y, np.array(0.8)), from_axis_angle(Z, np.array(0.3))
    )
    local = fit_skeleton(bodies)[0]
    # The twist part of (cos .4, 0, sin .4, 0)(cos .15, 0, 0, sin .15) about y is (cos .4 cos .15, sin .4 cos .15): 0.8 rad.
    assert local[BODY_NAMES.index("shin_l")] == pytest.approx(from_axis_angle(Y, np.array(0.8)))
    assert local[BODY_NAMES.index("foot_l")] == pytest.approx(from_axis_angle(Y, np.array(-0.8)))


def jump() -> BodyMotion:
    """Return a crouch, a push-off at 8 m/s^2 over 0.36 m, a flight with straight legs, and the same backwards."""
    take_off = np.sqrt(2 * 8.0 * 0.36)  # 2.4 m/s
    push, flight = take_off / 8.0, 2 * take_off / 9.81
    leg, hip = [], []
    for t in np.arange(180) / 60.0 - 1.0:
        pushing = np.clip(min(t, 2 * push + flight - t), 0.0, push)
        flying = np.clip(t - push, 0.0, flight)
        leg.append(0.45 + 4.0 * pushing**2)
        hip.append(leg[-1] + take_off * flying - 0.5 * 9.81 * flying**2)
    bend = np.arccos(np.array(leg) / 0.83)
    local = np.tile([1.0, 0.0, 0.0, 0.0], (180, BODY_COUNT, 1))
    for side in "lr":
        local[:, BODY_NAMES.index(f"thigh_{side}")] = local[:, BODY_NAMES.index(f"foot_{side}")] = from_axis_angle(Y, -bend)
        local[:, BODY_NAMES.index(f"shin_{side}")] = from_axis_angle(Y, 2 * bend)
    return BodyMotion(np.column_stack([np.zeros(180), np.zeros(180), 0.11 + np.array(hip)]), local, 60.0, "jump")


def test_jumps_stay_jumps() -> None:
    """A take-off at 2.4 m/s flies v^2 / 2g = 0.294 m high: the pelvis rises from the crouch by 0.36 + 0.294 = 0.654 m."""
    clean = jump()
    assert np.ptp(clean.root_position[:, 2]) == pytest.approx(0.654, abs=0.002)
    assert np.ptp(simulate_suit(clean, 1, severity=0.0).faulty.root_position[:, 2]) == pytest.approx(0.654, rel=0.15)


def test_standing_foot_stays_and_stands_on_the_ground() -> None:
    """A pelvis that sways above rigid planted legs moves as they say, at the height of the straight leg.

    Legs tilted by 0.1 sin about the ankle move the pelvis by 0.86 sin of that: the tracked path follows within 1 cm.
    """
    tilt = 0.1 * np.sin(2 * np.pi * 0.5 * np.arange(300) / 100.0)
    local = np.tile([1.0, 0.0, 0.0, 0.0], (300, BODY_COUNT, 1))
    for side in "lr":  # thighs swing back by -tilt while the pelvis stays upright: the hips move forward over the feet
        local[:, BODY_NAMES.index(f"thigh_{side}")] = from_axis_angle(Y, tilt)
        local[:, BODY_NAMES.index(f"foot_{side}")] = from_axis_angle(Y, -tilt)
    x = 0.83 * np.sin(tilt)
    acceleration = np.zeros((300, 3))
    acceleration[:, 0] = np.gradient(np.gradient(x, 0.01), 0.01)
    root = track_root(local, acceleration, 1.0)
    assert root[:, 0] - root[0, 0] == pytest.approx(x - x[0], abs=0.01)
    assert root[:, 2] == pytest.approx(0.83 * np.cos(tilt) + 0.11, abs=0.005)


def test_twenty_times_faster_than_life() -> None:
    """Six seconds of motion take less than 0.3 s of processor time (measured about 0.1)."""
    clean = squats(6.0)
    simulate_suit(clean, 1)
    began = time.process_time()
    simulate_suit(clean, 2)
    assert time.process_time() - began < 0.3 * 2  # twice the demand: tests share their processor with others


@pytest.mark.parametrize("frames", [1, 2, 5])
def test_short_clips(frames: int) -> None:
    """A clip of one or a few frames comes back with as many."""
    assert len(simulate_suit(squats().cut(0, frames), 1).faulty) == frames


@pytest.mark.parametrize("fps", [30.0, 100.0, 120.0, 125.0])
def test_every_frame_rate_is_kept(fps: float) -> None:
    """The faulty clip has the clean one's frames whatever their rate."""
    clean = squats(2.0, fps)
    assert len(simulate_suit(clean, 1).faulty) == len(clean)


def test_a_suit_is_worn_on_the_performers_own_feet() -> None:
    toes = np.array([[0.10, 0.0, -0.07], [0.11, 0.0, -0.08]])
    suit = simulate_suit(replace(squats(2.0), toe_offsets=toes), 0)
    assert suit.faulty.toe_offsets is not None
    assert suit.faulty.toe_offsets.tolist() == toes.tolist()
