"""The real walk: is it aligned in time and heading, is gravity gone, are paths comparable?"""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from configs.errors import InputError
from datasets.motion.kinematics import body_poses, linear_acceleration
from eval.study.suit.vicon_walk import RealWalk, align_heading, load_real_walk, track_root_by_contacts


@pytest.fixture(scope="module")
def walk(shared_data: Path) -> RealWalk:
    return load_real_walk(shared_data)


def test_turning_a_path_onto_the_truth_keeps_its_start_and_length() -> None:
    # two metres to the left of the start and up, against three metres ahead: a quarter turn to the right
    path = np.array([[1.0, 1.0, 0.0], [1.0, 3.0, 0.5]])
    truth = np.array([[5.0, 5.0, 0.0], [8.0, 5.0, 0.0]])
    np.testing.assert_allclose(align_heading(path, truth), [[1.0, 1.0, 0.0], [3.0, 1.0, 0.5]], atol=1e-12)


def test_a_folder_without_the_recording_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"xsens_neura_S02_walk1.bvh: no such file"):
        load_real_walk(tmp_path)


@pytest.mark.shared_data
def test_the_walk_is_whole(walk: RealWalk) -> None:
    assert (len(walk.motion), walk.motion.fps, walk.accelerations.shape, walk.truth.shape) == (955, 100.0, (955, 19, 3), (955, 3))
    assert set(walk.measured_bodies) == {"pelvis", *(f"{part}_{side}" for part in ("thigh", "shin", "foot") for side in "lr")}
    assert np.abs(walk.accelerations.mean(axis=0)).max() < 0.3  # it starts and ends at rest: gravity is not in there
    np.testing.assert_allclose(walk.truth[0], walk.motion.root_position[0], atol=1e-12)


@pytest.mark.shared_data
def test_the_pelvis_sensor_agrees_with_vicon_in_time_and_heading(walk: RealWalk) -> None:
    low_pass = butter(2, 6.0, fs=100.0, output="sos")
    measured, truth = (sosfiltfilt(low_pass, a, axis=0) for a in (walk.accelerations[:, 0], linear_acceleration(walk.truth, 100.0)))
    inner = slice(20, -20)
    agreement = [np.corrcoef(measured[inner].ravel(), np.roll(truth, lag, axis=0)[inner].ravel())[0, 1] for lag in range(-8, 9)]
    assert abs(int(np.argmax(agreement)) - 8) <= 1 and max(agreement) > 0.85
    turn = np.sum((measured[:, 0] - 1j * measured[:, 1]) * (truth[:, 0] + 1j * truth[:, 1]))
    assert abs(np.degrees(np.angle(turn))) < 3.0


@pytest.mark.shared_data
def test_the_feet_of_pose_and_sensors_move_together(walk: RealWalk) -> None:
    low_pass = butter(2, 6.0, fs=100.0, output="sos")
    centres = body_poses(walk.motion)[0][:, 14]  # foot_l: the suit's own path holds here, where feet stand and swing
    pose = sosfiltfilt(low_pass, linear_acceleration(centres, 100.0), axis=0)[:, 2]
    sensor = sosfiltfilt(low_pass, walk.accelerations[:, 13], axis=0)[:, 2]  # the 19 lack the spine, so one place earlier
    agreement = [np.corrcoef(sensor[20:-20], np.roll(pose, lag)[20:-20])[0, 1] for lag in range(-8, 9)]
    assert abs(int(np.argmax(agreement)) - 8) <= 2 and max(agreement) > 0.8


@pytest.mark.shared_data
def test_suit_and_contacts_find_the_way_there_and_back(walk: RealWalk) -> None:
    away = walk.truth - walk.truth[0]
    assert np.linalg.norm(away, axis=1).max() > 2.5  # m: there
    for path in (walk.motion.root_position, track_root_by_contacts(walk)):
        np.testing.assert_allclose(path[0], walk.truth[0], atol=1e-12)
        turned = align_heading(path, walk.truth)
        error = np.sqrt(np.mean(np.sum((turned - walk.truth) ** 2, axis=1)))
        assert error < 0.3 < np.sqrt(np.mean(np.sum(away**2, axis=1)))  # m, motionless is worse
