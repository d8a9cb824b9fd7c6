"""Comparison of simulated with measured accelerations on the same poses: an Xsens MVNX clip and the walk beside Vicon."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from datasets.imu.recording import ImuRecording, read_imu_recording
from datasets.imu.sensor_model import SENSOR_BODIES
from datasets.imu.suit_simulation import simulate_suit
from datasets.motion.humanoid import BODY_NAMES
from eval.study.suit.vicon_walk import load_real_walk

MVNX = "gpl/imu/xsens_andres_test_mocap.mvnx"
AccelerationRow = dict[str, Any]


def compare_accelerations(data: Path, seed: int = 0) -> list[AccelerationRow]:
    """Return the difference of simulated from measured free accelerations, body by body, and over all bodies of a recording.

    Args:
        data: Folder of real motion.
        seed: Seed of the simulated suit.

    Returns:
        Rows of ``recording``, ``body``, ``real_rms``, ``simulated_rms``, ``difference_rms`` [m/s^2] and ``correlation``. The
        simulated suit performs the recording's own clip; the walk once on the suit's root and once on Vicon's, because second
        differences of a root that a suit tracked are rough.

    Raises:
        InputError: If a recording is not there.
    """
    walk = load_real_walk(data)
    truthful = replace(walk.motion, root_position=walk.truth)
    recordings = {
        "mvnx": read_imu_recording(data / MVNX),
        "walk, the suit's root": ImuRecording(walk.motion, walk.accelerations, walk.measured_bodies),
        "walk, Vicon's root": ImuRecording(truthful, walk.accelerations, walk.measured_bodies),
    }
    return [row for name, recording in recordings.items() for row in compare_recording(name, recording, seed)]


def compare_recording(name: str, recording: ImuRecording, seed: int) -> list[AccelerationRow]:
    """Return the rows of one recording; only bodies that carried a sensor are compared."""
    sensors = [SENSOR_BODIES.index(BODY_NAMES.index(body)) for body in recording.measured]
    real = recording.accelerations[:, sensors]
    simulated = simulate_suit(recording.motion, seed).accelerations[:, sensors]
    rows = [_row(name, body, real[:, at], simulated[:, at]) for at, body in enumerate(recording.measured)]
    return [*rows, _row(name, "all", real, simulated)]


def _row(recording: str, body: str, real: np.ndarray, simulated: np.ndarray) -> AccelerationRow:
    return {
        "recording": recording,
        "body": body,
        "real_rms": _rms(real),
        "simulated_rms": _rms(simulated),
        "difference_rms": _rms(simulated - real),
        "correlation": float(np.corrcoef(real.ravel(), simulated.ravel())[0, 1]),
    }


def _rms(vectors: np.ndarray) -> float:
    """Return the root of the mean squared length of vectors (..., 3)."""
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=-1))))
