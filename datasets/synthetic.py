"""Human motion made from nothing, with exact ground truth: the embedded default and a fixture for tests."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from datasets.balance import GRAVITY as GRAVITY
from datasets.curves import keyframes, reach_profile, smooth_noise, smoother_step
from datasets.footsteps import Plant, Step, feet_track, MIDFOOT
from datasets.gait import Path, bounce, path_along, plan_steps
from datasets.motion import BodyMotion
from datasets.performer import Style, draw_style
from datasets.upper_body import bending_carriage, seconds, standing_carriage, walking_carriage
from datasets.whole_body import FPS, Carriage, perform
from datasets.footsteps import FeetTrack

QUIET = 0.7  # s of standing at either end of a clip


def _clip(feet: FeetTrack, carriage: Carriage, name: str, kind: str, style: Style) -> BodyMotion:
    root, local = perform(feet, carriage)
    return BodyMotion(root, local, FPS, f"synthetic_{style.name}_{name}", style.name, "synthetic", kind)


def _ramped(t: np.ndarray, begin: float, end: float, ramp: float) -> np.ndarray:
    return reach_profile((t - begin) / ramp, 0.35, 0.35) * reach_profile((end - t) / ramp, 0.35, 0.35)


def _along(path: Path, style: Style, rng: np.random.Generator, first_side: int) -> tuple[FeetTrack, Carriage]:
    starts, steps = plan_steps(path, style, first_side)
    feet = feet_track(path.t, starts, steps, 0.1 * smooth_noise(path.t, rng, 1, 2.0)[:, 0])
    carriage = walking_carriage(path, feet, style, rng)
    height, flying = bounce(path.t, steps)
    return feet, replace(carriage, bounce=height, flying=flying)


def walk(speed: float, duration: float, style: Style, rng: np.random.Generator) -> BodyMotion:
    t = seconds(duration)
    begin, end = QUIET, t[-1] - QUIET
    path = path_along(t, speed * _ramped(t, begin, end, min(0.6 + 1.0 * speed, 0.45 * (end - begin))), 0.0 * t, begin, end)
    feet, carriage = _along(path, style, rng, int(rng.integers(2)))
    return _clip(feet, carriage, f"walk_{speed:.2f}", "run" if speed > 1.9 else "walk", style)


def curve(speed: float, turning: float, duration: float, style: Style, rng: np.random.Generator) -> BodyMotion:
    t = seconds(duration)
    begin, end = QUIET, t[-1] - QUIET
    ramp = _ramped(t, begin, end, 1.2)
    path = path_along(t, speed * ramp, turning * ramp, begin, end)
    feet, carriage = _along(path, style, rng, 0 if turning > 0 else 1)
    return _clip(feet, carriage, f"turn_{speed:.2f}", "turn", style)


def stand(duration: float, style: Style, rng: np.random.Generator) -> BodyMotion:
    t = seconds(duration)
    sway = 0.2 * smooth_noise(t, rng, 1, 2.5)[:, 0]
    half = 0.5 * style.stance_width
    starts = (Plant(-MIDFOOT, half, style.toe_out), Plant(-MIDFOOT, -half, -style.toe_out))
    feet = feet_track(t, starts, [], sway)
    return _clip(feet, standing_carriage(t, sway, style, rng), "stand", "stand", style)


def synthetic_clips(seed: int, performer_count: int = 4, seconds: float = 8.0) -> list[BodyMotion]:
    clips = []
    for number, child in enumerate(np.random.SeedSequence(seed).spawn(performer_count)):
        rng = np.random.default_rng(child)
        style = draw_style(f"synthetic_{seed}_{number}", rng)
        clips += [stand(seconds, style, rng), walk(0.8, seconds, style, rng), walk(1.4, seconds, style, rng), curve(1.1, 0.7, seconds, style, rng),
            curve(0.0, -0.9, seconds, style, rng), walk(2.7, seconds, style, rng)]
    return clips
