"""Procedural human motion with exact ground truth: the embedded default motion source and a fixture for tests."""

from dataclasses import replace

import numpy as np

from datasets.motion.clip import FPS, BodyMotion
from datasets.motion.curves import interpolate_keyframes, reach_profile, smooth_noise, smoother_step
from datasets.synthetic.footsteps import MIDFOOT, FeetTrack, Footstep, Plant, feet_track
from datasets.synthetic.gait import GaitPath, bounce, path_along, plan_steps
from datasets.synthetic.movement_style import MovementStyle, draw_movement_style
from datasets.synthetic.upper_body import bending_posture, standing_posture, walking_posture
from datasets.synthetic.whole_body import PostureTrack, solve_whole_body

MIN_CLIP_S = 6.0  # s; less is too short to break into a run and stop again
QUIET_END_S = 1.0  # s, of standing at either end of a clip
STANDING_PELVIS_HEIGHT_M = 0.93  # m
SEATED_PELVIS_HEIGHT_M = 0.52  # m, on a chair of 0.45 m
STAIR_RISE_M, STAIR_TREAD_M = 0.17, 0.29  # m


def synthetic_clips(seed: int, performer_count: int = 4, seconds: float = 8.0) -> list[BodyMotion]:
    """Return clips of synthetic performers who stand, walk, turn, run, sit down, squat and take stairs, each from standing to standing.

    There is no chair: a seated performer keeps the weight over the heels. Stairs change the height of the ground; all other clips
    stay on the ground at zero.

    Args:
        seed: Seed of performers and movements: the same seed makes the same clips.
        performer_count: Number of performers.
        seconds: Duration of each clip [s], at least ``MIN_CLIP_S``.

    Returns:
        Eleven clips a performer at 60 fps, named "synthetic_<seed>_<performer>_<movement>", of system "synthetic".

    Raises:
        ValueError: If there is no performer, or too little time.
    """
    if performer_count < 1 or not seconds >= MIN_CLIP_S:
        raise ValueError(f"performer_count is {performer_count}, seconds {seconds}; should be at least 1 and at least {MIN_CLIP_S:g}")
    clips = []
    for number, child in enumerate(np.random.SeedSequence(seed).spawn(performer_count)):
        rng = np.random.default_rng(child)
        clips += _clips_of(draw_movement_style(f"synthetic_{seed}_{number}", rng), np.arange(round(seconds * FPS)) / FPS, rng)
    return clips


def _clips_of(style: MovementStyle, t: np.ndarray, rng: np.random.Generator) -> list[BodyMotion]:
    """Return the clips of one performer."""
    return [
        stand(t, style, rng),
        walk(t, 0.75 * style.pace, style, rng),
        walk(t, 1.15 * style.pace, style, rng),
        walk(t, 1.45 * style.pace, style, rng),
        walk_curve(t, 1.05 * style.pace, style, rng),
        turn_on_the_spot(t, style, rng),
        run(t, 2.40 * style.pace, style, rng),
        sit(t, style, rng),
        squat(t, style, rng),
        stairs(t, STAIR_RISE_M, style, rng),
        stairs(t, -STAIR_RISE_M, style, rng),
    ]


def stand(t: np.ndarray, style: MovementStyle, rng: np.random.Generator) -> BodyMotion:
    """Return a clip of standing, shifting the weight and gesturing."""
    sway = 0.2 * _swaying(t, 2.5, rng)
    feet = feet_track(t, _side_by_side(style.stance_width, style.toe_out), [], sway)
    return _clip(feet, standing_posture(t, sway, style, rng), "stand", "stand", style)


def walk(t: np.ndarray, speed: float, style: MovementStyle, rng: np.random.Generator) -> BodyMotion:
    """Return a clip of a straight walk that reaches ``speed`` [m/s], or as much as the time allows."""
    path = path_along(t, _set_off_and_stop(t, speed), 0.0 * t, QUIET_END_S, t[-1] - QUIET_END_S)
    return _along(path, f"walk_{path.speed.max():.2f}", "walk", style, rng)


def run(t: np.ndarray, speed: float, style: MovementStyle, rng: np.random.Generator) -> BodyMotion:
    """Return a clip of a straight run that reaches ``speed`` [m/s], or as much as the time allows."""
    path = path_along(t, _set_off_and_stop(t, speed), 0.0 * t, QUIET_END_S, t[-1] - QUIET_END_S, run=True)
    return _along(path, f"run_{path.speed.max():.2f}", "run", style, rng)


def walk_curve(t: np.ndarray, speed: float, style: MovementStyle, rng: np.random.Generator) -> BodyMotion:
    """Return a clip of a walk around one bend and around another to the other side."""
    bend = rng.choice([-1.0, 1.0]) * rng.uniform(0.6, 0.8)  # rad/s
    half, last = 0.5 * t[-1], t[-1]
    times = np.array([1.0, 2.2, half - 0.5, half + 0.5, last - 2.2, last - 1.0])
    turning = interpolate_keyframes(t, times, bend * np.array([0.0, 1.0, 1.0, -1.0, -1.0, 0.0]))
    path = path_along(t, _set_off_and_stop(t, speed), turning, QUIET_END_S, t[-1] - QUIET_END_S)
    return _along(path, "turn_walking", "turn", style, rng, first_side=0 if bend > 0 else 1)


def turn_on_the_spot(t: np.ndarray, style: MovementStyle, rng: np.random.Generator) -> BodyMotion:
    """Return a clip of turning around on the spot in small steps."""
    rate = rng.choice([-1.0, 1.0]) * rng.uniform(0.7, 1.0)  # rad/s
    begin, end = QUIET_END_S, t[-1] - QUIET_END_S
    path = path_along(t, 0.0 * t, rate * reach_profile((t - begin) / 1.0, 0.4, 0.4) * reach_profile((end - t) / 1.0, 0.4, 0.4), begin, end)
    return _along(path, "turn_on_the_spot", "turn", style, rng, first_side=0 if rate > 0 else 1)


def squat(t: np.ndarray, style: MovementStyle, rng: np.random.Generator) -> BodyMotion:
    """Return a clip of squats with the arms held forward."""
    count = max(1, int((t[-1] - 1.0) / 3.2))
    starts = 0.5 + np.arange(count) * (t[-1] - 1.0) / count
    depths = np.repeat(rng.uniform(0.75, 1.0, count), 4) * np.tile([0, 1, 1, 0], count)
    depth = interpolate_keyframes(t, (starts[:, None] + rng.uniform(0.9, 1.0) * np.array([0.0, 1.25, 1.5, 2.75])).ravel(), depths)
    feet = feet_track(t, _side_by_side(0.34, style.toe_out + 0.2), [], 0.0 * t)
    posture = bending_posture(t, depth, lean=np.deg2rad(45.0), arms=np.deg2rad(80.0), style=style, rng=rng)
    return _clip(feet, replace(posture, height=STANDING_PELVIS_HEIGHT_M - 0.36 * depth), "squat", "squat", style)


def sit(t: np.ndarray, style: MovementStyle, rng: np.random.Generator) -> BodyMotion:
    """Return a clip of sitting down, without a chair, and getting up again."""
    rest = rng.uniform(0.25, 0.35) * t[-1]
    down, up = 0.5 * (t[-1] - rest), 0.5 * (t[-1] + rest)
    depth = interpolate_keyframes(t, np.array([down - 1.6, down, up, up + 1.5]), np.array([0.0, 1.0, 1.0, 0.0]))
    feet = feet_track(t, _side_by_side(max(style.stance_width, 0.22), style.toe_out), [], 0.0 * t)
    feet = replace(feet, pressure=feet.pressure - np.array([0.05, 0.0, 0.0]) * depth[:, None])
    posture = bending_posture(t, depth, lean=np.deg2rad(52.0), arms=np.deg2rad(70.0), style=style, rng=rng)
    return _clip(
        feet,
        replace(posture, height=STANDING_PELVIS_HEIGHT_M - (STANDING_PELVIS_HEIGHT_M - SEATED_PELVIS_HEIGHT_M) * depth),
        "sit",
        "sit",
        style,
    )


def stairs(t: np.ndarray, rise: float, style: MovementStyle, rng: np.random.Generator) -> BodyMotion:
    """Return a clip of climbing stairs of ``rise`` [m] a step, or of going down if that is negative."""
    beat = 0.58 / style.cadence
    count = int(min((t[-1] - 2.0 * QUIET_END_S - 0.5) / beat, 12))
    side, half = int(rng.integers(2)), 0.5 * style.step_width
    top = max(0.0, (1 - count) * rise)  # the way down ends at zero
    begin, steps = 0.5 * (t[-1] - count * beat), []
    for k in range(count):
        level = min(k + 1, count - 1)
        outward = 1.0 if (side + k) % 2 == 0 else -1.0
        plant = Plant(level * STAIR_TREAD_M - MIDFOOT, outward * half, outward * style.toe_out, top + level * rise)
        roll_on = np.deg2rad(14.0) if rise < 0 and k + 1 < count else 0.0
        steps.append(Footstep((side + k) % 2, begin + (k + 0.22) * beat, begin + (k + 1) * beat, plant, np.deg2rad(32.0), roll_on, 0.07))
    feet = feet_track(t, _side_by_side(style.step_width, style.toe_out, top), steps, 0.0 * t)
    speed = STAIR_TREAD_M / beat * smoother_step((t - begin) / 0.6) * smoother_step((begin + count * beat - t) / 0.6)
    path = path_along(t, speed, 0.0 * t, begin, begin + count * beat)
    return _clip(feet, walking_posture(path, feet, style, rng), "stairs_up" if rise > 0 else "stairs_down", "stairs", style)


def _set_off_and_stop(t: np.ndarray, speed: float) -> np.ndarray:
    """Return a speed (T,) [m/s] that rises to ``speed`` and falls more slowly (at most about 1 m/s^2) between quiet ends."""
    begin, end = QUIET_END_S, t[-1] - QUIET_END_S
    faster, slower = min(0.6 + 0.8 * speed, 0.38 * (end - begin)), min(0.6 + 1.2 * speed, 0.55 * (end - begin))
    reached = min(speed, 0.75 * slower)
    return reached * reach_profile((t - begin) / faster, 0.3, 0.3) * reach_profile((end - t) / slower, 0.25, 0.25)


def _swaying(t: np.ndarray, period: float, rng: np.random.Generator) -> np.ndarray:
    """Return a smooth random curve (T,) of about unit amplitude that is at rest at both ends."""
    return smooth_noise(t, rng, 1, period)[:, 0] * smoother_step(t / 1.5) * smoother_step((t[-1] - t) / 1.5)


def _side_by_side(width: float, toe_out: float, height: float = 0.0) -> tuple[Plant, Plant]:
    """Return the plants of both feet ``width`` [m] apart, with the weight of the body over the origin."""
    return Plant(-MIDFOOT, 0.5 * width, toe_out, height), Plant(-MIDFOOT, -0.5 * width, -toe_out, height)


def _along(
    path: GaitPath, name: str, kind: str, style: MovementStyle, rng: np.random.Generator, first_side: int | None = None
) -> BodyMotion:
    """Return a clip of walking or running along a path."""
    starts, steps = plan_steps(path, style, int(rng.integers(2)) if first_side is None else first_side)
    feet = feet_track(path.t, starts, steps, 0.1 * _swaying(path.t, 2.0, rng))
    height, flying = bounce(path.t, steps)
    return _clip(feet, replace(walking_posture(path, feet, style, rng), bounce=height, flying=flying), name, kind, style)


def _clip(feet: FeetTrack, posture: PostureTrack, name: str, kind: str, style: MovementStyle) -> BodyMotion:
    root, local = solve_whole_body(feet, posture)
    return BodyMotion(root, local, FPS, f"{style.name}_{name}", style.name, "synthetic", kind)
