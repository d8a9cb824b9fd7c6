"""Derivatives of a control step of somebody in the air, where they are known by hand."""

import numpy as np
import pytest

from datasets.motion.humanoid import HINGE_NAMES, TOTAL_MASS_KG
from envs.physics.engine_interface import CONTROL_STEP_S
from envs.physics.mujoco_cpu import CpuPhysics
from eval.clean.optimisation.step_derivatives import HELP_UNITS, Linearisation, StepDerivatives
from tests.builders import STANDING

ROOT, SPEED = slice(3), slice(49, 52)  # rows and columns of the root's position and velocity in a state
HELP = slice(43, 46)  # force among the inputs


def linearised(height: float, scale: float = 1.0) -> Linearisation:
    """Return the derivatives of a step that begins in the upright pose, at a height above the ground [m]."""
    physics, pose = CpuPhysics(1), np.zeros(50)
    pose[:7] = [0.0, 0.0, STANDING + height, 1.0, 0.0, 0.0, 0.0]
    physics.reset(np.array([0]), pose[None], np.zeros((1, 49)))
    return StepDerivatives(1).linearise(physics.get_state()[0], np.zeros(43), np.zeros(6), scale)


@pytest.fixture(scope="module")
def falling() -> Linearisation:
    return linearised(1.0)


def test_who_falls_goes_on_as_he_went(falling: Linearisation) -> None:
    # In the air a shift stays a shift, and a velocity adds its way of a thirtieth of a second and stays.
    assert falling.by_state[ROOT, ROOT] == pytest.approx(np.eye(3), abs=1e-9)
    assert falling.by_state[ROOT, SPEED] == pytest.approx(np.eye(3) * CONTROL_STEP_S, abs=1e-9)
    assert falling.by_state[SPEED, SPEED] == pytest.approx(np.eye(3), abs=1e-9)
    # The step itself is a fall from rest: g T = 0.327 m/s.
    assert falling.velocity[2] == pytest.approx(-9.81 / 30.0, abs=1e-3)


def test_a_motor_turns_its_own_joint(falling: Linearisation) -> None:
    hinge = HINGE_NAMES.index("forearm_l_z")
    assert 0.2 < falling.by_input[6 + hinge, hinge] < 1.0  # the forearm follows its target by some of the way
    assert np.argmax(np.abs(falling.by_input[6:49, hinge])) == hinge


def test_help_of_a_body_weight_carries_the_body(falling: Linearisation) -> None:
    # The pelvis, lighter than the whole body, is moved by more than the whole body would be: by over g T = 0.327 m/s.
    assert HELP_UNITS[:3] == pytest.approx(TOTAL_MASS_KG * 9.81)
    assert HELP_UNITS[3:] == pytest.approx(0.3 * TOTAL_MASS_KG * 9.81)
    assert falling.by_input[51, HELP][2] > 9.81 / 30.0
    assert falling.by_input[51, HELP][2] > 10.0 * abs(falling.by_input[51, HELP][0])


def test_the_ground_holds_who_stands() -> None:
    # Who is put a millimetre lower is pushed back: less of it is left than in the air.
    assert linearised(0.0).by_state[2, 2] < 0.9


def test_secants_in_the_air_do_not_depend_on_their_length(falling: Linearisation) -> None:
    assert linearised(1.0, 0.4).by_state[ROOT] == pytest.approx(falling.by_state[ROOT], abs=2e-2)
