"""A cleaned motion as a new action beside the old one: keys in every frame of the bones that move otherwise, all else as it was."""

from collections.abc import Generator, Iterator
from typing import Any

import bpy  # type: ignore[import-not-found]  # Blender's own module
import numpy as np
from mathutils import Euler, Matrix, Vector  # type: ignore[import-not-found]  # comes with Blender

from .armature_sampling import active_constraints, find_armature, slot_bags
from .bvh_motion import ArmatureMotion
from .rotations import nearest_rotations

FRAMES_AT_ONCE = 200  # between two moments at which the user may do something else
LINEAR = 1  # Blender's number of the interpolation
MAX_PLACE_RATIO = 1e-5  # of the skeleton's extent, up to which a bone's location is as it was
MAX_SCALE_CHANGE = 1e-5  # up to which a bone's scale is as it was
SUFFIX = " clean"

BoneKeys = dict[str, np.ndarray]  # property of a pose bone -> its values (T, 1 to 4)


def bone_keys(
    uid: int, motion: ArmatureMotion, poses: np.ndarray, bone: int, share: float
) -> Generator[float, None, tuple[BoneKeys, np.ndarray]]:
    """Return the keys of a pose bone, and where they put it in the armature's space, shape (T, 4, 4).

    Its rotation is keyed in its own rotation mode, and its location and scale where they are not what they are without keys.

    Args:
        uid: The armature's session_uid.
        motion: Its motion as recorded.
        poses: New poses of all bones in the armature's space, of those above it as they will be, shape (T, B, 4, 4).
        bone: Index of the bone.
        share: What is yielded between two moments at which the user may do something else.
    """
    armature, name = find_armature(uid), motion.names[bone]
    pose_bone = armature.pose.bones[name]
    mode, place_now, scale_now = pose_bone.rotation_mode, np.array(pose_bone.location), np.array(pose_bone.scale)
    connected = pose_bone.bone.use_connect and motion.parents[bone] >= 0  # to its parent's end, so that it has no location
    located = _has_curves(armature, pose_bone, "location")
    wanted = _scaled_alike(poses[:, bone]) if motion.held[bone] else poses[:, bone]
    above = poses[:, motion.parents[bone]].tolist() if motion.parents[bone] >= 0 else None
    local = yield from _converted(uid, name, above, list(map(Matrix, wanted.tolist())), True, share)
    bases = [basis.decompose() for basis in local]
    keys = _rotation_keys([turn for _, turn, _ in bases], mode)
    places, scales = np.array([place for place, _, _ in bases]), np.array([scale for _, _, scale in bases])
    extent = float(np.ptp(motion.rest[:, :3, 3], axis=0).max())
    if not connected and (located or np.abs(places - place_now).max() > MAX_PLACE_RATIO * extent):
        keys["location"] = places
    if motion.held[bone] and np.abs(scales - scale_now).max() > MAX_SCALE_CHANGE:  # stretched by a constraint
        keys["scale"] = scales
    still = Vector((0.0, 0.0, 0.0)) if connected else None
    composed = [Matrix.LocRotScale(still or place, turn, scale) for place, turn, scale in bases]
    real = yield from _converted(uid, name, above, composed, False, share)
    return keys, np.array(real)


def _scaled_alike(poses: np.ndarray) -> np.ndarray:
    """Return poses (T, 4, 4) scaled everywhere as along the bone: stretched, it would shear those below it, which no key can say."""
    alike, lengths = poses.copy(), np.linalg.norm(poses[:, None, :3, 1], axis=-1, keepdims=True)
    alike[:, :3, :3] = nearest_rotations(poses[:, :3, [1, 2, 0]])[:, :, [2, 0, 1]] * lengths
    return alike


def _converted(
    uid: int, name: str, parents: list | None, matrices: list[Any], invert: bool, share: float
) -> Generator[float, None, list[Any]]:
    """Return a bone's matrices of all frames from its own space to the armature's, or back if ``invert``; yield ``share`` now and then.

    Args:
        uid: The armature's session_uid; undo makes the bone anew, so that it is looked up after each moment of the user's.
        name: Name of the bone.
        parents: Poses of its parent in the armature's space, None without one.
        matrices: The matrices.
        invert: Whether they are the armature's.
        share: What is yielded.
    """
    found = []
    for start in range(0, len(matrices), FRAMES_AT_ONCE):
        bone = find_armature(uid).data.bones[name]
        for frame in range(start, min(start + FRAMES_AT_ONCE, len(matrices))):
            parent = {"parent_matrix": Matrix(parents[frame]), "parent_matrix_local": bone.parent.matrix_local} if parents else {}
            found.append(bone.convert_local_to_pose(matrices[frame], bone.matrix_local, invert=invert, **parent))
        yield share
    return found


def _rotation_keys(turns: list[Any], mode: str) -> BoneKeys:
    """Return rotations, quaternions of Blender's, as keys of a rotation mode that do not jump from one turn to the next."""
    if mode == "QUATERNION":
        values = np.array(turns)
        values[1:] *= _signs(values)
        return {"rotation_quaternion": values}
    if mode == "AXIS_ANGLE":
        values = np.array(turns)
        values[1:] *= _signs(values)
        halves = np.linalg.norm(values[:, 1:], axis=1)
        still = halves < 1e-9
        axes = np.where(still[:, None], (0.0, 1.0, 0.0), values[:, 1:] / np.maximum(halves, 1e-30)[:, None])
        angles = 2.0 * np.arctan2(halves, values[:, 0])
        flips = np.where(np.sum(axes[1:] * axes[:-1], axis=1) < 0.0, -1.0, 1.0)
        signs = np.concatenate([[1.0], np.cumprod(flips)])
        return {"rotation_axis_angle": np.column_stack([np.unwrap(signs * angles), signs[:, None] * axes])}
    angles, last = [], Euler((0.0, 0.0, 0.0), mode)
    for turn in turns:
        last = turn.to_euler(mode, last)
        angles.append(tuple(last))
    return {"rotation_euler": np.array(angles)}


def _signs(quaternions: np.ndarray) -> np.ndarray:
    """Return the signs (T - 1, 1) that keep quaternions from jumping: one and its negative are one rotation, but not between two keys."""
    return np.cumprod(np.where(np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0.0, -1.0, 1.0))[:, None]


def all_bone_keys(uid: int, motion: ArmatureMotion, poses: np.ndarray, keyed: np.ndarray) -> Generator[float, None, dict[str, BoneKeys]]:
    """Return the keys of all bones that are keyed, by their names; yield again and again the share that is done.

    What a bone's rotation, location and scale cannot say, as shear, is no fault of the bones below it: they start from where it really is.
    """
    found, real = {}, poses.copy()
    for bone in range(len(motion.names)):
        parent = motion.parents[bone]
        if keyed[bone]:
            share = len(found) / keyed.sum()
            found[motion.names[bone]], real[:, bone] = yield from bone_keys(uid, motion, real, bone, share)
            yield share
        elif parent >= 0 and not motion.held[bone]:
            real[:, bone] = real[:, parent] @ np.linalg.inv(poses[:, parent]) @ poses[:, bone]
    return found


def add_action(armature: Any, first_frame: int, keys: dict[str, BoneKeys]) -> Any:
    """Give an armature a copy of its action in which some bones have keys of their own in every frame; return it.

    The old action stays as it is, and in the file. Constraints of bones that are keyed have no influence in the new one.
    """
    animation = armature.animation_data
    old, slot = animation.action, animation.action_slot
    new = old.copy()
    new.name = f"{old.name}{SUFFIX}"
    old.use_fake_user = True
    new_slot = new.slots[slot.identifier]
    for name, properties in keys.items():
        path = armature.pose.bones[name].path_from_id()
        for kind, values in properties.items():
            _replace_curves(new, new_slot, name, f"{path}.{kind}", first_frame, values)
        for constraint in active_constraints(armature.pose.bones[name]):
            influence = constraint.path_from_id("influence")
            _replace_curves(new, new_slot, name, influence, first_frame, np.zeros((1, 1)))
    animation.action, animation.action_slot = new, new_slot
    return new


def _has_curves(armature: Any, pose_bone: Any, kind: str) -> bool:
    """Return whether a property of a pose bone is animated in the armature's action."""
    animation, path = armature.animation_data, pose_bone.path_from_id(kind)
    bags = slot_bags(animation.action, animation.action_slot) if animation and animation.action else []
    return any(bag.fcurves.find(path, index=axis) for bag in bags for axis in range(3))


def _replace_curves(action: Any, slot: Any, bone: str, path: str, first_frame: int, values: np.ndarray) -> None:
    """Replace the F-curves of a bone's property by keys at consecutive frames, values (T, k); the group stays."""
    bags, group = slot_bags(action, slot), bone
    for bag, curve in list(_curves_of(bags, path)):
        group = curve.group.name if curve.group else bone
        bag.fcurves.remove(curve)
    times = first_frame + np.arange(len(values))
    for axis in range(values.shape[1]):
        curve = bags[0].fcurves.new(path, index=axis)
        curve.group = bags[0].groups.get(group) or bags[0].groups.new(group)
        curve.keyframe_points.add(len(times))
        curve.keyframe_points.foreach_set("co", np.stack([times, values[:, axis]], axis=1).astype(np.float32).ravel())
        curve.keyframe_points.foreach_set("interpolation", np.full(len(times), LINEAR, dtype=np.int32))
        curve.update()


def _curves_of(bags: list[Any], path: str) -> Iterator[tuple[Any, Any]]:
    return ((bag, curve) for bag in bags for curve in bag.fcurves if curve.data_path == path)


def set_markers(action: Any, markers: list[tuple[int, str]], ours: frozenset[str]) -> None:
    """Put markers, each a frame and a name, on an action, instead of those that an earlier cleaning left there.

    Args:
        action: The action.
        markers: Frames and names.
        ours: Names of all markers that a cleaning makes.
    """
    for marker in [marker for marker in action.pose_markers if marker.name in ours]:
        action.pose_markers.remove(marker)
    for frame, name in markers:
        action.pose_markers.new(name).frame = frame


def update_view() -> None:
    """Have Blender evaluate the scene with what was changed."""
    bpy.context.view_layer.update()
