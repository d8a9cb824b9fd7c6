"""Recordings of real IMU suits from MVNX files: the clip on the 20 bodies, and free accelerations rotated and scaled with it."""

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from configs.errors import InputError
from datasets.formats.mvnx import Mvnx, read_mvnx
from datasets.imu.free_acceleration import PELVIS_BODY, fill_accelerations
from datasets.imu.sensor_model import SENSOR_BODIES, SENSOR_RATE_HZ
from datasets.motion.clip import BodyMotion, Motion
from datasets.motion.humanoid import BODY_NAMES, LEG_LENGTH
from datasets.motion.rotation import conjugate, from_yaw, multiply, rotate
from datasets.motion.skeleton import Skeleton
from datasets.retarget.joint_mapping import TIP_BODIES, JointMapping, find_joint_map
from datasets.retarget.performer_clip import MAX_LEG_RATIO, PerformerClip, leg_length, load_performer_bvh
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


def read_imu_recording(path: str | os.PathLike[str], mapping: JointMapping | None = None) -> ImuRecording:
    """Read a suit's clip and accelerations: on the 20 bodies, scaled, facing x and on the ground.

    Args:
        path: MVNX file.
        mapping: Known roles of its segments; the others are detected.

    Returns:
        Clip, and accelerations rotated and scaled with it; bodies without a sensor get theirs from the pose.

    Raises:
        InputError: If the file is broken, or no human or no pelvis sensor is found in it.
    """
    mvnx = read_mvnx(path)
    try:
        performer_clip = performer_clip_from_mvnx(mvnx, Path(path).stem, mapping)
        retargeted = retarget(performer_clip)
        known = _body_accelerations(mvnx, retargeted)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    motion = replace(retargeted.motion, system="imu")
    return ImuRecording(motion, fill_accelerations(motion, known), tuple(BODY_NAMES[body] for body in SENSOR_BODIES if body in known))


def load_performer_clip(path: Path, mapping: JointMapping | None = None) -> PerformerClip:
    """Return the clip of a BVH or MVNX file on its own skeleton; arguments and errors are those of ``load_performer_bvh``.

    An MVNX file holds one figure, whichever is asked for.
    """
    return (
        performer_clip_from_mvnx(read_mvnx(path), path.stem, mapping)
        if path.suffix.lower() == ".mvnx"
        else load_performer_bvh(path, mapping)
    )


def performer_clip_from_mvnx(mvnx: Mvnx, name: str, mapping: JointMapping | None = None) -> PerformerClip:
    """Return the clip of an MVNX file on its own skeleton.

    Args:
        mvnx: Contents of the file.
        name: Name of the clip.
        mapping: Known roles of its segments; the others are detected.

    Raises:
        InputError: If the segments are not a human's, in metres.
    """
    joint_map = find_joint_map(mvnx.segments, mvnx.parents, mapping)
    lacking = [body for body in TIP_BODIES if body not in joint_map]
    if lacking:
        raise InputError(f"no segment found for {', '.join(lacking)} among {', '.join(mvnx.segments)}; name them in a mapping file")
    over = list(mvnx.parents[1:])
    to_parent = conjugate(mvnx.orientations[:, over])
    local_positions, local_rotations = mvnx.positions.copy(), mvnx.orientations.copy()
    local_positions[:, 1:] = rotate(to_parent, mvnx.positions[:, 1:] - mvnx.positions[:, over])
    local_rotations[:, 1:] = multiply(to_parent, mvnx.orientations[:, 1:])
    offsets = np.concat([np.zeros((1, 3)), np.median(local_positions, axis=0)[1:]])
    leg = leg_length(mvnx.positions, joint_map)
    if not 1.0 / MAX_LEG_RATIO < leg / LEG_LENGTH < MAX_LEG_RATIO:
        raise InputError(f"legs of {leg:.3g} m are no human's; positions in metres are expected")
    short = [joint for joint in joint_map.values() if joint and not offsets[joint].any()]
    if short:
        raise InputError(f"segment '{mvnx.segments[short[0]]}' begins where its parent does; every segment should have a length")
    motion = Motion(Skeleton(mvnx.segments, mvnx.parents, offsets), local_positions, local_rotations, mvnx.fps, name)
    return PerformerClip(motion, joint_map, mvnx.end_offsets, 1.0, "z", 0)


def _body_accelerations(mvnx: Mvnx, retargeted: Retargeted) -> dict[int, np.ndarray]:
    """Return index of a body -> measured acceleration (N, 3) [m/s^2] at 100 Hz, rotated and scaled with the retargeted clip."""
    clip = retargeted.motion
    body_of = {joint: BODY_NAMES.index(body) for body, joint in retargeted.performer_clip.joint_map.items()}
    old = np.arange(len(clip)) / clip.fps
    new = np.minimum(np.arange(int(np.floor(old[-1] * SENSOR_RATE_HZ + 1e-6)) + 1) / SENSOR_RATE_HZ, old[-1])
    turn = from_yaw(np.array(-retargeted.yaw))
    known = {}
    for sensor, segment in enumerate(mvnx.sensors):
        body = body_of.get(mvnx.segments.index(segment))
        if body in SENSOR_BODIES:
            track = mvnx.free_accelerations[:, sensor]
            at_rate = CubicSpline(old, track)(new) if len(old) > 1 else track
            known[body] = retargeted.scale * rotate(np.broadcast_to(turn, (len(new), 4)), at_rate)
    if PELVIS_BODY not in known:
        raise InputError(f"no sensor on the pelvis among {', '.join(mvnx.sensors) or 'none'}; a suit's recording has one")
    return known
