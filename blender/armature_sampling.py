"""The evaluated poses of an armature over the frames of its action, read in a scene of its own, so that the user's does not move."""

import time
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import bpy  # type: ignore[import-not-found]  # Blender's own module
import numpy as np

from .addon_error import AddonError
from .bvh_motion import ArmatureMotion

MIN_FRAMES = 2
MODES = ("OBJECT", "POSE")  # of an armature that can be cleaned
MAX_SCALE_RATIO = 1.01  # of the scales along an armature's axes, up to which it is scaled alike
SCENE_NAME = "adapt-mimic sampling"
OF_BONES = "pose.bones["


def check_armature(armature: Any) -> None:
    """Raise AddonError unless an armature has an action of its own to clean, and its poses are what the action says."""
    name = f"'{armature.name}'"
    animation = armature.animation_data
    if not animation or not animation.action or not animation.action_slot:
        raise AddonError(f"{name} has no action; choose one in the Action Editor (an NLA strip has to be baked to one first)")
    if animation.use_tweak_mode:
        raise AddonError(f"{name} is in tweak mode of an NLA strip; leave it (Tab in the NLA Editor)")
    if animation.action_blend_type != "REPLACE" or animation.action_influence < 1.0:
        raise AddonError(
            f"The action of {name} is blended over NLA strips; bake the two to one action first (Pose > Animation > Bake Action)"
        )
    if armature.data.pose_position == "REST":
        raise AddonError(f"{name} is shown in its rest position; choose Pose Position in the armature's properties")
    if armature.library or animation.action.library:
        raise AddonError(f"{name} or its action is linked from another file; make it local first (Object > Relations > Make Local)")
    scales = np.linalg.norm(np.array(armature.matrix_world)[:3, :3], axis=0)
    if armature.matrix_world.determinant() <= 0.0 or scales.max() > MAX_SCALE_RATIO * scales.min():
        raise AddonError(f"{name} is mirrored, or scaled unlike along its axes; apply its scale first (Ctrl-A, Scale)")


def pose_curves(animation: Any) -> list[Any]:
    """Return the F-curves of bones in the slot of its action that an armature uses."""
    bags = slot_bags(animation.action, animation.action_slot)
    return [curve for bag in bags for curve in bag.fcurves if curve.data_path.startswith(OF_BONES)]


def slot_bags(action: Any, slot: Any) -> list[Any]:
    """Return the containers of a slot's F-curves."""
    bags = [strip.channelbag(slot) for layer in action.layers for strip in layer.strips if strip.type == "KEYFRAME"]
    return [bag for bag in bags if bag]


def frame_span(animation: Any) -> tuple[int, int]:
    """Return the first and the last whole frame of an armature's action: its manual range, or from the first key of a bone to the last."""
    action = animation.action
    if action.use_frame_range:
        first, last = action.frame_start, action.frame_end
    else:
        spans = [curve.range() for curve in pose_curves(animation) if len(curve.keyframe_points)]
        if not spans:
            raise AddonError(f"The action '{action.name}' moves no bone; choose the action with the motion")
        first, last = min(span[0] for span in spans), max(span[1] for span in spans)
    begin, end = int(np.floor(first + 1e-3)), int(np.ceil(last - 1e-3))
    if end - begin + 1 < MIN_FRAMES:
        raise AddonError(f"The action '{action.name}' is a single pose; at least {MIN_FRAMES} frames are needed")
    return begin, end


def depth_first(armature: Any) -> list[Any]:
    """Return the bones that deform, and all above them, each followed by all below it; every bone where none deforms."""
    wanted = {bone.name for bone in armature.data.bones if bone.use_deform} or set(armature.data.bones.keys())
    wanted |= {above.name for name in tuple(wanted) for above in armature.data.bones[name].parent_recursive}
    found, waiting = [], [bone for bone in reversed(armature.pose.bones) if bone.parent is None]
    while waiting:
        bone = waiting.pop()
        if bone.name in wanted:
            found.append(bone)
        waiting.extend(reversed(bone.children))
    return found


def held_bones(armature: Any) -> set[str]:
    """Return the names of the bones whose poses constraints or drivers decide on, and not their own keys alone."""
    held = {bone.name for bone in armature.pose.bones if active_constraints(bone)}
    for bone in armature.pose.bones:
        for constraint in active_constraints(bone):
            if constraint.type in ("IK", "SPLINE_IK"):  # which moves bones above it, too
                held |= {above.name for above in bone.parent_recursive[: constraint.chain_count - 1 if constraint.chain_count else None]}
    drivers = armature.animation_data.drivers if armature.animation_data else ()
    return held | {driver.data_path.split('"')[1] for driver in drivers if driver.data_path.startswith(OF_BONES)}


def following_bones(armature: Any) -> dict[str, str]:
    """Return the bones that deform and go where another does, by the name of that other, as those of a rig follow its controls."""
    found: dict[str, str] = {}
    for bone in armature.pose.bones:
        for constraint in active_constraints(bone) if bone.bone.use_deform else ():
            if (
                constraint.type == "COPY_TRANSFORMS"
                and constraint.target == armature
                and not armature.data.bones[constraint.subtarget].use_deform
            ):
                found.setdefault(constraint.subtarget, bone.name)
    return found


def active_constraints(bone: Any) -> list[Any]:
    """Return the constraints of a pose bone that do something."""
    return [constraint for constraint in bone.constraints if not constraint.mute and constraint.influence > 0.0]


@contextmanager
def sampling_scene(armature: Any) -> Iterator[Any]:
    """Yield a scene with nothing in it but an armature; what the armature depends on is evaluated with it."""
    scene = bpy.data.scenes.new(SCENE_NAME)
    try:
        render = bpy.context.scene.render
        scene.render.fps, scene.render.fps_base = render.fps, render.fps_base
        scene.collection.objects.link(armature)
        yield scene
    finally:
        bpy.data.scenes.remove(scene)


def sample_frames(armature: Any, names: list[str], frames: Sequence[int], seconds: float = float("inf")) -> tuple[np.ndarray, np.ndarray]:
    """Return the evaluated poses of bones in the armature's space, and the armature's in the world.

    Args:
        armature: The armature.
        names: Names of B bones.
        frames: Frames of the scene.
        seconds: Time after which no other frame is begun [s].

    Returns:
        Poses (T, B, 4, 4) and places (T, 4, 4) of as many of the frames as there was time for, of one at least.
    """
    place = {name: index for index, name in enumerate(armature.pose.bones.keys())}
    order, flat = [place[name] for name in names], np.empty(len(place) * 16, dtype=np.float32)
    poses, places, end = [], [], time.monotonic() + seconds
    with sampling_scene(armature) as scene:
        for frame in frames:
            scene.frame_set(frame)
            evaluated = armature.evaluated_get(scene.view_layers[0].depsgraph)
            evaluated.pose.bones.foreach_get("matrix", flat)
            poses.append(flat.reshape(-1, 4, 4)[order].swapaxes(-1, -2))  # Blender's flat matrices are column by column
            places.append(np.array(evaluated.matrix_world))
            if time.monotonic() > end:
                break
    return np.array(poses), np.array(places)


def sample_motion(armature: Any, seconds: float) -> Generator[float, None, ArmatureMotion]:
    """Sample an armature's motion at its scene's frame rate over its action; yield again and again the share that is done.

    Args:
        armature: Object that ``check_armature`` passed.
        seconds: Time between two moments at which the user may do something else [s].
    """
    bones, render = depth_first(armature), bpy.context.scene.render
    names, uid = [bone.name for bone in bones], armature.session_uid
    held, deform = held_bones(armature), any(bone.use_deform for bone in armature.data.bones)
    followers = {} if not deform else following_bones(armature)
    first, last = frame_span(armature.animation_data)
    told = {
        "armature": armature.name,
        "names": tuple(names),
        "parents": tuple(names.index(bone.parent.name) if bone.parent else -1 for bone in bones),
        "is_joint": np.array([bone.bone.use_deform or not deform for bone in bones]),
        "stands_for": tuple(names.index(joint) if (joint := followers.get(name)) in names else -1 for name in names),
        "held": np.array([bone.name in held for bone in bones]),
        "rest": np.array([bone.bone.matrix_local for bone in bones]),
        "tails": np.array([bone.bone.tail_local for bone in bones]),
        "fps": render.fps / render.fps_base,
        "first_frame": first,
    }
    parts, frame = [], first
    while frame <= last:
        parts.append(sample_frames(find_armature(uid), names, range(frame, last + 1), seconds))
        frame += len(parts[-1][0])
        yield (frame - first) / (last + 1 - first)
    poses, places = (np.concatenate(tables) for tables in zip(*parts, strict=True))
    return ArmatureMotion(poses=poses, places=places, **told)


def find_armature(uid: int) -> Any:
    """Return an armature by its session_uid: undo makes every object anew, so that none is kept while the user may do something.

    Raises:
        AddonError: If it is not there, or is being edited.
    """
    armature = next((one for one in bpy.data.objects if one.session_uid == uid), None)
    if armature is None:
        raise AddonError("The armature is no longer there; it was removed while it was cleaned")
    if armature.mode not in MODES:
        raise AddonError(f"'{armature.name}' was put into edit mode while it was cleaned; clean it in Object or Pose Mode")
    return armature
