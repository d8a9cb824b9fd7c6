"""Footsteps of synthetic motion: plants of the feet, and rolling, swing and load between them."""

from dataclasses import dataclass

import numpy as np

from datasets.motion.curves import interpolate_keyframes, reach_profile, smoother_step
from datasets.motion.humanoid import ANKLE_HEIGHT, BODIES, BODY_NAMES, HEEL_OFFSET

HEEL = HEEL_OFFSET[0]  # m, of the sole's rear edge before the ankle (negative)
TOE_JOINT = BODIES[BODY_NAMES.index("toe_l")].offset  # m, from the ankle
MIDFOOT = 0.045  # m, before the ankle, place of the centre of pressure in quiet standing
WEIGHT_SHIFT_S = 0.5  # s, of shifting the weight from both feet to one, and back


@dataclass(frozen=True)
class Plant:
    """Plant of a foot flat on the ground: the ground point under its ankle.

    Attributes:
        x: First horizontal coordinate [m].
        y: Second horizontal coordinate [m].
        yaw: Yaw of the foot [rad].
        z: Height of the ground there [m].
    """

    x: float
    y: float
    yaw: float
    z: float = 0.0


@dataclass(frozen=True)
class Footstep:
    """Step of one foot from its lift-off to its landing.

    Attributes:
        side: 0 left, 1 right.
        lift: Time of lift-off [s].
        land: Time of landing [s].
        plant: Plant after landing.
        roll_off: Largest pitch of the sole after lift-off, heel up [rad].
        roll_on: Pitch of the sole at landing [rad]: negative lands on the heel, positive on the ball.
        clearance: Height of the foot above the straight way [m].
        kick: Share of the swing at which the sole is steepest.
        rise: Share of the swing in which the foot goes up.
        fall: Share of the swing in which it comes down.
    """

    side: int
    lift: float
    land: float
    plant: Plant
    roll_off: float
    roll_on: float
    clearance: float
    kick: float = 0.2
    rise: float = 0.35
    fall: float = 0.65


@dataclass(frozen=True)
class FeetTrack:
    """Motion of both feet; index 0 left, 1 right.

    Attributes:
        ankle: Positions of the ankles [m], shape (T, 2, 3).
        yaw: Yaw of the soles [rad], shape (T, 2).
        pitch: Pitch of the soles, positive heel up [rad], shape (T, 2).
        toe_bend: Pitch of the toes relative to the sole [rad], shape (T, 2).
        planted: Whether the foot is on the ground, shape (T, 2).
        pressure: Centre of pressure on the ground [m], shape (T, 3).
    """

    ankle: np.ndarray
    yaw: np.ndarray
    pitch: np.ndarray
    toe_bend: np.ndarray
    planted: np.ndarray
    pressure: np.ndarray


def _over_toe(pitch: np.ndarray) -> np.ndarray:
    """Return the ankle relative to its ground point [m], shape (T, 3), with the sole turned by ``pitch`` [rad] about the toe joint."""
    back, up = -TOE_JOINT[0], -TOE_JOINT[2]
    x = TOE_JOINT[0] + back * np.cos(pitch) + up * np.sin(pitch)
    return np.stack([x, 0.0 * x, ANKLE_HEIGHT - up - back * np.sin(pitch) + up * np.cos(pitch)], axis=-1)


def _over_heel(pitch: np.ndarray) -> np.ndarray:
    """Return the ankle relative to its ground point [m], shape (T, 3), with the sole turned by ``pitch`` [rad] about the rear edge."""
    x = HEEL - HEEL * np.cos(pitch) + ANKLE_HEIGHT * np.sin(pitch)
    return np.stack([x, 0.0 * x, HEEL * np.sin(pitch) + ANKLE_HEIGHT * np.cos(pitch)], axis=-1)


def _placed(plant: Plant, yaw: np.ndarray | float, offset: np.ndarray) -> np.ndarray:
    """Return the points (T, 3) [m] in the world of ``offset`` (T, 3) [m] in the frame of a plant turned to ``yaw`` [rad]."""
    c, s = np.cos(yaw), np.sin(yaw)
    x, y, z = offset[..., 0], offset[..., 1], offset[..., 2]
    return np.stack([plant.x + c * x - s * y, plant.y + s * x + c * y, plant.z + z], axis=-1)


def _pitch(t: np.ndarray, steps: list[Footstep]) -> np.ndarray:
    """Return the sole's pitch (T,) [rad]: that of landing, flat, heel up, steepest, that of the next landing."""
    times, values, landed = [min(0.0, steps[0].lift) - 10.0], [0.0], -np.inf
    for step in steps:
        stance = step.lift - landed
        times += [step.lift - min(0.5 * stance, 0.35), step.lift + step.kick * (step.land - step.lift), step.land]
        values += [0.0, step.roll_off, step.roll_on]
        after = next((s.lift - step.land for s in steps if s.lift > step.land), np.inf)
        times.append(step.land + min(0.2 * after, 0.14))
        values.append(0.0)
        landed = step.land
    return interpolate_keyframes(t, np.array(times), np.array(values))


def _swing(t: np.ndarray, step: Footstep, start: Plant, pitch: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return ankle (T, 3) [m], yaw (T,) and toe bend (T,) [rad] of one swing, leaving and meeting the ground at rest."""
    s = (t - step.lift) / (step.land - step.lift)
    over = reach_profile((s - 0.02) / 0.98, 0.4, 0.3)
    yaw = start.yaw + over * (step.plant.yaw - start.yaw)
    on_toe, on_heel = _over_toe(pitch), _over_heel(pitch) if step.roll_on <= 0 else _over_toe(pitch)
    leave = _placed(start, start.yaw, on_toe)
    ankle = leave + over[:, None] * (_placed(step.plant, step.plant.yaw, on_heel) - leave)
    ankle[:, 2] += (smoother_step((s - step.kick - 0.25) / 0.45) - over) * (on_heel - on_toe)[:, 2]  # changes over while the sole is level
    ankle += _bend_of_way(over, start, step.plant)
    climb = step.plant.z - start.z
    climbed = smoother_step(s / 0.6) if climb > 0 else smoother_step((s - 0.4) / 0.6) if climb < 0 else over
    ankle[:, 2] += (climbed - over) * climb
    ankle[:, 2] += step.clearance * smoother_step(s / step.rise) * smoother_step((1.0 - s) / step.fall)
    flat = 1.0 - smoother_step((s - 0.05) / 0.5) + (step.roll_on > 0) * smoother_step((s - 0.6) / 0.4)
    return ankle, yaw, -flat * np.maximum(pitch, 0.0)


def _bend_of_way(over: np.ndarray, start: Plant, end: Plant) -> np.ndarray:
    """Return the displacement (T, 3) [m] of the arc from one plant to the next from its chord, so that feet pass each other."""
    way, turn = np.array([end.x - start.x, end.y - start.y, 0.0]), end.yaw - start.yaw
    return (0.5 * turn * over * (1.0 - over))[:, None] * np.array([way[1], -way[0], 0.0])


def _one_foot(t: np.ndarray, start: Plant, steps: list[Footstep]) -> tuple[np.ndarray, ...]:
    """Return ankle (T, 3), yaw, pitch, toe bend and planted (T,), and centre of pressure (T, 3) of one foot."""
    pitch = _pitch(t, steps) if steps else np.zeros_like(t)
    ankle, yaw, bend = np.empty((len(t), 3)), np.empty_like(t), np.empty_like(t)
    planted, pressure = np.zeros(len(t), dtype=bool), np.empty((len(t), 3))
    plants = [start, *(step.plant for step in steps)]
    landings = [-np.inf, *(step.land for step in steps)]
    lifts = [*(step.lift for step in steps), np.inf]
    for plant, landed, lifted in zip(plants, landings, lifts, strict=True):
        here = (t >= landed) & (t <= lifted)
        roll = pitch[here]
        ankle[here] = _placed(plant, plant.yaw, np.where(roll[:, None] > 0, _over_toe(roll), _over_heel(roll)))
        yaw[here], bend[here], planted[here] = plant.yaw, -np.maximum(roll, 0.0), True
        until_next = (t >= landed) & (t < (landings[landings.index(landed) + 1] if lifted < np.inf else np.inf))
        pressure[until_next] = _placed(plant, plant.yaw, _rolling_pressure(t[until_next], landed, lifted, steps))
    for step, plant in zip(steps, plants, strict=False):
        here = (t > step.lift) & (t < step.land)
        ankle[here], yaw[here], bend[here] = _swing(t[here], step, plant, pitch[here])
    return ankle, yaw, pitch, bend, planted, pressure


def _rolling_pressure(t: np.ndarray, landed: float, lifted: float, steps: list[Footstep]) -> np.ndarray:
    """Return the centre of pressure (T, 3) [m] in the frame of a plant, from heel to ball while the foot rolls."""
    on = next((step.roll_on for step in steps if step.land == landed), 0.0)
    off = next((step.roll_off for step in steps if step.lift == lifted), 0.0)
    start, stop = max(landed, t[0]), min(lifted, t[-1])
    begin, end = MIDFOOT + 0.2 * on, MIDFOOT + min(0.13 * off, 0.14)
    x = np.interp(t, [start, max(stop - 1.5, 0.5 * (start + stop)), stop], [begin, 0.5 * (begin + end), end])
    return np.stack([x, 0.0 * x, 0.0 * x], axis=-1)


def _load_of_left(t: np.ndarray, steps: list[Footstep], sway: np.ndarray) -> np.ndarray:
    """Return the share of the weight on the left foot (T,): changing with the steps, ``sway`` (T,) around half when standing."""
    if not steps:
        return 0.5 + sway
    first, last = steps[0], steps[-1]
    times, values = [first.lift - WEIGHT_SHIFT_S, first.lift], [0.5, float(first.side)]
    for now, following in zip(steps, [*steps[1:], None], strict=True):
        done = following.lift if following else now.land + WEIGHT_SHIFT_S
        bearing = float(following.side) if following else 0.5
        times += [min(now.land, done), max(now.land, done)]
        values += [float(now.side), bearing]
    quiet = smoother_step((first.lift - WEIGHT_SHIFT_S - t) / 0.5) + smoother_step((t - last.land - WEIGHT_SHIFT_S) / 0.5)
    return interpolate_keyframes(t, np.array(times), np.array(values)) + quiet * sway


def feet_track(t: np.ndarray, starts: tuple[Plant, Plant], steps: list[Footstep], sway: np.ndarray) -> FeetTrack:
    """Return the motion of both feet and of the centre of pressure.

    Args:
        t: Times of the frames [s], shape (T,).
        starts: First plants of the left and the right foot.
        steps: Steps in order of landing.
        sway: Share of the weight on the left foot above one half while standing, shape (T,).

    Returns:
        Feet that never slip: rolling over heel and toe joint while planted, with continuous velocity in between.
    """
    feet = [_one_foot(t, starts[side], [step for step in steps if step.side == side]) for side in (0, 1)]
    ankle, yaw, pitch, bend, planted, pressure = (np.stack(pair, axis=1) for pair in zip(*feet, strict=True))
    left = _load_of_left(t, steps, sway)[:, None]
    return FeetTrack(ankle, yaw, pitch, bend, planted, left * pressure[:, 0] + (1.0 - left) * pressure[:, 1])
