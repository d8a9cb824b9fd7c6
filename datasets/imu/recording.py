"""Recordings of real IMU suits: the clip on the 20 bodies, and free accelerations rotated and scaled with it."""

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from configs.errors import InputError
from datasets.formats.bvh import Bvh
from datasets.imu.free_acceleration import PELVIS_BODY, fill_accelerations
from datasets.imu.sensor_model import SENSOR_BODIES, SENSOR_RATE_HZ
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.rotation import from_yaw, rotate
from datasets.performer.file_axes import turn_points
from datasets.performer.performer_clip import load_recording
from datasets.performer.reading_options import ReadingOptions
from datasets.retarget.retarget import Retargeted, retarget


@dataclass(frozen=True)
class ImuRecording:
    """Clip of a suit and the free accelerations that it measured.

    Attributes:
        motion: Clip on the 20 bodies, at its own frame rate.
        accelerations: Free accelerations in the world's axes and the size of ``motion``, at 100 Hz whatever its rate [m/s^2],
            shape (N, 19, 3); the bodies are ``SENSOR_BODIES``, the first sample is the clip's first frame.
        measured: Names of the bodies that carried a sensor; the others' accelerations are from ``fill_accelerations``.
    """

    motion: BodyMotion
    accelerations: np.ndarray
    measured: tuple[str, ...]


def read_imu_recording(path: str | os.PathLike[str], reading: ReadingOptions | None = None) -> ImuRecording:
    """Read a suit's clip and accelerations: on the 20 bodies, scaled, facing x and on the ground.

    Args:
        path: File with free accelerations, such as MVNX.
        reading: Known joints of its segments; the others are detected.

    Returns:
        Clip, and accelerations rotated and scaled with it; bodies without a sensor get theirs from the pose.

    Raises:
        InputError: If the file is broken, or no human or no pelvis sensor is found in it.
    """
    bvh, performer_clip = load_recording(path, reading)
    retargeted = retarget(performer_clip)
    accelerations = measured_accelerations(bvh, retargeted, retargeted.motion)
    if accelerations is None:
        sensors = ", ".join(bvh.names[joint] for joint in bvh.stated.free_accelerations) or "none"
        raise InputError(f"{Path(path)}: no sensor on the pelvis among {sensors}; a suit's recording has one, with its free acceleration")
    known = _sensor_of_body(bvh, retargeted)
    measured = tuple(BODY_NAMES[body] for body in SENSOR_BODIES if body in known)
    return ImuRecording(replace(retargeted.motion, system="imu"), accelerations, measured)


def measured_accelerations(bvh: Bvh, retargeted: Retargeted, clip: BodyMotion) -> np.ndarray | None:
    """Return the free accelerations that a recording holds, of all sensor bodies; None without a sensor on the pelvis.

    Args:
        bvh: Contents of the file.
        retargeted: Its retargeted clip, whose rotation and scale the accelerations get.
        clip: The same clip at any rate, perhaps with corrected poses, from which bodies without a sensor get theirs.

    Returns:
        Accelerations in the world's axes at 100 Hz [m/s^2], shape (N, 19, 3), from the clip's first frame to its last.
    """
    known = _sensor_of_body(bvh, retargeted)
    if PELVIS_BODY not in known:
        return None
    old = np.arange(len(retargeted.motion)) / retargeted.motion.fps
    samples = int(np.floor((len(clip) - 1) / clip.fps * SENSOR_RATE_HZ + 1e-6)) + 1
    new = np.minimum(np.arange(samples) / SENSOR_RATE_HZ, old[-1])
    turn = np.broadcast_to(from_yaw(np.array(-retargeted.yaw)), (len(new), 4))
    axes, dropped = retargeted.performer_clip.axes, retargeted.performer_clip.dropped_frames
    tracks = {body: turn_points(axes, bvh.stated.free_accelerations[joint][dropped:]) for body, joint in known.items()}
    at_rate = {body: CubicSpline(old, track)(new) if len(old) > 1 else track for body, track in tracks.items()}
    return fill_accelerations(clip, {body: retargeted.scale * rotate(turn, track) for body, track in at_rate.items()})


def _sensor_of_body(bvh: Bvh, retargeted: Retargeted) -> dict[int, int]:
    """Return index of a body that may carry a sensor -> joint of the file whose sensor is on it."""
    clip = retargeted.performer_clip
    num_recorded = len(clip.motion.skeleton.names) - len(clip.edits.added)
    joints = {BODY_NAMES.index(body): clip.edits.file_joint(joint) for body, joint in clip.joint_map.items() if joint < num_recorded}
    return {body: joint for body, joint in joints.items() if body in SENSOR_BODIES and joint in bvh.stated.free_accelerations}
