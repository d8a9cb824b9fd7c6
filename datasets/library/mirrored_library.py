"""Library with every clip a second time, mirrored: left and right of the packed arrays are exchanged, nothing is computed anew."""

from dataclasses import replace

import numpy as np

from datasets.library.motion_library import MotionLibrary, table_parts
from datasets.motion.humanoid import HINGES
from datasets.motion.mirror import MIRRORED_AXIAL_VECTOR, MIRRORED_QUATERNION, MIRRORED_VECTOR, OTHER_SIDE, mirrored_name

_VECTOR, _AXIAL = (np.array(signs, dtype=np.float32) for signs in (MIRRORED_VECTOR, MIRRORED_AXIAL_VECTOR))
_MATRIX = np.outer(_VECTOR, _VECTOR)
_OTHER_HINGE = [HINGES.index((OTHER_SIDE[body], axis)) for body, axis in HINGES]
_HINGE_SIGNS = np.array([_AXIAL["xyz".index(axis)] for _, axis in HINGES])
_JOINTS = [body - 1 for body in OTHER_SIDE[1:]]


def with_mirrored_clips(library: MotionLibrary) -> MotionLibrary:
    """Return the library with the mirrored clips behind the clips.

    Args:
        library: NumPy library; of one with feed-forward angles these are mirrored as well.
    """
    arrays = library.arrays()
    mirrored = {
        "table": np.concat(
            [_mirrored_part(name, part).reshape(len(library), -1) for name, part in table_parts(library.table).items()], axis=1
        ),
        "start_pose": _mirrored_state(library.start_pose, [*_VECTOR, *MIRRORED_QUATERNION]),
        "start_vel": _mirrored_state(library.start_vel, [*_VECTOR, *_AXIAL]),
        "feed_forward": None if library.feed_forward is None else _mirrored_hinges(library.feed_forward),
    }
    clips = tuple(replace(clip, name=mirrored_name(clip.name), start=len(library) + clip.start) for clip in library.clips)
    both = {name: np.concat([array, mirrored[name]]) for name, array in arrays.items()}
    return MotionLibrary.from_arrays((*library.clips, *clips), both, library.fps)


def _mirrored_hinges(angles: np.ndarray) -> np.ndarray:
    """Return the angles or speeds of the hinges (F, 43), mirrored."""
    return angles[:, _OTHER_HINGE] * _HINGE_SIGNS


def _mirrored_state(states: np.ndarray, root_signs: list[float]) -> np.ndarray:
    """Return generalised positions or velocities, mirrored: the root's components change their signs, the hinges their sides."""
    root = len(root_signs)
    return np.concat([states[:, :root] * np.array(root_signs, dtype=np.float32), _mirrored_hinges(states[:, root:])], axis=1)


def _mirrored_part(name: str, part: np.ndarray) -> np.ndarray:
    """Return a part of the table by its name, mirrored."""
    match name:
        case "pos" | "lin_vel":
            return part[:, OTHER_SIDE] * _VECTOR
        case "com" | "com_vel" | "truth_root":
            return part * _VECTOR
        case "facing":
            return part * np.array([1.0, -1.0], dtype=np.float32)
        case "hinges" | "hinge_vel":
            return _mirrored_hinges(part)
        case "rewarded_pos" | "rewarded_lin_vel":
            return part[..., OTHER_SIDE] * _VECTOR[:, None]
        case "rewarded_rot" | "rewarded_axis_vel":
            return part[..., OTHER_SIDE] * _MATRIX[..., None]
        case "rewarded_local_rot":
            return part[..., _JOINTS] * _MATRIX[..., None]
        case _:
            raise ValueError(f"there is no mirror image of {name}")
