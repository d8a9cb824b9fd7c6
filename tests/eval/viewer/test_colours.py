"""Colours of the pages."""

import numpy as np

from eval.viewer.colours import FOOT_COLOURS, USER_COLOURS, blend, in_css, in_linear, user_colour


def test_colours_are_blended_in_levels() -> None:
    assert blend((0, 0, 0), (80, 160, 240), 0.5) == (40, 80, 120)
    assert blend((0, 0, 0), (80, 160, 240), 0.51) == (40, 80, 120)
    assert in_css((255, 0, 10)) == "#ff000a"


def test_colours_in_linear_light() -> None:
    # (128 / 255 + 0.055) / 1.055 = 0.5279, to the power of 2.4 = 0.2159, of 255 = 55; 10 / 255 / 12.92 * 255 = 0.8
    assert in_linear(np.array([[0, 128, 255], [10, 10, 10]])).tolist() == [[0, 55, 255], [1, 1, 1]]


def test_users_have_colours_of_their_own() -> None:
    assert user_colour(1) != user_colour(2)
    assert user_colour(1) == user_colour(1 + len(USER_COLOURS))
    assert not set(USER_COLOURS) & set(FOOT_COLOURS)
