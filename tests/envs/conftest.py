"""A library of three clips of a few seconds, made by hand."""

import pytest

from datasets.library.motion_library import MotionLibrary
from tests.builders import STANDING, posed
from tests.envs.states import swaying


@pytest.fixture(scope="session")
def library() -> MotionLibrary:
    """Return 480 frames of swaying, 90 frames of swaying on the move, 60 frames of a T-pose 1 cm in the ground."""
    return MotionLibrary.from_clips([swaying("sway", 480, 0.0), swaying("stroll", 90, 0.4), posed({}, 60, STANDING - 0.01)])
