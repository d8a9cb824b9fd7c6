"""Real walk with truth: measured accelerations of seven segments, the suit's own pose, and Vicon's path of the pelvis.

9.55 s, 7.7 m there and back in a straight line. Facts about the recording (checked by the tests):

- Frames of the suit's BVH file and of the raw sensors that have the same number are the same instant to half a frame, but Vicon's
  frame is that of two frames later: so the second differences of its points agree best with the sensors.
- Gravity is in ``acc``. Each sensor's world is upright but has a north of its own, 49 degrees off above the left ankle. ``calib/``
  turns pelvis, ankles and feet into Vicon's world, and Vicon's second differences say the same to 2 degrees. Thighs are not listed
  there: they take over the pelvis' correction, 2 (left) and 6 (right) degrees from what Vicon would say.
- Either shin has two sensors, below the knee and above the ankle. Acceleration varies linearly along a rigid bone, so that their mean
  is that of the shin's middle, where our sensor sits; the upper one's north is found from the turning rate that they share.
- The suit's pose goes crabwise: its ankles swing to 14 (left) and 28 (right) degrees on the right of where its pelvis faces, and so
  runs its path; Vicon's go straight ahead. Headings are made equal at the pelvis, so that this counts as the suit's error;
  ``align_heading`` takes away what of an error is heading alone.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from configs.errors import InputError
from datasets.imu.free_acceleration import PELVIS_BODY, fill_accelerations
from datasets.imu.sensor_model import GRAVITY_VECTOR_M_S2, SENSOR_BODIES
from datasets.imu.suit_simulation import track_root
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, SKELETON
from datasets.motion.rotation import from_yaw, heading, rotate
from datasets.performer.performer_clip import load_performer_clip
from datasets.retarget.retarget import retarget
from eval.evaluation_recordings import IMU_SUIT_CLIPS, OPTICAL_WALK_FRAMES, SENSOR_WALK_FOLDER, WALK_SENSORS

VICON_LEAD_FRAMES = 2  # by which Vicon's frames are ahead of the suit's
UPPER_SHINS = {"shin_l": "000_00B40BA5", "shin_r": "000_00B40C35"}  # sensors below the knee; those of WALK_SENSORS are at the ankle
CALIBRATION_SEGMENTS = {"pelvis": "Pelvis", "shin_l": "L_LowLeg", "shin_r": "R_LowLeg", "foot_l": "L_Foot", "foot_r": "R_Foot"}
RAW_SENSOR_FILE = "rawimu/S02-Trial-Walk-1-{}.txt"
VICON_FILE = "vicon/S02-Trial-Walk-1.csv"
YAW_CORRECTION_FILE = "calib/S02-Trial-Walk-1-Calib-SensorYawFixWorldFrame.txt"
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class RealWalk:
    """Real walk at 100 Hz, on the humanoid's bodies.

    Attributes:
        motion: Retargeted pose and root of the suit; 955 frames.
        accelerations: Free accelerations in the world's axes and the size of ``motion`` [m/s^2], shape (955, 19, 3).
        truth: Vicon's path of the pelvis' origin, turned so that the pelvis faces where the motion's does on average, in the
            size of ``motion``, from the motion's first place on [m], shape (955, 3).
        measured_bodies: Names of the bodies that carried sensors; ``fill_accelerations`` made the others.
    """

    motion: BodyMotion
    accelerations: np.ndarray
    truth: np.ndarray
    measured_bodies: tuple[str, ...]


def load_real_walk(data: Path) -> RealWalk:
    """Return the walk.

    Args:
        data: Folder of real motion.

    Raises:
        InputError: If a file of the recording is not there.
    """
    folder, clip_file = data / SENSOR_WALK_FOLDER, data / IMU_SUIT_CLIPS[-1]
    for file in (clip_file, folder / VICON_FILE, folder / YAW_CORRECTION_FILE):
        if not file.is_file():
            raise InputError(f"{file}: no such file; the recording of the real walk belongs there")
    clip = retarget(load_performer_clip(clip_file))
    first = OPTICAL_WALK_FRAMES.start + VICON_LEAD_FRAMES
    last = first + OPTICAL_WALK_FRAMES.stop - OPTICAL_WALK_FRAMES.start
    motion = clip.motion.cut(first - clip.performer_clip.dropped_frames, last - clip.performer_clip.dropped_frames)
    motion = replace(motion, performer="NEURA-S02", system="imu", kind="walk")
    vicon = _vicon(folder / VICON_FILE)
    yaw = _yaw_to_motion(vicon, motion)
    free = {body: _turned(_measured(folder, body, slice(first, last)), yaw) * clip.scale for body in WALK_SENSORS}
    path = clip.scale * _turned(0.5 * (vicon["LFEP"] + vicon["RFEP"]), yaw)
    path -= SKELETON.offsets[BODY_NAMES.index("thigh_l")] * _UP  # our hips are below the pelvis' origin
    accelerations = fill_accelerations(motion, {BODY_NAMES.index(body): track for body, track in free.items()})
    measured = tuple(BODY_NAMES[body] for body in SENSOR_BODIES if BODY_NAMES[body] in WALK_SENSORS)
    return RealWalk(motion, accelerations, path - path[0] + motion.root_position[0], measured)


def load_vicon_points(data: Path) -> dict[str, np.ndarray]:
    """Return Vicon's points of the walk by name, such as "LFEO" for the left knee, in metres and Vicon's world, each of shape (955, 3)."""
    return _vicon(data / SENSOR_WALK_FOLDER / VICON_FILE)


def track_root_by_contacts(walk: RealWalk) -> np.ndarray:
    """Return the path (T, 3) [m] from standing feet and the pelvis' acceleration between steps, from the motion's first place on."""
    path = track_root(walk.motion.local_rotations, walk.accelerations[:, SENSOR_BODIES.index(PELVIS_BODY)], 1.0)
    return path - path[0] + walk.motion.root_position[0]


def align_heading(path: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return the path turned about the vertical through its first place so that it is nearest to the truth, both (T, 3) [m]."""
    mine, other = path[:, :2] - path[0, :2], truth[:, :2] - truth[0, :2]
    return path[0] + _turned(path - path[0], _yaw_between(mine, other))


def _turned(vectors: np.ndarray, yaw: float) -> np.ndarray:
    """Return vectors (T, 3) turned by ``yaw`` [rad] about the vertical."""
    return rotate(np.broadcast_to(from_yaw(np.array(yaw)), (len(vectors), 4)), vectors)


def _yaw_between(a: np.ndarray, b: np.ndarray) -> float:
    """Return the angle [rad] about the vertical that brings vectors ``a`` (T, 2 or 3) nearest to ``b``, by least squares."""
    return float(np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a[:, :2] * b[:, :2])))


def _yaw_to_motion(vicon: dict[str, np.ndarray], motion: BodyMotion) -> float:
    """Return the angle [rad] from Vicon's world to the motion's, by where the pelvis faces on average."""
    faces = heading(motion.local_rotations[:, PELVIS_BODY])
    across = vicon["LFEP"] - vicon["RFEP"]
    forward = np.stack([across[:, 1], -across[:, 0]], axis=1)
    return _yaw_between(forward, np.linalg.norm(forward, axis=1)[:, None] * np.stack([np.cos(faces), np.sin(faces)], axis=1))


def _vicon(file: Path) -> dict[str, np.ndarray]:
    """Return Vicon's points by name, in metres, each of shape (T, 3)."""
    lines = [line for line in file.read_text().splitlines() if not line.startswith("//")]
    table = np.array([line.split(",") for line in lines[1:]], dtype=float)
    return {name.removesuffix("_1"): table[:, at : at + 3] for at, name in enumerate(lines[0].split(",")) if name.endswith("_1")}


def _measured(folder: Path, body: str, frames: slice) -> np.ndarray:
    """Return the free acceleration (T, 3) [m/s^2] of a segment in Vicon's world."""
    corrections = _north_corrections(folder / YAW_CORRECTION_FILE)
    north = corrections[CALIBRATION_SEGMENTS.get(body, "Pelvis")]
    free, turns = _sensor(folder, WALK_SENSORS[body][0], frames)
    if body in UPPER_SHINS:
        upper, upper_turns = _sensor(folder, UPPER_SHINS[body], frames)
        free = 0.5 * (free + _turned(upper, _yaw_between(upper_turns, turns)))
    return _turned(free, north)


def _sensor(folder: Path, sensor: str, frames: slice) -> tuple[np.ndarray, np.ndarray]:
    """Return free acceleration [m/s^2] and turning rate [rad/s] of a sensor in its own world, each of shape (T, 3)."""
    file = folder / RAW_SENSOR_FILE.format(sensor)
    if not file.is_file():
        raise InputError(f"{file}: no such file; the recording of the real walk belongs there")
    raw = np.genfromtxt(file, delimiter=",", skip_header=6)[frames]
    return rotate(raw[:, 11:15], raw[:, 2:5]) + GRAVITY_VECTOR_M_S2, rotate(raw[:, 11:15], raw[:, 5:8])


def _north_corrections(file: Path) -> dict[str, float]:
    """Return the rotation about the vertical from each listed sensor's world to Vicon's [rad]."""
    rows = [line.split(",") for line in file.read_text().splitlines()[1:]]
    return {name: 2.0 * float(np.arctan2(float(z), float(w))) for name, w, _, _, z in rows}
