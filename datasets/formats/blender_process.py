"""Script for a Python with Blender in it: hands an armature's motion over, writes one into a copy of its scene, or into a new scene.

It runs in a process of its own and imports nothing of this project, which never imports Blender (GPL): they exchange files. Units are
Blender's: metres, Z up; frames may be fractions, of the scene's rate at import. J bones, T frames.

    python blender_process.py read SCENE RESULT.npz FIGURE
    python blender_process.py write SCENE POSES.npz FIGURE OUT
    python blender_process.py make POSES.npz OUT
    python blender_process.py find

Exit codes: 0 done, 3 no Blender here, 4 failed; of the latter two lines in ``error.txt`` in the working directory say whose fault and why.
"""

import json
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

NO_BLENDER, FAILED = 3, 4
DEFAULT_FPS = 30  # 1/s, of glTF, which states no rate, where keys are sparse
MIN_FBX_VERSION = 7100  # of those that Blender's importer of all animation reads
MIN_KEY_FPS, MAX_KEY_FPS = 20.0, 1000.0  # 1/s, lowest and highest rate of keys that are a recording's frames; fewer are an animator's
MIN_KEYS = 10  # fewer say nothing of a rate
MAX_KEY_JITTER = 0.02  # of the distance of two keys
MIN_REGULAR_SHARE = 0.9  # of the distances between keys, of a recording
MIN_KEY_DISTANCE = 1e-3  # frames
MIN_CHANGE = 1e-4  # of a curve that moves a bone
MIN_MOVING_SHARE = 0.5  # of the bones that move in the liveliest animation of a figure, in another that counts
MAX_BONES, MAX_POSES = 1000, 10_000_000  # bones; bones times frames
MAX_VERTICES = 400_000  # of a mesh that is handed over; 100,000 take half a second
INFLUENCES = 4  # bones that move a vertex, the heaviest
MAX_MEMORY_BYTES = 16 * 2**30  # that the process may address
LINEAR = 1  # Blender's number of the interpolation
MADE_ARMATURE = "Armature"  # of a made scene: Unreal does not take a node of this name for a bone
FBX_UNIT = 0.01  # m, of a made FBX
DRAWN_WIDTH, DRAWN_CORNERS_AT = 0.1, 0.2  # half the width of a drawn bone and where it is widest, of its length


class SceneError(Exception):
    """Scene that cannot be used; the message says why in one line."""


def import_scene(bpy: Any, path: Path) -> float:
    """Make the file the only contents of Blender; return how many of the frames in which its keys are placed make a second."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    render = bpy.context.scene.render
    render.fps = DEFAULT_FPS
    if path.suffix.lower() != ".fbx":
        bpy.ops.import_scene.gltf(filepath=str(path), bone_heuristic="BLENDER", disable_bone_shape=True)  # bones as they are written back
    elif has_current_encoding(path):
        bpy.ops.import_scene.fbx(filepath=str(path), use_image_search=False)
    else:
        bpy.ops.wm.fbx_import(filepath=str(path))  # reads any FBX, but no animation of what is no armature
        return render.fps / render.fps_base
    return render.fps


def has_current_encoding(path: Path) -> bool:
    """Return whether an FBX file is binary and of the version that Blender's older importer reads."""
    with path.open("rb") as file:
        head = file.read(27)
    return head.startswith(b"Kaydara FBX Binary") and int.from_bytes(head[23:], "little") >= MIN_FBX_VERSION


def find_armature(bpy: Any, figure: int) -> tuple[Any, list[Any], list[str]]:
    """Return the armature of a figure, with its animation set, all animations that move it, and lines on what was chosen.

    Args:
        bpy: Blender.
        figure: Number of the figure, 0 for the one with the most moving bones.
    """
    armatures = [one for one in bpy.context.scene.objects if one.type == "ARMATURE" and one.data.bones]
    if not armatures:
        raise SceneError("holds no armature, which is what Blender calls a skeleton; export the skeleton with its animation")
    takes = {one: find_takes(bpy, one) for one in armatures}
    armatures.sort(key=lambda one: (-max((count_moving(one, slot) for _, slot in takes[one]), default=0), one.name))
    listed = ", ".join(f"{number} ({one.name})" for number, one in enumerate(armatures, start=1))
    if figure > len(armatures):
        raise SceneError(f"holds {len(armatures)} figures: {listed}; figure {figure} is none of them")
    armature = armatures[max(figure - 1, 0)]
    if not takes[armature]:
        raise SceneError(f"'{armature.name}' is not animated; export the skeleton with its animation")
    if len(armature.data.bones) > MAX_BONES:
        raise SceneError(f"'{armature.name}' has {len(armature.data.bones)} bones, {MAX_BONES} are the most")
    told = [f"The file holds {len(armatures)} figures: {listed}. '{armature.name}' was read; choose one by --figure."]
    notices = told if len(armatures) > 1 and not figure else []
    moving = [count_moving(armature, slot) for _, slot in takes[armature]]
    kept = [take for take, bones in zip(takes[armature], moving, strict=True) if bones >= MIN_MOVING_SHARE * max(moving)]
    armature.animation_data.action, armature.animation_data.action_slot = kept[0]
    actions = [action for action, _ in kept]
    if len(actions) > 1:
        names = ", ".join(f"'{action.name}'" for action in actions)
        notices.append(f"The file holds {len(actions)} animations of '{armature.name}': {names}. The first was read.")
    return armature, actions, notices


def find_takes(bpy: Any, armature: Any) -> list[tuple[Any, Any]]:
    """Return the animations of an armature, each an action and the slot in it: the active one, the stashed ones of glTF, those of FBX."""
    animation = armature.animation_data
    if not animation:
        return []
    found = [(animation.action, animation.action_slot)] if animation.action else []
    found += [(strip.action, strip.action_slot) for track in animation.nla_tracks for strip in track.strips if strip.action]
    found += [(action, action.slots[0]) for action in bpy.data.actions if action.name.startswith(f"{armature.name}|") and action.slots]
    takes: dict[str, tuple[Any, Any]] = {}
    for action, slot in found:
        if slot and curves(slot):
            takes.setdefault(action.name, (action, slot))
    return list(takes.values())


def bags(action: Any) -> list[Any]:
    """Return the containers of an action's curves."""
    return [bag for layer in action.layers for strip in layer.strips for bag in strip.channelbags]


def curves(slot: Any) -> list[Any]:
    """Return the curves in a slot of an action."""
    return [curve for bag in bags(slot.id_data) if bag.slot == slot for curve in bag.fcurves]


def count_moving(armature: Any, slot: Any) -> int:
    """Return how many bones of an armature the curves in a slot move."""
    moving = {curve.data_path.split('"')[1] for curve in curves(slot) if curve.data_path.startswith('pose.bones["') and varies(curve)}
    return len(moving & set(armature.pose.bones.keys()))


def varies(curve: Any) -> bool:
    """Return whether a curve's value changes."""
    return len(curve.keyframe_points) > 1 and float(np.ptp(numbers(curve.keyframe_points, "co", 2)[:, 1])) > MIN_CHANGE


def sampled_frames(keys: np.ndarray, import_fps: float, scene_fps: float) -> tuple[np.ndarray, float, bool]:
    """Return the frames at which to sample, their rate [1/s], and whether they are the file's own keys.

    Keys of a recording are as dense as its frames, whatever rate the file states; an animator's are sampled at the stated rate.

    Args:
        keys: Frames with keys of any curve.
        import_fps: Frames in a second, as the importer placed the keys.
        scene_fps: Frame rate of the scene.
    """
    keys = np.sort(keys)
    keys = keys[np.append(True, np.diff(keys) > MIN_KEY_DISTANCE)]
    if len(keys) < 2:
        raise SceneError("its animation is a single pose; export all its frames")
    distances = np.diff(keys)
    step = float(np.median(distances))
    multiples = np.round(distances / step)
    regular = np.mean((np.abs(distances / step - multiples) < MAX_KEY_JITTER) & (multiples > 0)) >= MIN_REGULAR_SHARE
    length = float(keys[-1] - keys[0])
    recorded = bool(len(keys) >= MIN_KEYS and regular and MIN_KEY_FPS <= import_fps / step <= MAX_KEY_FPS)
    number = max(round(length / step), 1) if recorded else max(int(length * scene_fps / import_fps + 1e-6), 1)
    step = length / number if recorded else import_fps / scene_fps
    return keys[0] + step * np.arange(number + 1), import_fps / step, recorded


def scene_frames(bpy: Any, armature: Any, import_fps: float) -> tuple[np.ndarray, float, bool]:
    """Return what ``sampled_frames`` does of an armature's action."""
    render = bpy.context.scene.render
    keys = [numbers(curve.keyframe_points, "co", 2)[:, 0] for curve in curves(armature.animation_data.action_slot)]
    frames, fps, recorded = sampled_frames(np.unique(np.concatenate(keys)), import_fps, render.fps / render.fps_base)
    bones = len(armature.data.bones)
    if len(frames) * bones > MAX_POSES:
        raise SceneError(f"{len(frames)} frames of {bones} bones are too many, {MAX_POSES // bones} are the most; export a shorter clip")
    return frames, fps, recorded


def numbers(items: Any, attribute: str, width: int) -> np.ndarray:
    """Return an attribute of each item of a collection of Blender's, shape (items, width)."""
    flat = np.empty(len(items) * width, dtype=np.float32)
    items.foreach_get(attribute, flat)
    return flat.reshape(-1, width).astype(float)


def depth_first(armature: Any) -> list[Any]:
    """Return the pose bones, each followed by all below it."""
    found, waiting = [], [bone for bone in reversed(armature.pose.bones) if bone.parent is None]
    while waiting:
        found.append(waiting.pop())
        waiting.extend(reversed(found[-1].children))
    return found


def read(bpy: Any, source: Path, result: Path, figure: int) -> None:
    """Write facts of an armature, ``rest`` (J, 4, 4) and ``poses`` (T, J, 4, 4) of its bones in its space, and its ``places`` (T, 4, 4).

    Where it has a mesh, that is written too, as ``read_mesh`` returns it.
    """
    import_fps = import_scene(bpy, source)
    armature, _, notices = find_armature(bpy, figure)
    frames, fps, recorded = scene_frames(bpy, armature, import_fps)
    bones, scene = depth_first(armature), bpy.context.scene
    names, place = [bone.name for bone in bones], {name: index for index, name in enumerate(armature.pose.bones.keys())}
    order = [place[name] for name in names]
    scene.frame_set(int(np.floor(frames[0])), subframe=float(frames[0] - np.floor(frames[0])))
    mesh, no_mesh = read_mesh(bpy, armature, names)
    for other in scene.objects:
        other.hide_viewport = other.type in ("MESH", "CURVE")  # which need not follow the bones now
    poses, places = np.empty((len(frames), len(bones), 16), np.float32), np.empty((len(frames), 4, 4), np.float32)
    flat = np.empty(len(bones) * 16, np.float32)
    for index, frame in enumerate(frames):
        scene.frame_set(int(np.floor(frame)), subframe=float(frame - np.floor(frame)))
        armature.pose.bones.foreach_get("matrix", flat)
        poses[index] = flat.reshape(-1, 16)[order]
        places[index] = armature.matrix_world
    if not recorded:
        notices.append(f"Its keys are sparse or irregular; the animation was sampled at {fps:g} fps.")
    facts = {
        "armature": armature.name,
        "names": names,
        "parents": [names.index(bone.parent.name) if bone.parent else -1 for bone in bones],
        "fps": fps,
        "notices": notices,
        "no_mesh": no_mesh,
    }
    rest = np.array([bone.bone.matrix_local for bone in bones], dtype=np.float32)
    poses = poses.reshape(*poses.shape[:2], 4, 4).swapaxes(-1, -2)  # Blender's flat matrices are column by column
    np.savez(result, **{"facts": np.array(json.dumps(facts)), "rest": rest, "poses": poses, "places": places, **mesh})


def read_mesh(bpy: Any, armature: Any, names: list[str]) -> tuple[dict[str, np.ndarray], str]:
    """Return the mesh that hangs on an armature, as it is in the rest pose, and why one is left out.

    Args:
        bpy: Blender, at the first frame.
        armature: The armature.
        names: Names of its bones.

    Returns:
        Nothing where there is no mesh, else ``vertices`` (V, 3) in the armature's space, ``faces`` (N, 3), and of each vertex the
        ``joints`` (V, 4) that move it, by their place in ``names``, with their ``weights`` (V, 4), 1 in sum. And a line, "" if all is well.
    """
    skins = [one for one in bpy.context.scene.objects if one.type == "MESH" and hangs_on(one, armature)]
    count = sum(len(skin.data.vertices) for skin in skins)
    if count > MAX_VERTICES:
        return {}, f"The file's mesh is not drawn: it has {count} vertices, {MAX_VERTICES} are the most."
    armature.data.pose_position = "REST"
    bpy.context.view_layer.update()
    parts, first = [], 0
    for skin in skins:
        joints, weights = bone_weights(skin, armature, names)
        if weights.any():
            vertices, faces = triangles(skin, armature)
            parts.append({"vertices": vertices, "faces": faces + first, "joints": joints, "weights": weights})
            first += len(vertices)
    armature.data.pose_position = "POSE"
    if not parts:
        return {}, "The file's mesh is not drawn: nothing says which bones move it." if skins else ""
    mesh = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    if not all(np.isfinite(table).all() for table in mesh.values()):
        return {}, "The file's mesh is not drawn: some of its numbers are not finite."
    return mesh, ""


def hangs_on(skin: Any, armature: Any) -> bool:
    """Return whether a mesh is moved by the bones of an armature: by their weights, or whole by one of them."""
    by_weights = any(modifier.type == "ARMATURE" and modifier.object == armature for modifier in skin.modifiers)
    return len(skin.data.vertices) > 0 and (by_weights or is_carried(skin, armature))


def is_carried(skin: Any, armature: Any) -> bool:
    """Return whether a mesh is moved whole by a bone of an armature."""
    return skin.parent == armature and skin.parent_type == "BONE"


def bone_weights(skin: Any, armature: Any, names: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return the bones that move each vertex of a mesh and their weights, shape (V, 4) each; one that none moves follows the first bone."""
    places = {name: index for index, name in enumerate(names)}
    joints, weights = (np.zeros((len(skin.data.vertices), INFLUENCES), kind) for kind in (np.int32, np.float32))
    if is_carried(skin, armature):
        joints[:, 0], weights[:, 0] = places.get(skin.parent_bone, 0), skin.parent_bone in places
        return joints, weights
    bones = np.array([places.get(group.name, -1) for group in skin.vertex_groups], dtype=int)
    told = np.array([(vertex.index, group.group, group.weight) for vertex in skin.data.vertices for group in vertex.groups]).reshape(-1, 3)
    owners, bone, weight = told[:, 0].astype(int), bones[told[:, 1].astype(int)], told[:, 2]
    order = np.lexsort((-weight, owners))
    order = order[((bone >= 0) & (weight > 0.0))[order]]
    owners, bone, weight = owners[order], bone[order], weight[order]
    rank = np.arange(len(owners)) - np.searchsorted(owners, owners)
    heavy = rank < INFLUENCES
    joints[owners[heavy], rank[heavy]], weights[owners[heavy], rank[heavy]] = bone[heavy], weight[heavy]
    if weights.any():
        weights[~weights.any(axis=1), 0] = 1.0
        weights /= weights.sum(axis=1, keepdims=True)
    return joints, weights


def triangles(skin: Any, armature: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices (V, 3) of a mesh in an armature's space, and its faces as triangles (N, 3), counter-clockwise from outside."""
    skin.data.calc_loop_triangles()
    faces = np.empty(3 * len(skin.data.loop_triangles), np.int32)
    skin.data.loop_triangles.foreach_get("vertices", faces)
    place = np.array(armature.matrix_world.inverted_safe() @ skin.matrix_world)
    vertices = numbers(skin.data.vertices, "co", 3) @ place[:3, :3].T + place[:3, 3]
    faces = faces.reshape(-1, 3)
    return vertices.astype(np.float32), faces[:, ::-1] if np.linalg.det(place[:3, :3]) < 0.0 else faces


def write(bpy: Any, source: Path, poses: Path, figure: int, out: Path) -> None:
    """Write a copy of the scene with new poses: ``matrices`` (T, J, 4, 4) in the armature's space, of which bones ``changed`` are keyed."""
    import_fps = import_scene(bpy, source)
    armature, actions, _ = find_armature(bpy, figure)
    frames, _, _ = scene_frames(bpy, armature, import_fps)
    with np.load(poses, allow_pickle=False) as told:
        matrices, changed, fps = told["matrices"], told["changed"], float(told["fps"])
    bones = depth_first(armature)
    names = [bone.name for bone in bones]
    if matrices.shape != (len(frames), len(bones), 4, 4):
        raise SceneError("changed while its clip was cleaned; try again")
    first = retime(bpy, frames)
    set_rate(bpy, fps, out.suffix.lower())
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = first, first + len(frames) - 1
    times = np.arange(first, first + len(frames))
    for index in np.flatnonzero(changed):
        above = bones[index].parent
        key_bone(armature, bones[index], times, matrices[:, index], matrices[:, names.index(above.name)] if above else None)
    name_takes(bpy, armature, actions)
    export(bpy, out, several=len(actions) > 1, one_take=source.suffix.lower() == ".fbx" and len(actions) == 1)


def retime(bpy: Any, frames: np.ndarray) -> int:
    """Move the keys of all actions so that the sampled ones are whole frames; return the first of those."""
    step = (frames[-1] - frames[0]) / (len(frames) - 1)
    first = max(round(frames[0] / step), 1)
    for action in bpy.data.actions:
        for bag in bags(action):
            for curve in bag.fcurves:
                for attribute in ("co", "handle_left", "handle_right"):
                    moved = numbers(curve.keyframe_points, attribute, 2)
                    moved[:, 0] = (moved[:, 0] - frames[0]) / step + first
                    curve.keyframe_points.foreach_set(attribute, moved.astype(np.float32).ravel())
                curve.update()
    return first


def set_rate(bpy: Any, fps: float, suffix: str) -> None:
    """Set the scene's frame rate [1/s]; the exporter of glTF multiplies by what it should divide by."""
    render = bpy.context.scene.render
    render.fps = max(round(fps), 1)
    render.fps_base = render.fps / fps if suffix == ".fbx" else fps / render.fps


def key_bone(armature: Any, bone: Any, times: np.ndarray, matrices: np.ndarray, parents: np.ndarray | None) -> None:
    """Replace the curves of a bone's rotation and location by keys at all times.

    Args:
        armature: The bone's armature.
        bone: The pose bone.
        times: Whole frames, shape (T,).
        matrices: Poses of the bone in the armature's space, shape (T, 4, 4).
        parents: The same of its parent, None if it has none.
    """
    from mathutils import Matrix  # type: ignore[import-not-found]  # comes with Blender

    own, above = bone.bone, bone.bone.parent
    places, turns = np.empty((len(times), 3)), np.empty((len(times), 4))
    for index, matrix in enumerate(matrices):
        known = {} if parents is None else {"parent_matrix": Matrix(parents[index]), "parent_matrix_local": above.matrix_local}
        basis = own.convert_local_to_pose(Matrix(matrix), own.matrix_local, invert=True, **known)
        places[index], turns[index], _ = basis.decompose()
    flips = np.cumprod(np.where(np.sum(turns[1:] * turns[:-1], axis=1) < 0.0, -1.0, 1.0))
    turns[1:] *= flips[:, None]  # a quaternion and its negative are one rotation, but not to what interpolates
    bone.rotation_mode = "QUATERNION"
    slot = armature.animation_data.action_slot
    bag, path = next(bag for bag in bags(slot.id_data) if bag.slot == slot), bone.path_from_id()
    replaced = {f"{path}.{kind}" for kind in ("location", "rotation_quaternion", "rotation_euler", "rotation_axis_angle")}
    for curve in [curve for curve in bag.fcurves if curve.data_path in replaced]:
        bag.fcurves.remove(curve)
    for kind, values in (("location", places), ("rotation_quaternion", turns)):
        for axis in range(values.shape[1]):
            curve = bag.fcurves.new(f"{path}.{kind}", index=axis, group_name=bone.name)
            curve.keyframe_points.add(len(times))
            curve.keyframe_points.foreach_set("co", np.stack([times, values[:, axis]], axis=1).astype(np.float32).ravel())
            curve.keyframe_points.foreach_set("interpolation", np.full(len(times), LINEAR, dtype=np.int32))
            curve.update()


def make(bpy: Any, poses: Path, out: Path) -> None:
    """Write a scene of one skeleton with one animation.

    ``poses`` holds ``heads`` and ``tails`` (J, 3) of the bones at rest, ``matrices`` (T, J, 4, 4) of the joints, which are not turned at
    rest, and ``facts``: names, parents, name of the animation, frame rate. For a glTF they are in metres and Z up; for an FBX as they
    will be in the file, in centimetres and Y up, so that no node of it is scaled or turned.
    """
    with np.load(poses, allow_pickle=False) as told:
        facts, heads, tails, matrices = json.loads(str(told["facts"])), told["heads"], told["tails"], told["matrices"]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene, is_fbx = bpy.context.scene, out.suffix.lower() == ".fbx"
    set_rate(bpy, facts["fps"], out.suffix.lower())
    scene.frame_start, scene.frame_end = 0, len(matrices) - 1
    armature, names = add_armature(bpy, facts["names"], facts["parents"], heads, tails)
    bones = [armature.pose.bones[name] for name in names]
    action = add_action(bpy, armature, facts["animation"])
    rest = np.array([bone.bone.matrix_local for bone in bones])
    matrices[..., :3, :3] = matrices[..., :3, :3] @ rest[:, :3, :3]
    times = np.arange(len(matrices))
    if is_fbx:  # which holds the current frame, here one before the first, for the rest pose of a skeleton without a mesh
        matrices, times = np.concatenate([rest[None], matrices]), np.append(-1, times)
        scene.unit_settings.scale_length = FBX_UNIT
        armature.rotation_euler.x = np.pi / 2
    else:
        draw_bones(bpy, armature, names, heads, tails)
    for index, parent in enumerate(facts["parents"]):
        key_bone(armature, bones[index], times, matrices[:, index], matrices[:, parent] if parent >= 0 else None)
    scene.frame_set(int(times[0]))
    name_takes(bpy, armature, [action])
    export(bpy, out, several=False, one_take=False)


def add_armature(bpy: Any, names: list[str], parents: list[int], heads: np.ndarray, tails: np.ndarray) -> tuple[Any, list[str]]:
    """Add an armature with bones from ``heads`` to ``tails`` (J, 3); return it and the names that Blender gave the bones."""
    armature = bpy.data.objects.new(MADE_ARMATURE, bpy.data.armatures.new(MADE_ARMATURE))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bones = []
    for name, parent, head, tail in zip(names, parents, heads, tails, strict=True):
        bone = armature.data.edit_bones.new(name)
        bone.head, bone.tail = head, tail
        bone.parent = bones[parent] if parent >= 0 else None
        bones.append(bone)
    given = [bone.name for bone in bones]
    bpy.ops.object.mode_set(mode="OBJECT")
    return armature, given


def add_action(bpy: Any, armature: Any, name: str) -> Any:
    """Give an armature an action without curves; return it."""
    action = bpy.data.actions.new(name)
    slot = action.slots.new("OBJECT", armature.name)
    action.layers.new(name).strips.new(type="KEYFRAME").channelbag(slot, ensure=True)
    animation = armature.animation_data_create()
    animation.action, animation.action_slot = action, slot
    return action


def draw_bones(bpy: Any, armature: Any, names: list[str], heads: np.ndarray, tails: np.ndarray) -> None:
    """Add a mesh of the bones, each drawn to a point at both ends: in a glTF only what carries a mesh is a skeleton."""
    mesh = bpy.data.meshes.new("Bones")
    points, faces = [], []
    for bone, head, tail in zip((armature.data.bones[name] for name in names), heads, tails, strict=True):
        axes = np.array(bone.matrix_local)[:3, :3] * bone.length  # columns; the second points to the tail
        across = DRAWN_WIDTH * np.array([axes[:, 0], axes[:, 2], -axes[:, 0], -axes[:, 2]])
        first = len(points)
        points += [head, *(head + DRAWN_CORNERS_AT * axes[:, 1] + across), tail]
        for one, other in ((1, 2), (2, 3), (3, 4), (4, 1)):
            faces += [(first, first + one, first + other), (first + 5, first + other, first + one)]
    mesh.from_pydata([point.tolist() for point in points], [], faces)
    drawn = bpy.data.objects.new("Bones", mesh)
    bpy.context.scene.collection.objects.link(drawn)
    drawn.parent = armature
    for index, name in enumerate(names):
        drawn.vertex_groups.new(name=name).add(list(range(6 * index, 6 * index + 6)), 1.0, "REPLACE")
    drawn.modifiers.new("Armature", "ARMATURE").object = armature


def name_takes(bpy: Any, armature: Any, actions: list[Any]) -> None:
    """Name what is exported as it was in the file: FBX's importer and exporter each put the object's name in front."""
    for action in actions:
        while action.name.startswith(f"{armature.name}|"):
            action.name = action.name.removeprefix(f"{armature.name}|")
    bpy.context.scene.name = actions[0].name  # of the one animation of an FBX


def export(bpy: Any, out: Path, several: bool, one_take: bool) -> None:
    """Write the scene.

    Args:
        bpy: Blender.
        out: File to write.
        several: Whether the figure has several animations, each to be written for itself.
        one_take: Whether all objects' actions are one animation, as in an FBX, whose importer makes an action of each object's share.
    """
    if out.suffix.lower() == ".fbx":
        bpy.ops.export_scene.fbx(
            filepath=str(out),
            add_leaf_bones=False,
            bake_anim_use_nla_strips=False,
            bake_anim_use_all_actions=several,
            bake_anim_simplify_factor=0.0,
            use_custom_props=True,
            path_mode="COPY",
            embed_textures=True,
        )
        return
    bpy.ops.export_scene.gltf(
        filepath=str(out),
        export_format="GLB" if out.suffix.lower() == ".glb" else "GLTF_SEPARATE",
        export_animation_mode="ACTIVE_ACTIONS" if one_take else "ACTIONS",
        export_nla_strips_merged_animation_name=bpy.context.scene.name,
        export_force_sampling=True,
        export_optimize_animation_size=False,
        export_all_influences=True,
        export_extras=True,
    )


def limit_memory() -> None:
    """Limit the memory of this process, where the system can."""
    try:
        import resource
    except ImportError:  # Windows
        return
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    limit = MAX_MEMORY_BYTES if most == resource.RLIM_INFINITY else min(MAX_MEMORY_BYTES, most)
    resource.setrlimit(resource.RLIMIT_AS, (limit, most))


def main(arguments: list[str]) -> int:
    """Run one of the commands; return the exit code."""
    if arguments == ["find"]:
        return 0 if find_spec("bpy") else NO_BLENDER
    try:
        import bpy  # type: ignore[import-not-found]
    except ImportError:
        return NO_BLENDER
    limit_memory()
    command, *given = arguments
    try:
        if command == "make":
            make(bpy, Path(given[0]), Path(given[1]))
        elif command == "read":
            read(bpy, Path(given[0]), Path(given[1]), int(given[2]))
        else:
            write(bpy, Path(given[0]), Path(given[1]), int(given[2]), Path(given[3]))
    except SceneError as error:
        Path("error.txt").write_text(f"scene\n{error}", encoding="utf-8")
        return FAILED
    except Exception as error:  # whatever Blender's importers and exporters, which are not ours, raise
        last = ([line.strip() for line in str(error).splitlines() if line.strip()] or [""])[-1]
        Path("error.txt").write_text(f"blender\n{type(error).__name__}: {last}", encoding="utf-8")
        return FAILED
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
