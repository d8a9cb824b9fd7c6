"""Movement styles of synthetic performers: parameters in which people's movements differ."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class MovementStyle:
    """Movement style of one performer.

    Attributes:
        name: Name of the performer.
        cadence: Step rate relative to the average person's at the same speed.
        pace: Walking speed relative to the average person's.
        step_width: Distance between the ankles while walking, across the path [m].
        stance_width: Distance between the ankles while standing [m].
        toe_out: Yaw of each foot outward [rad].
        arm_swing: Flexion and extension of the shoulder at a stride of 1.4 m [rad].
        elbow: Flexion of the hanging arm's elbow [rad].
        abduction: Abduction of the hanging upper arm from the vertical [rad].
        lean: Forward lean of the trunk [rad].
        slump: Forward bend of the chest over the spine [rad].
        twist: Yaw of the pelvis at a stride of 1.4 m [rad].
        crouch: Share of the leg's length that is never used; without it knees would lock.
        left_handed: Whether the left arm gestures first.
    """

    name: str
    cadence: float
    pace: float
    step_width: float
    stance_width: float
    toe_out: float
    arm_swing: float
    elbow: float
    abduction: float
    lean: float
    slump: float
    twist: float
    crouch: float
    left_handed: bool


def draw_movement_style(name: str, rng: np.random.Generator) -> MovementStyle:
    """Return a random style named ``name``; the spread is about that of adults."""
    degrees = np.deg2rad
    return MovementStyle(
        name=name,
        cadence=rng.uniform(0.93, 1.07),
        pace=rng.uniform(0.88, 1.12),
        step_width=rng.uniform(0.13, 0.17),
        stance_width=rng.uniform(0.18, 0.26),
        toe_out=degrees(rng.uniform(3.0, 11.0)),
        arm_swing=degrees(rng.uniform(14.0, 32.0)),
        elbow=degrees(rng.uniform(14.0, 32.0)),
        abduction=degrees(rng.uniform(10.0, 15.0)),
        lean=degrees(rng.uniform(-2.0, 2.0)),
        slump=degrees(rng.uniform(0.0, 8.0)),
        twist=degrees(rng.uniform(4.0, 9.0)),
        crouch=rng.uniform(0.010, 0.017),
        left_handed=bool(rng.uniform() < 0.3),
    )
