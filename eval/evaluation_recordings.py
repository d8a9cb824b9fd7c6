"""Names of the recordings that studies and benchmarks use, below a folder of real motion."""

from collections.abc import Iterable
from pathlib import Path

from configs.errors import InputError

_BANDAI = "noncommercial/bandai/test/bnr_dataset-2_"
TEST_CLIPS = {  # of performers that no training saw, by kind of motion
    "walk": (f"{_BANDAI}walk_youthful_001.bvh", f"{_BANDAI}walk_feminine_001.bvh", "cmu/test/cmu_05_01_mh165.bvh"),
    "turn": (f"{_BANDAI}walk-turn-left_youthful_001.bvh", f"{_BANDAI}walk-turn-right_feminine_001.bvh"),
    "run": (f"{_BANDAI}run_youthful_001.bvh", f"{_BANDAI}run_feminine_001.bvh"),
    "dance": ("cmu/test/cmu_salsa_16.bvh", "cmu/test/cmu_05_12.bvh"),
    "jump": ("cmu/test/cmu_01_01.bvh",),
    "stand": (f"{_BANDAI}wave-both-hands_youthful_001.bvh", f"{_BANDAI}wave-left-hand_feminine_001.bvh"),
}

TRAIN_FOLDER = "cmu/train"
IMU_SUIT_CLIPS = (
    "mit/imu/rokoko_jesse_dance.bvh",
    "apache/imu/pn_milad.bvh",
    "gpl/imu/xsens_andres_test_mocap.bvh",
    "gpl/imu/xsens_neura_S02_walk1.bvh",
)
SENSOR_WALK_FOLDER = "gpl/imu/neura_S02_walk1"
OPTICAL_WALK_FRAMES = slice(1119, 2074)  # of the walk, those with an optical truth by Vicon
WALK_SENSORS = {  # of the walk, by our body: end of the sensor file's name, Vicon's columns
    "pelvis": ("000_00B40B91", "qRPV"),
    "thigh_l": ("000_00B40C45", "qLTH"),
    "thigh_r": ("000_00B40C3C", "qRTH"),
    "shin_l": ("000_00B40C44", "qLSK"),
    "shin_r": ("000_00B40C47", "qRSK"),
    "foot_l": ("000_00B40C55", "qLFT"),
    "foot_r": ("000_00B40C48", "qRFT"),
}

TEST_FOLDERS = ("cmu/test", "noncommercial/bandai/test")
OPTICAL_POSES, IMU_POSES = "optical", "imu"
RESTORED_POSES = "restored"  # a suit's, after the restoring stage of cleaning


def check_recordings(data: Path, names: Iterable[str]) -> None:
    """Raise an InputError for the first of the files or folders that is not in the folder of real motion."""
    for name in names:
        if not (data / name).exists():
            raise InputError(f"{data / name}: no such recording; the study needs it, --data names the folder of real motion")
