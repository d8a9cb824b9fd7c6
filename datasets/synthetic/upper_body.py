"""Trunk, arms and head of synthetic motion: postures of walking, standing with gestures, and bending the knees."""

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.motion.curves import interpolate_keyframes, smooth_gaussian, smooth_noise, smoother_step
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES, GRAVITY_M_S2, LEG_LENGTH
from datasets.synthetic.footsteps import FeetTrack
from datasets.synthetic.gait import GaitPath
from datasets.synthetic.movement_style import MovementStyle
from datasets.synthetic.whole_body import PostureTrack

STRIDE = 0.7  # m, between the ankles at a stride of 1.4 m, for which a style's amplitudes are given

# Poses of an arm [rad]: elevation from hanging to the side, swing forward, inward turn about the arm's own axis, flexion of the elbow.
GESTURES = {
    name: np.deg2rad(angles)
    for name, angles in {
        "wave": (80.0, 20.0, -85.0, 95.0),
        "point": (70.0, 50.0, -20.0, 12.0),
        "reach up": (135.0, 35.0, -60.0, 25.0),
        "explain": (22.0, 25.0, -15.0, 85.0),
        "raise hand": (35.0, 35.0, -45.0, 115.0),
        "spread": (65.0, 10.0, -50.0, 25.0),
    }.items()
}
BOTH_ARMS = ("explain", "spread")
BEAT = {"wave": np.deg2rad((0.0, 0.0, 22.0, 14.0)), "explain": np.deg2rad((0.0, 5.0, 10.0, 15.0))}  # rad, amplitudes on top, at BEAT_RATE
BEAT_RATE = 1.6  # Hz


def walking_posture(path: GaitPath, feet: FeetTrack, style: MovementStyle, rng: np.random.Generator) -> PostureTrack:
    """Return the posture of walking and running, driven by how far each foot is ahead of the other.

    The pelvis turns with the leading leg and drops on the swinging side, the chest turns against it, arms swing against the legs,
    and the head faces along the path.
    """
    t, noise = path.t, smooth_noise(path.t, rng, 6, 1.5)
    forward = np.stack([np.cos(path.heading), np.sin(path.heading)], axis=1)
    ahead = smooth_gaussian(np.einsum("ta,ta->t", feet.ankle[:, 0, :2] - feet.ankle[:, 1, :2], forward), 3.0) / STRIDE
    run = smooth_gaussian(path.running(t), 10.0)
    moving = smooth_gaussian(np.minimum(path.speed / 1.3, 1.0), 10.0)
    load = smooth_gaussian(feet.planted[:, 0] * 1.0 - feet.planted[:, 1], 4.5)  # +1 on the left foot alone
    yaw = style.twist * (1.0 - 0.3 * run) * ahead
    roll = np.deg2rad(3.0) * moving * load
    pitch = np.deg2rad(3.0) * moving + np.deg2rad(4.0) * run
    push = smooth_gaussian(np.gradient(path.speed, t), 10.0) / GRAVITY_M_S2  # people lean into the push of the ground
    lean = style.lean + np.deg2rad(5.0) * run + np.deg2rad(1.0) * noise[:, 0] + push
    coming = np.interp(t + 0.35, t, path.heading)
    head = np.stack([coming + 0.06 * noise[:, 4], np.deg2rad(4.0) + 0.03 * noise[:, 5], 0.0 * t], axis=1)
    upper = _upper(_swinging(t, ahead, run, noise, style), np.stack([2.0 * yaw, lean - pitch, -0.9 * roll], axis=1), style.slump)
    return _posture(style, np.stack([path.heading - yaw, pitch, roll], axis=1), upper, head)


def _swinging(t: np.ndarray, ahead: np.ndarray, run: np.ndarray, noise: np.ndarray, style: MovementStyle) -> np.ndarray:
    """Return the poses of both arms (2, T, 4) [rad]: they swing a little after ``ahead`` (T,); elbows bend with ``run`` (T,)."""
    late = smooth_gaussian(np.interp(t - 0.04, t, ahead), 3.0)
    arms = np.empty((2, len(t), 4))
    for side, sign in ((0, 1.0), (1, -1.0)):
        swing = -sign * late * style.arm_swing * (1.0 - 0.2 * run)
        bend = run * (np.deg2rad(85.0) - style.elbow) + 0.5 * swing
        away = 0.25 * run + 0.02 * noise[:, 1]
        arms[side] = _hanging(style) + np.stack([away, swing + 0.03 * noise[:, 2 + side], 0.25 * run, bend], axis=1)
    return arms


def standing_posture(t: np.ndarray, sway: np.ndarray, style: MovementStyle, rng: np.random.Generator) -> PostureTrack:
    """Return the posture of standing, shifting the weight by ``sway`` (T,), looking around and gesturing."""
    noise, arms = smooth_noise(t, rng, 6, 3.0), _gesturing(t, style, rng)
    busy = arms[1, :, 0] - arms[0, :, 0]  # the trunk turns and leans away from a raised arm
    roll, yaw = 0.1 * sway, np.deg2rad(3.0) * noise[:, 0]
    trunk = np.stack([0.6 * yaw + 0.08 * busy, style.lean + 0.02 * noise[:, 1], 0.05 * busy - 0.9 * roll], axis=1)
    head = np.stack([yaw + 0.25 * noise[:, 4] - 0.15 * busy, 0.05 + 0.06 * noise[:, 5], 0.0 * t], axis=1)
    upper = _upper(arms + 0.03 * noise[:, 2:4].T[..., None], trunk, style.slump)
    return _posture(style, np.stack([yaw, 0.0 * t, roll], axis=1), upper, smooth_gaussian(head, 6.0))


def _gesturing(t: np.ndarray, style: MovementStyle, rng: np.random.Generator) -> np.ndarray:
    """Return the poses of both arms (2, T, 4) [rad]: gestures in random order, some with both arms, some with beats on top."""
    rest = np.array([_hanging(style)] * 2)
    times, keys, beat = [0.0, 0.4], [rest, rest], np.zeros((2, len(t), 4))
    for name in rng.permutation(list(GESTURES)):
        begin, reach, hold, back = times[-1], rng.uniform(0.8, 1.1), rng.uniform(0.5, 1.4), rng.uniform(0.8, 1.1)
        if begin + reach + hold + back + 0.4 > t[-1]:
            break
        sides = [0, 1] if name in BOTH_ARMS else [int(style.left_handed == (rng.uniform() < 0.25))]
        pose = rest.copy()
        pose[sides] = GESTURES[str(name)]
        times += [begin + reach, begin + reach + hold, begin + reach + hold + back, begin + reach + hold + back + 0.2]
        keys += [pose, pose, rest, rest]
        fade = smoother_step((t - begin - 0.6 * reach) / 0.4) * smoother_step((begin + reach + hold + 0.2 - t) / 0.4)
        beat[sides] += (fade * np.sin(2.0 * np.pi * BEAT_RATE * (t - begin)))[:, None] * BEAT.get(str(name), np.zeros(4))
    return np.moveaxis(interpolate_keyframes(t, np.array(times), np.array(keys)), 1, 0) + beat


def bending_posture(
    t: np.ndarray, depth: np.ndarray, lean: float, arms: float, style: MovementStyle, rng: np.random.Generator
) -> PostureTrack:
    """Return the posture of bending the knees.

    Args:
        t: Times [s], shape (T,).
        depth: Depth of the bend, 0 standing, 1 deepest, shape (T,).
        lean: Forward lean of the chest at depth 1 [rad].
        arms: Forward swing of the arms for balance at depth 1 [rad].
        style: Movement style of the performer.
        rng: Random generator of the small movements.
    """
    noise = smooth_noise(t, rng, 4, 3.0)
    ahead = np.stack([0.0 * t, arms * depth, -0.3 * depth, 0.2 * depth], axis=1)
    both = _hanging(style) + ahead + 0.02 * noise[:, 1:3].T[..., None]
    trunk = np.stack([0.03 * noise[:, 0], style.lean + 0.45 * lean * depth, 0.0 * t], axis=1)
    head = np.stack([0.1 * noise[:, 3], 0.05 + 0.25 * lean * depth, 0.0 * t], axis=1)
    return _posture(style, np.stack([0.0 * t, 0.55 * lean * depth, 0.0 * t], axis=1), _upper(both, trunk, style.slump), head)


def _posture(style: MovementStyle, pelvis: np.ndarray, upper: np.ndarray, head: np.ndarray) -> PostureTrack:
    none = np.zeros(len(pelvis))
    return PostureTrack(pelvis, upper, head, none + np.inf, LEG_LENGTH * (1.0 - style.crouch), none, none)


def _hanging(style: MovementStyle) -> np.ndarray:
    return np.array([style.abduction, np.deg2rad(4.0), np.deg2rad(15.0), style.elbow])


def _upper(arms: np.ndarray, trunk: np.ndarray, slump: float) -> np.ndarray:
    """Return the local rotations of the 20 bodies, wxyz (T, 20, 4), those of trunk and arms set.

    Args:
        arms: Elevation, swing, turn and elbow of the left and the right arm [rad], shape (2, T, 4).
        trunk: Yaw, pitch and roll of the chest over the pelvis [rad], shared by spine and chest, shape (T, 3).
        slump: Forward bend of the chest, while the spine leans back [rad].
    """
    local = np.zeros((len(trunk), BODY_COUNT, 4))
    local[..., 0] = 1.0
    for name, rounded in (("spine", -0.5 * slump), ("chest", slump)):
        local[:, BODY_NAMES.index(name)] = _rotations("ZYX", 0.5 * trunk + np.array([0.0, rounded, 0.0]))
    for name, sign, arm in (("l", 1.0, arms[0]), ("r", -1.0, arms[1])):
        elevation, swing, turn, elbow = arm.T
        shrug = np.deg2rad(20.0) * smoother_step((elevation - np.deg2rad(60.0)) / np.deg2rad(90.0))  # the collar follows a high arm
        shoulder = np.stack([sign * (elevation - shrug - 0.5 * np.pi), -sign * swing, turn], axis=1)
        local[:, BODY_NAMES.index(f"collar_{name}")] = _rotations("X", sign * shrug[:, None])
        local[:, BODY_NAMES.index(f"upper_arm_{name}")] = _rotations("XZY", shoulder)
        local[:, BODY_NAMES.index(f"forearm_{name}")] = _rotations("Z", -sign * elbow[:, None])
    return local


def _rotations(axes: str, angles: np.ndarray) -> np.ndarray:
    """Return rotations wxyz (T, 4) by ``angles`` (T, axes) [rad] about the axes of the body, one after the other."""
    return Rotation.from_euler(axes, angles).as_quat(scalar_first=True)
