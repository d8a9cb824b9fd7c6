"""State of the 20 bodies at one instant of each of N worlds: positions, rotations, velocities, centre of mass."""

from typing import NamedTuple

from datasets.motion.rotation import Array


class BodyState(NamedTuple):
    """State of the bodies of N worlds, simulated or of a reference; NumPy or torch, world axes.

    Attributes:
        pos: Origins of the bodies [m], shape (N, 20, 3).
        rot: Rotation matrices of the bodies, whose columns are the bodies' axes, shape (N, 20, 3, 3).
        lin_vel: Velocities of the origins [m/s], shape (N, 20, 3).
        ang_vel: Angular velocities of the bodies [rad/s], shape (N, 20, 3).
        com: Centre of mass [m], shape (N, 3).
        com_vel: Velocity of the centre of mass [m/s], shape (N, 3).
    """

    pos: Array
    rot: Array
    lin_vel: Array
    ang_vel: Array
    com: Array
    com_vel: Array
