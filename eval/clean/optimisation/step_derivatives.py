"""Derivatives of a control step: how the state after it depends on the state before, on the motors' targets and on help at the pelvis.

They are secants, not limits: contacts that begin or end within a control step make its true derivatives useless a few millimetres on.
"""

from typing import NamedTuple

import numpy as np

from datasets.motion.humanoid import HINGE_COUNT
from envs.mimic.root_assist import BODY_WEIGHT_N, MAX_TORQUE_ARM_M
from envs.physics.generalised_coordinates import VELOCITY_SIZE, change_pose, state_change
from envs.physics.mujoco_cpu import CpuPhysics

STATE_SIZE = 2 * VELOCITY_SIZE  # change of a pose, then of the velocities
HELP_SIZE = 6  # force and torque on the pelvis, world axes
INPUT_SIZE = HINGE_COUNT + HELP_SIZE
HELP_UNITS = BODY_WEIGHT_N * np.array([1.0, 1.0, 1.0, *3 * [MAX_TORQUE_ARM_M]])  # N and Nm of a help of 1
# Lengths of the secants. With a thirtieth of them feedback holds a pushed walk for 0.33 instead of 0.79 of its length (docs/cleaning.md).
POSE_SECANT, VELOCITY_SECANT = 8e-3, 0.12  # m or rad; m/s or rad/s
TARGET_SECANT, HELP_SECANT = 4e-2, 2e-2  # rad; body weights
SECANTS = np.repeat([POSE_SECANT, VELOCITY_SECANT, TARGET_SECANT, HELP_SECANT], [VELOCITY_SIZE, VELOCITY_SIZE, HINGE_COUNT, HELP_SIZE])


class Linearisation(NamedTuple):
    """A control step and its derivatives.

    Attributes:
        by_state: Derivatives of the state's change by that of the state before, shape (98, 98).
        by_input: Derivatives by targets and help, shape (98, 49).
        pose: Generalised positions after the step, shape (50,).
        velocity: Generalised velocities after it, shape (49,).
    """

    by_state: np.ndarray
    by_input: np.ndarray
    pose: np.ndarray
    velocity: np.ndarray


class StepDerivatives:
    """Simulates a control step once for each number that it depends on."""

    def __init__(self, threads: int) -> None:
        """Build the worlds.

        Args:
            threads: Native threads that step them.
        """
        self._physics = CpuPhysics(1 + STATE_SIZE + INPUT_SIZE, threads)

    def linearise(self, state: np.ndarray, targets: np.ndarray, help_bw: np.ndarray, scale: float = 1.0) -> Linearisation:
        """Return a control step and its derivatives.

        Args:
            state: State of a world, from ``CpuPhysics.get_state``, shape (S,).
            targets: PD targets of the motors [rad], shape (43,).
            help_bw: Force on the pelvis [body weights] and torque [0.3 m times that], shape (6,).
            scale: Length of the secants over the usual one.
        """
        physics, secants = self._physics, scale * SECANTS
        changes = np.concat([np.zeros((1, len(secants))), np.diag(secants)])
        by_pose, by_velocity, by_target, by_help = np.split(changes, np.cumsum([VELOCITY_SIZE, VELOCITY_SIZE, HINGE_COUNT]), axis=1)
        physics.set_state(np.repeat(state[None], len(changes), axis=0))
        pose, velocity, _ = physics.motion()
        physics.move(change_pose(pose, by_pose), velocity + by_velocity)
        physics.set_root_wrench((help_bw + by_help) * HELP_UNITS)
        physics.step(targets + by_target)
        pose, velocity, _ = physics.motion()
        slopes = (state_change((pose[:1], velocity[:1]), (pose[1:], velocity[1:])) / secants[:, None]).T
        return Linearisation(slopes[:, :STATE_SIZE], slopes[:, STATE_SIZE:], pose[0], velocity[0])
