"""MVNX files: reading, rotation and scaling, and refusal of bad ones."""

from pathlib import Path

import numpy as np
import pytest

from configs.errors import InputError
from datasets.formats import mvnx
from datasets.formats.mvnx import read_mvnx
from datasets.imu.recording import read_imu_recording
from datasets.imu.sensor_model import SENSOR_BODIES
from datasets.library.sources import find_motion_files, load_clips, load_source_motions
from datasets.motion.humanoid import BODY_NAMES
from eval.metrics.artefacts import mean_distance_local_mm
from tests.datasets.formats.mvnx_files import QUARTER, SEGMENTS, THREE, mvnx_frame, mvnx_text, write_mvnx_file


def test_accelerations_are_turned_and_scaled_as_the_clip_is(tmp_path: Path) -> None:
    tpose = mvnx_frame(0, "0 0 0 0 0 0", "tpose")  # calibration frames are no motion
    recording = read_imu_recording(write_mvnx_file(tmp_path, mvnx_text(tpose + THREE)))
    assert (len(recording.motion), recording.motion.fps, recording.motion.system) == (3, 50.0, "imu")
    assert recording.measured == ("pelvis", "hand_l")
    # Facing y became facing x, a quarter turn to the right: (x, y) is at (y, -x). The pelvis' x of 0, 1, 2 at 50 Hz is
    # 0, 0.5, 1, 1.5, 2 at 100 Hz. Times 0.8: (2 * 0.8, -0.8 * that, 0.5 * 0.8)
    pelvis = np.array([[1.6, -0.8 * x, 0.4] for x in (0.0, 0.5, 1.0, 1.5, 2.0)])
    found = dict(zip((BODY_NAMES[body] for body in SENSOR_BODIES), recording.accelerations.transpose(1, 0, 2), strict=True))
    np.testing.assert_allclose(found["pelvis"], pelvis, atol=1e-6)
    np.testing.assert_allclose(found["hand_l"], [[6.4, -5.6, 7.2]] * 5, atol=1e-6)
    for body in ("head", "hand_r", "toe_l"):  # in a still pose all that has no sensor goes with the pelvis
        np.testing.assert_allclose(found[body], pelvis, atol=1e-6)


def test_the_pose_is_that_of_the_file(tmp_path: Path) -> None:
    motion = read_imu_recording(write_mvnx_file(tmp_path, mvnx_text(THREE))).motion
    identity = np.tile([1.0, 0.0, 0.0, 0.0], (3, 20, 1))
    np.testing.assert_allclose(np.abs(motion.local_rotations), identity, atol=1e-6)
    np.testing.assert_allclose(motion.root_position[:, :2], 0.0, atol=1e-6)


def test_segments_rate_and_tips_are_read(tmp_path: Path) -> None:
    found = read_mvnx(write_mvnx_file(tmp_path, mvnx_text(THREE)))
    assert (found.segments, found.sensors, found.fps) == (tuple(SEGMENTS), ("Pelvis", "LeftHand"), 50.0)
    assert found.parents[:5] == (-1, 0, 1, 2, 3) and found.segments[found.parents[15]] == "Pelvis"
    np.testing.assert_array_equal(found.end_offsets[found.segments.index("Head")], [0.0, 0.0, 0.1])
    np.testing.assert_array_equal(found.end_offsets[found.segments.index("T8")], [0.0, 0.0, 0.0])


def test_a_document_type_is_refused_unless_it_is_commented_out(tmp_path: Path) -> None:
    bomb = '<!DOCTYPE mvnx [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]>'
    with pytest.raises(InputError, match=r"clip.mvnx: holds a document type 'mvnx'"):
        read_mvnx(write_mvnx_file(tmp_path, mvnx_text(THREE, bomb)))
    with pytest.raises(InputError, match="document type"):
        read_mvnx(write_mvnx_file(tmp_path, mvnx_text(THREE, '<!DOCTYPE mvnx SYSTEM "file:///etc/passwd">')))
    assert len(read_mvnx(write_mvnx_file(tmp_path, mvnx_text(THREE, '<!-- <!DOCTYPE mvnx SYSTEM "x"> -->'))).positions) == 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("no xml at all", "not an MVNX file"),
        ("<bvh/>", "its root is 'bvh' and should be <mvnx>"),
        (mvnx_text(THREE, rate="fast"), "frameRate 'fast' should be a number from 1 to 1000"),
        (mvnx_text(""), "no frames of type 'normal'"),
        (mvnx_text(mvnx_frame(0, "1 2 3")), "frame 0, <sensorFreeAcceleration>: 3 words, should be 6 finite numbers"),
        (mvnx_text(mvnx_frame(0, "1 2 3 4 5 nan")), "frame 0, <sensorFreeAcceleration>: 6 words, should be 6 finite numbers"),
        (mvnx_text(mvnx_frame(0, "1 2 3 4 5 x")), "should be 6 finite numbers"),
        (mvnx_text(mvnx_frame(0, "0 0 0 0 0 0") + mvnx_frame(2, "0 0 0 0 0 0")), "frame index '2' stands where 1 should"),
        (mvnx_text(THREE.replace("sensorFreeAcceleration", "sensorAcceleration")), "no sensor on the pelvis among none"),
        (mvnx_text(THREE.replace("sensorFree", "sensorNo").replace("sensorNo", "sensorFree", 2)), "frame 1 lacks <sensorFreeAcc"),
        (mvnx_text(THREE.replace(QUARTER, "2 0 0 0", 1)), "frame 0: orientation of 'Pelvis' should be a quaternion of length 1"),
        (mvnx_text(THREE, sensors=("Pelvis", "Hat")), "sensor 'Hat' sits on no segment"),
        (mvnx_text(THREE, sensors=("Pelvis", "Pelvis")), "2 sensors; 1 to 100 with labels of their own"),
        (mvnx_text(THREE).replace("<connector1>T8/j", "<connector1>Wing/j", 1), "joint 'jNeck' connects 'Wing' and 'Neck'"),
        (mvnx_text(THREE).replace("<connector1>Pelvis/j", "<connector1>T8/j", 1), "segment 'L5' should hang under one listed before it"),
        (mvnx_text(THREE).replace("T8", "&#10;"), r"'\\n' stands where a segment's label"),
        (mvnx_text(THREE).replace("T8", 300 * "T"), "'T{40}...' stands where a segment's label of at most 200"),
        (mvnx_text(THREE, sensors=("T8", "LeftHand")), "no sensor on the pelvis among T8, LeftHand"),
        (mvnx_text(THREE).replace("Leg", "Fin"), "no joint found for pelvis, thigh_l"),
    ],
)
def test_what_is_broken_is_named(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read_imu_recording(write_mvnx_file(tmp_path, text))
    assert "clip.mvnx" in str(caught.value) and "\n" not in str(caught.value)


def test_elements_without_end_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mvnx, "MAX_ELEMENTS", 200)
    with pytest.raises(InputError, match=r"clip.mvnx: holds more than 200 elements"):
        read_mvnx(write_mvnx_file(tmp_path, mvnx_text(THREE).replace("</segments>", 200 * "<a/>" + "</segments>")))


def test_a_file_that_is_not_there_or_too_large_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match=r"nowhere.mvnx: cannot be read"):
        read_mvnx(tmp_path / "nowhere.mvnx")
    monkeypatch.setattr(mvnx, "MAX_BYTES", 10)
    with pytest.raises(InputError, match="export a shorter clip"):
        read_mvnx(write_mvnx_file(tmp_path, mvnx_text(THREE)))


@pytest.mark.shared_data
def test_the_real_file_is_its_bvh_twin_with_accelerations(shared_data: Path) -> None:
    file = shared_data / "gpl/imu/xsens_andres_test_mocap.mvnx"
    recording = read_imu_recording(file)
    assert (len(recording.motion), recording.motion.fps) == (112, 60.0)
    assert recording.accelerations.shape == (186, 19, 3)  # 111 / 60 s are 185 hundredths
    upper = ("pelvis", "chest", "head", *(f"{part}_{side}" for side in "lr" for part in ("collar", "upper_arm", "forearm", "hand")))
    assert recording.measured == upper  # the suit was worn without the legs' sensors
    twin = load_clips(file.with_suffix(".bvh"))[0]  # its first frame, a T-pose, is dropped
    assert mean_distance_local_mm(recording.motion.cut(1, 112), twin) < 1.0  # mm
    assert np.abs(recording.accelerations.mean(axis=0)).max() < 0.5  # of someone seated: gravity is not in there
    hand = recording.accelerations[:, SENSOR_BODIES.index(BODY_NAMES.index("hand_l"))]
    assert np.linalg.norm(hand, axis=1).max() > 5.0  # she beats time


def test_a_motion_source_prefers_the_file_with_accelerations(tmp_path: Path) -> None:
    write_mvnx_file(tmp_path, mvnx_text(THREE))
    (tmp_path / "clip.bvh").write_text("whatever")
    (one,) = load_source_motions(tmp_path)
    assert find_motion_files(tmp_path) == [tmp_path / "clip.mvnx"]
    assert (one.clip.name, one.clip.system, one.clip.fps) == ("clip", "imu", 60.0)
    # Three frames at 50 fps last 0.04 s: frames 0, 1, 2 at 60 fps, which end at 0.033 s, and samples 0 to 3 at 100 Hz.
    assert len(one.clip) == 3
    assert one.accelerations is not None
    assert one.accelerations.shape == (4, 19, 3)
