"""Measures of root paths, against numbers worked out by hand."""

import numpy as np
import pytest

from eval.metrics.root_path import (
    displacement_errors,
    distance_ratio,
    drift,
    e_mse,
    e_mse_turned,
    end_error,
    error_after_travel,
    fixed_windows,
    path_length,
    stationary_path,
    travelling_windows,
)


def straight(speed: float, seconds: float, fps: float = 100.0) -> np.ndarray:
    """Return a path along x at 1 m height, a frame at either end."""
    t = np.arange(round(seconds * fps) + 1) / fps
    return np.stack([speed * t, 0.0 * t, 0.0 * t + 1.0], axis=1)


def test_windows_are_ten_seconds_or_the_whole_shorter_clip() -> None:
    assert list(fixed_windows(2500, 100.0)) == [slice(0, 1000), slice(1000, 2000)]  # the last 5 s fill no window
    assert list(fixed_windows(700, 100.0)) == [slice(0, 700)]


def test_all_windows_of_a_clip_that_travels_count_and_none_of_another() -> None:
    assert travelling_windows(straight(0.06, 19.99), 100.0) == [slice(0, 1000), slice(1000, 2000)]  # 1.2 m
    assert travelling_windows(straight(0.04, 19.99), 100.0) == []  # 0.8 m


def test_e_mse_is_the_mean_square_over_three_coordinates() -> None:
    truth = np.zeros((3, 3))
    path = np.array([[5.0, 5.0, 5.0], [6.0, 5.0, 5.0], [5.0, 7.0, 3.0]])
    # moved to the truth's start: errors (0 0 0), (1 0 0), (0 2 -2); squares 0 + 1 + 8 over nine numbers
    assert e_mse(path, truth) == pytest.approx(1.0)


def test_turning_and_stretching_take_heading_and_length_away() -> None:
    truth = np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.0, 2.0, 1.0]])
    half_as_long_and_to_the_left = np.array([[5.0, 5.0, 1.0], [5.0, 6.0, 1.0], [4.0, 6.0, 1.3]])
    assert e_mse_turned(half_as_long_and_to_the_left, truth, stretched=True) == pytest.approx(0.3**2 / 9)  # the height alone is left
    # Turned it still lacks 1 m, then 1 m ahead and 1 m to the left.
    assert e_mse_turned(half_as_long_and_to_the_left, truth) == pytest.approx((1.0 + 2.0 + 0.3**2) / 9)
    assert e_mse_turned(np.zeros((3, 3)), truth) == pytest.approx((4.0 + 8.0) / 9)  # who stands cannot be turned
    assert e_mse_turned(truth, truth) == pytest.approx(0.0)


def test_a_motionless_root_errs_by_the_whole_way() -> None:
    truth = straight(1.0, 4.0)
    still = stationary_path(truth)
    assert (drift(still, truth), end_error(still, truth), path_length(still)) == (pytest.approx(1.0), pytest.approx(4.0), 0.0)


def test_drift_is_the_error_at_the_end_over_the_way() -> None:
    truth = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 2.0, 9.0]])  # 5 m in the plane, height is no way
    path = truth + np.array([[1.0, 1.0, 1.0], [7.0, 7.0, 7.0], [1.0, 4.0, 5.0]])  # ends (0, 3, 4) off, so by 5 m; in the plane by 3 m
    assert drift(path, truth) == pytest.approx(1.0)
    assert end_error(path, truth, axes=2) == pytest.approx(3.0)


def test_the_way_does_not_count_trembling() -> None:
    truth = straight(1.0, 4.0)
    trembling = 0.8 * truth
    trembling[1::2, 1] += 0.01  # every other frame: 4 m of trembling to and fro, none of it at the ends of strides of 20 frames
    assert distance_ratio(trembling, truth, 100.0) == pytest.approx(0.8)


def test_errors_of_frames_are_along_the_axes_of_the_pelvis() -> None:
    truth = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 2.0, 1.0]])  # goes along y, the first frame facing y, the second facing x
    path = np.array([[0.0, 0.0, 1.1], [0.0, 1.2, 1.3], [0.0, 2.1, 1.0]])
    heading = np.array([np.pi / 2.0, 0.0, 0.0])
    # steps are (0, 1.2, 0.2) and (0, 0.9, -0.3), so 0.2 too far along y, which is ahead, then 0.1 too short along y, which is to the left
    np.testing.assert_allclose(displacement_errors(path, truth, heading), [[0.2, 0.0, 0.2], [0.0, -0.1, -0.3]], atol=1e-12)
    # the heights themselves are 0.3 and 0.0 too much
    np.testing.assert_allclose(displacement_errors(path, truth, heading, absolute_height=True)[:, 2], [0.3, 0.0], atol=1e-12)


def test_error_after_metres_starts_at_every_frame() -> None:
    truth = np.stack([np.arange(5.0), np.zeros(5), np.zeros(5)], axis=1)  # a metre a frame
    path = truth.copy()
    path[:, 1] = [0.0, 0.0, 1.0, 1.0, 1.0]  # one step to the left, from frame 1 to 2
    # after 2 m: from frame 0 and 1 on 1 m off, from frame 2 on nothing; after 4 m: from frame 0 on 1 m
    assert error_after_travel(path, truth, 2.0) == pytest.approx(2.0 / 3.0)
    assert error_after_travel(path, truth, 4.0) == pytest.approx(1.0)
    assert np.isnan(error_after_travel(path, truth, 5.0))
