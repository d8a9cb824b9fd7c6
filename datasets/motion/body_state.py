"""Where the 20 bodies are and how they move, at one instant of each of N worlds."""

from typing import NamedTuple

from datasets.motion.rotation import Array


class BodyState(NamedTuple):
    """Bodies of N worlds, simulated or of a reference; NumPy or torch, world axes.

    Attributes:
        pos: Origins [m], shape (N, 20, 3).
        rot: Rotation matrices, columns are the bodies' axes, shape (N, 20, 3, 3).
        lin_vel: Of the origins [m/s], shape (N, 20, 3).
        ang_vel: [rad/s], shape (N, 20, 3).
        com: Centre of mass [m], shape (N, 3).
        com_vel: Of the centre of mass [m/s], shape (N, 3).
    """

    pos: Array
    rot: Array
    lin_vel: Array
    ang_vel: Array
    com: Array
    com_vel: Array
