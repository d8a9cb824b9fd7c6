"""What the root study measures of paths, against numbers worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest

from eval.study.root.scores import score
from tests.builders import STANDING
from tests.eval.study.root.root_study_parts import gliding, take


def test_a_path_that_is_a_tenth_too_short() -> None:
    tested = take(gliding("cmu_a", "walk", (1.0, 0.0, 0.0), seconds=9.99))
    path = tested.truth.root_position * np.array([0.9, 1.0, 1.0])
    found = score([tested], [path], absolute_height=False)
    # 9.99 m long and 0.999 m short of it at the end; every step is 1 cm long and 0.1 cm short
    assert found["drift"] == pytest.approx(0.1)
    assert found["end_error"] == found["end_error_gaits"] == pytest.approx(99.9)
    assert found["distance_ratio"] == pytest.approx(0.9)
    assert (found["mu_f"], found["sigma_f"]) == (pytest.approx(-0.1), pytest.approx(0.0, abs=1e-9))
    assert found["error_after_5m"] == pytest.approx(0.5)
    # the error grows linearly to 0.999 m along one of three axes: its mean square is 0.999^2 / 3 / 3, but for the finite number of frames
    assert found["e_mse"] == found["e_mse_cmu"] == pytest.approx(0.999**2 / 9.0, rel=1e-3)
    assert "e_mse_bandai" not in found
    assert "stairs_error" not in found


def test_stairs_are_measured_by_their_height_alone() -> None:
    climb = take(gliding("synthetic_a", "stairs", (0.5, 0.0, 0.2), system="synthetic"))
    path = climb.truth.root_position * np.array([2.0, 1.0, 1.0])
    path[:, 2] = STANDING + 0.5 * (path[:, 2] - STANDING)
    found = score([climb], [path], absolute_height=False)
    assert found == {"stairs_error": pytest.approx(30.0), "stairs_ratio": pytest.approx(0.5)}  # 0.6 m high, half of it gained


def test_heights_of_jumps_are_measured_in_the_air_and_on_the_ground() -> None:
    jump = gliding("cmu_jump", "jump", (1.0, 0.0, 0.0), seconds=1.99)
    root = jump.root_position.copy()
    root[50:100, 2] += 0.3  # a quarter of 200 frames in the air
    tested = take(replace(jump, root_position=root))
    path = jump.root_position + np.array([0.0, 0.0, 0.02])  # never leaves the ground and is 2 cm too high there
    found = score([tested], [path], absolute_height=True)
    assert (found["height_error_in_air"], found["height_error_on_ground"]) == (pytest.approx(28.0), pytest.approx(2.0))
    # heights err by -28 cm in 50 and by 2 cm in 149 of the 199 frames after the first
    assert found["mu_v"] == pytest.approx((50 * -28.0 + 149 * 2.0) / 199)


def test_performers_rise_on_their_own() -> None:
    takes = [take(gliding("ann_1", "walk", (1.0, 0.0, 0.0), 1.99)), take(gliding("bob_1", "walk", (1.0, 0.0, 0.0), 1.99))]
    paths = [one.truth.root_position * np.array([1.0, 1.0, 1.0]) for one in takes]
    paths[1][:, 2] -= np.linspace(0.0, 0.02, 200)  # bob sinks by 2 cm in 2 s
    found = score(takes, paths, absolute_height=False)
    assert (found["rise_of_ann"], found["rise_of_bob"]) == (pytest.approx(0.0, abs=1e-9), pytest.approx(-1.0))
