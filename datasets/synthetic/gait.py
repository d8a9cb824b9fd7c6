"""Gait of synthetic motion: footsteps along the path of a body, with the rates and lengths of human steps."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from datasets.motion.curves import smooth_gaussian, smoother_step
from datasets.motion.humanoid import GRAVITY_M_S2
from datasets.synthetic.footsteps import MIDFOOT, Footstep, Plant
from datasets.synthetic.movement_style import MovementStyle

# Speeds [m/s] and, at these, steps per second or the share of a step in which both feet are on the ground, negative where none
# is. Walking is rounded after Grieve and Gear (1966) and Murray (1967), running after Nilsson and Thorstensson (1989); the
# slow ends, where people set off and stop, are chosen so that no step is longer than legs allow.
WALK_RATE = ((0.4, 0.7, 1.0, 1.4, 1.8), (1.55, 1.62, 1.80, 2.10, 2.30))
WALK_OVERLAP = ((0.0, 0.7, 1.3, 1.8), (0.36, 0.32, 0.24, 0.17))
RUN_RATE = ((0.3, 1.0, 1.6, 2.2, 3.0, 4.0), (1.80, 2.40, 2.65, 2.75, 2.85, 3.00))
RUN_OVERLAP = ((0.0, 0.6, 1.0, 1.6, 2.6, 3.5), (0.36, 0.15, -0.05, -0.20, -0.28, -0.35))


@dataclass(frozen=True)
class GaitPath:
    """Path of a body over T frames.

    Attributes:
        t: Times [s], shape (T,).
        position: Positions on the ground [m], shape (T, 2).
        heading: Headings [rad], shape (T,).
        speed: Speeds [m/s], shape (T,).
        begin: Time of departure [s].
        end: Time of arrival [s].
        run: Whether the body runs when it is fast enough.
    """

    t: np.ndarray
    position: np.ndarray
    heading: np.ndarray
    speed: np.ndarray
    begin: float
    end: float
    run: bool

    def running(self, times: np.ndarray) -> np.ndarray:
        """Return the share of running in the gait at ``times`` [s], 0 to 1."""
        return self.run * smoother_step((np.interp(times, self.t, self.speed) - 0.8) / 0.9)


def path_along(t: np.ndarray, speed: np.ndarray, turning: np.ndarray, begin: float, end: float, run: bool = False) -> GaitPath:
    """Return the path of a body from the origin along x at a speed [m/s] and a turning rate [rad/s], both (T,)."""
    step = np.diff(t, prepend=t[0])
    heading = np.cumsum(turning * step)
    velocity = speed[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    return GaitPath(t, np.cumsum(velocity * step[:, None], axis=0), heading, speed, begin, end, run)


def plan_steps(path: GaitPath, style: MovementStyle, first_side: int) -> tuple[tuple[Plant, Plant], list[Footstep]]:
    """Return the first plants of both feet and the steps that keep them under the body.

    A foot is planted where the body will be in the middle of its stance. Steps come as often as people's do at that
    speed, stretched a little so that the last one lands when the path ends; it closes the stance.

    Args:
        path: Path of the body.
        style: Movement style of the performer.
        first_side: Foot that lifts first, 0 left, 1 right.
    """
    landings = _landing_times(path, style)
    count = len(landings) - 1
    overlap = np.interp(_at(path, path.speed, landings[:-1]), *(RUN_OVERLAP if path.run else WALK_OVERLAP))
    lifts = np.append(landings[:-1] + overlap * np.diff(landings), [landings[-1]] * 2)  # times of lift-off of step 1, 2, ..
    middles = np.append(0.5 * (landings[1:-2] + lifts[2:count]), [path.end, path.end])  # middles of the stances after step 1, 2, ..
    turns = np.gradient(_at(path, path.heading, landings))[1:]
    widths = style.stance_width + (style.step_width - style.stance_width) * smoother_step(_at(path, path.speed, middles) / 0.8)
    widths[-2:] = style.stance_width
    start = (_plant(path, path.begin, 0, style.stance_width, style.toe_out), _plant(path, path.begin, 1, style.stance_width, style.toe_out))
    last, steps = list(start), []
    for k in range(count):
        side = (first_side + k) % 2
        plant = _plant(path, middles[k], side, widths[k], style.toe_out + 0.5 * abs(turns[k]))
        stride = float(np.hypot(plant.x - last[side].x, plant.y - last[side].y))
        steps.append(_step(side, lifts[k], landings[k + 1], plant, stride, float(path.running(lifts[k]))))
        last[side] = plant
    return start, steps


def _at(path: GaitPath, values: np.ndarray, times: np.ndarray) -> np.ndarray:
    return np.interp(times, path.t, values)


def _landing_times(path: GaitPath, style: MovementStyle) -> np.ndarray:
    """Return the times of departure and of the landings (steps + 1,) [s]."""
    moving = (path.t >= path.begin) & (path.t <= path.end)
    times = path.t[moving]
    rate = np.interp(path.speed[moving], *(RUN_RATE if path.run else WALK_RATE)) * style.cadence
    phase = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(times))])
    count = max(3, round(phase[-1]))
    return np.interp(np.arange(count + 1) * phase[-1] / count, phase, times)


def _plant(path: GaitPath, time: float, side: int, width: float, toe_out: float) -> Plant:
    """Return the plant beside the body's position at ``time`` [s], with the body's weight over the midfoot."""
    outward = 1.0 if side == 0 else -1.0
    heading = float(_at(path, path.heading, np.array(time)))
    c, s = np.cos(heading), np.sin(heading)
    x, y = (float(np.interp(time, path.t, path.position[:, axis])) for axis in (0, 1))
    aside = outward * 0.5 * width
    walking = smoother_step(_at(path, path.speed, np.array(time)) / 1.2)
    behind = MIDFOOT + 0.03 * float(walking + path.running(np.array(time)))  # of the mean centre of pressure
    return Plant(x - c * behind - s * aside, y - s * behind + c * aside, heading + outward * toe_out)


def _step(side: int, lift: float, land: float, plant: Plant, stride: float, run: float) -> Footstep:
    """Return a step with the roll and swing that people have at a stride [m], ``run`` being the share of running."""
    walk_off, walk_on = np.interp(stride, (0.0, 0.3, 1.4), (16.0, 26.0, 64.0)), np.interp(stride, (0.2, 0.5, 1.3), (0.0, -6.0, -22.0))
    return Footstep(
        side=side,
        lift=float(lift),
        land=float(land),
        plant=plant,
        roll_off=float(np.deg2rad(walk_off + run * (80.0 - walk_off))),
        roll_on=float(np.deg2rad(walk_on + run * (-5.0 - walk_on))),
        clearance=0.08 + 0.09 * run,
        kick=0.2 + 0.1 * run,
        rise=0.35 - 0.1 * run,
        fall=0.65 - 0.3 * run,
    )


def bounce(t: np.ndarray, steps: list[Footstep]) -> tuple[np.ndarray, np.ndarray]:
    """Return the height (T,) [m] of a running body relative to touchdown, and its weight (T,), 0 to 1.

    In flight the body falls freely; in stance a half-sine force carries it, with the impulse of the weight over the step.
    """
    height, counts = np.zeros_like(t), np.zeros_like(t)
    for now, following in pairwise(steps):
        off = min(_lift_after(steps, now), following.land)
        flight, contact = following.land - off, off - now.land
        weight = float(smoother_step(np.array(flight / 0.06)))
        here = (t >= now.land) & (t < following.land)
        u = t[here] - now.land
        air = u - contact
        force = GRAVITY_M_S2 * (following.land - now.land) * contact / (2.0 * np.pi)  # of the peak, times (contact / pi)^2
        stance = -force * np.sin(np.pi * u / contact) + 0.5 * GRAVITY_M_S2 * u * (contact - u)
        height[here] = weight * np.where(u < contact, stance, 0.5 * GRAVITY_M_S2 * air * (flight - air))
        counts[here] = weight
    return smooth_gaussian(height, 1.5), smooth_gaussian(counts, 6.0)


def _lift_after(steps: list[Footstep], landed: Footstep) -> float:
    """Return the time [s] at which the foot that landed in ``landed`` lifts again, infinite for the last step."""
    return next((s.lift for s in steps if s.side == landed.side and s.lift > landed.land), np.inf)
