"""Script for a Python with Blender in it, of the tests: builds the scene of a skinned figure, and says what is in a file.

python blender_builder.py build SPEC.npz OUT...       a scene of the figure, exported in the format of each suffix
python blender_builder.py inspect FILE FACTS.npz      where its mesh is in each frame, and names
python blender_builder.py reexport FILE.bvh FOLDER    the file by Blender: BVH of every up axis, order and scale; with a mesh, FBX and glTF
"""

import json
import sys
from pathlib import Path

import bpy  # type: ignore[import-not-found]
import numpy as np
from mathutils import Matrix, Vector  # type: ignore[import-not-found]

TURNS = {  # of the armature, by the axis that then points up
    "z": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "x": ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
    "y": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "-x": ((0, 0, -1), (1, 0, 0), (0, -1, 0)),
    "-y": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "-z": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
}
ORDERS, SCALES = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"), (1.0, 0.01, 100.0, 1.0 / 0.0254, 10.0, 0.001)
HALF_WIDTH = 0.02  # m, of the tetrahedron around each joint
BALL_STEP = 0.1  # m a frame, of an object that moves beside the figures


def build(spec: dict, outs: list[str]) -> None:
    """Build the figures of a specification and export them."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene, frames = bpy.context.scene, spec["positions"].shape[0]
    scene.render.fps, scene.render.fps_base = round(float(spec["fps"])), round(float(spec["fps"])) / float(spec["fps"])
    scene.frame_start, scene.frame_end = 1, frames
    for figure in spec["figures"].tolist():
        add_figure(spec, figure)
    ball = bpy.data.objects.new("Ball", None)
    scene.collection.objects.link(ball)
    for frame in (1, frames):
        ball.location = (BALL_STEP * (frame - 1), 0.0, 0.0)
        ball.keyframe_insert("location", frame=frame)
    for out in outs:
        export(Path(out), str(spec["axes"]), bool(spec["all_takes"]))


def export(out: Path, axes: str, all_takes: bool) -> None:
    """Export the scene; ``axes`` are forward and up of an FBX, which has each action as a take of each object if ``all_takes``."""
    if out.suffix == ".fbx":
        forward, up = axes.split()
        takes = {"bake_anim_use_nla_strips": False, "bake_anim_use_all_actions": all_takes}
        textures = {"path_mode": "COPY", "embed_textures": True}
        bpy.ops.export_scene.fbx(
            filepath=str(out), add_leaf_bones=False, axis_forward=forward, axis_up=up, bake_anim_simplify_factor=0.0, **takes, **textures
        )
    elif out.suffix == ".bvh":
        bpy.context.view_layer.objects.active = next(one for one in bpy.data.objects if one.type == "ARMATURE")
        bpy.ops.export_anim.bvh(filepath=str(out), frame_start=1, frame_end=bpy.context.scene.frame_end)
    else:
        kind = "GLB" if out.suffix == ".glb" else "GLTF_SEPARATE"
        scene = bpy.context.scene
        rate = scene.render.fps / scene.render.fps_base
        scene.render.fps_base = rate / scene.render.fps  # Blender's exporter multiplies by it
        bpy.ops.export_scene.gltf(filepath=str(out), export_format=kind)
        scene.render.fps_base = scene.render.fps / rate


def add_figure(spec: dict, name: str) -> None:
    """Add an armature of some unit and orientation, with a mesh around its joints, that moves as specified."""
    parents, heads = spec["parents"].tolist(), spec["heads"]
    place = Matrix(spec["place"].tolist())  # of the armature in the world
    armature = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    bpy.context.scene.collection.objects.link(armature)
    armature.matrix_world = place
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    bones = []
    for index, (joint, parent) in enumerate(zip(spec["names"].tolist(), parents, strict=True)):
        bone = armature.data.edit_bones.new(joint)
        children = [child for child, over in enumerate(parents) if over == index]
        tail = heads[children[0]] if children else heads[index] + (0.0, 0.03, 0.05)
        bone.head, bone.tail = place.inverted() @ Vector(heads[index]), place.inverted() @ Vector(tail)
        bone.roll = 0.7 * index  # rad; no two bones have their axes alike
        bone.parent = bones[parent] if parent >= 0 else None
        bones.append(bone)
    bpy.ops.object.mode_set(mode="OBJECT")
    animate(armature, spec, place)
    add_mesh(armature, spec)


def animate(armature: bpy.types.Object, spec: dict, place: Matrix) -> None:
    """Key every bone in every frame."""
    names, parents = spec["names"].tolist(), spec["parents"].tolist()
    rest = [place @ armature.data.bones[name].matrix_local for name in names]
    for frame, (turns, positions) in enumerate(zip(spec["rotations"], spec["positions"], strict=True), start=1):
        world = [Matrix.Translation(p) @ (Matrix(r.tolist()) @ m.to_3x3()).to_4x4() for r, p, m in zip(turns, positions, rest, strict=True)]
        for index, name in enumerate(names):
            pose, parent = armature.pose.bones[name], parents[index]
            was = rest[parent].inverted() @ rest[index] if parent >= 0 else rest[index]
            pose.rotation_mode = "QUATERNION"
            pose.matrix_basis = was.inverted() @ (world[parent].inverted() @ world[index] if parent >= 0 else world[index])
            pose.scale = (1.0, 1.0, 1.0)
            pose.keyframe_insert("rotation_quaternion", frame=frame)
            if parent < 0:
                pose.keyframe_insert("location", frame=frame)


def add_mesh(armature: bpy.types.Object, spec: dict) -> None:
    """Add a tetrahedron around each joint's head, skinned to its bone, with a material."""
    corners = HALF_WIDTH * np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
    points = (spec["heads"][:, None] + corners).reshape(-1, 3)
    faces = [
        tuple(4 * joint + np.array(face)) for joint in range(len(spec["heads"])) for face in ((0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2))
    ]
    mesh = bpy.data.meshes.new(f"{armature.name} skin")
    mesh.from_pydata(points.tolist(), [], [[int(corner) for corner in face] for face in faces])
    mesh.uv_layers.new(name="UVMap")
    mesh.materials.append(cloth())
    skin = bpy.data.objects.new(f"{armature.name} skin", mesh)
    bpy.context.scene.collection.objects.link(skin)
    skin.parent = armature
    skin.matrix_parent_inverse = armature.matrix_world.inverted()
    for joint, name in enumerate(spec["names"].tolist()):
        skin.vertex_groups.new(name=name).add(list(range(4 * joint, 4 * joint + 4)), 1.0, "REPLACE")
    skin.modifiers.new("Armature", "ARMATURE").object = armature


def cloth() -> bpy.types.Material:
    """Return a material with a picture in it."""
    material, picture = bpy.data.materials.new("Cloth"), bpy.data.images.new("Weave", 4, 4)
    picture.pixels = [0.2, 0.4, 0.6, 1.0] * 16
    picture.pack()
    material.use_nodes = True
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = picture
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    material.node_tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    return material


def inspect(path: Path, facts: str) -> None:
    """Say the centre of each bone's vertices in each whole frame, and what the file holds."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = 60
    if path.suffix == ".fbx":
        bpy.ops.import_scene.fbx(filepath=str(path))
    else:
        bpy.ops.import_scene.gltf(filepath=str(path), disable_bone_shape=True)
    scene = bpy.context.scene
    action = next(one for one in scene.objects if one.type == "ARMATURE").animation_data.action
    first, last = (round(frame) for frame in action.frame_range)
    skins = [one for one in scene.objects if one.type == "MESH" and one.vertex_groups]
    centres, ball, found = [], [], {}
    for frame in range(first, last + 1):
        scene.frame_set(frame)
        graph = bpy.context.evaluated_depsgraph_get()
        found = {}
        for skin in skins:
            moved = skin.evaluated_get(graph)
            for vertex, source in zip(moved.data.vertices, skin.data.vertices, strict=True):
                group = skin.vertex_groups[source.groups[0].group].name
                found.setdefault(group, []).append(tuple(moved.matrix_world @ vertex.co))
        centres.append([np.mean(found[name], axis=0) for name in sorted(found)])
        ball.append(tuple(bpy.data.objects["Ball"].matrix_world.translation))
    told = {
        "groups": sorted(found),
        "objects": sorted(scene.objects.keys()),
        "materials": sorted(bpy.data.materials.keys()),
        "pictures": sorted(tuple(image.size) for image in bpy.data.images if image.has_data or image.packed_file),
        "bones": [bone.name for one in scene.objects if one.type == "ARMATURE" for bone in one.data.bones],
        "fps": scene.render.fps / scene.render.fps_base,
    }
    np.savez(facts, told=json.dumps(told), centres=np.array(centres), ball=np.array(ball))


def reexport(source: str, folder: Path) -> None:
    """Export a BVH file's armature with every up axis, each in another order and scale, and with a mesh as FBX and glTF."""
    for index, (up, turn) in enumerate(TURNS.items()):
        armature = import_bvh(source)
        armature.matrix_world = Matrix(turn).to_4x4() @ armature.matrix_world
        bpy.ops.object.transform_apply(location=False, rotation=True, scale=False)
        first, last = map(round, armature.animation_data.action.frame_range)
        out = folder / f"{up}_{ORDERS[index]}.bvh"
        bpy.ops.export_anim.bvh(filepath=str(out), frame_start=first, frame_end=last, rotate_mode=ORDERS[index], global_scale=SCALES[index])
    armature = import_bvh(source)
    bones = armature.data.bones
    add_mesh(armature, {"names": np.array([bone.name for bone in bones]), "heads": np.array([bone.head_local for bone in bones])})
    for out in ("skinned.fbx", "skinned.glb"):
        export(folder / out, "-Z Y", False)


def import_bvh(source: str) -> bpy.types.Object:
    """Import a BVH file into an empty scene of its rate and frames; return its armature."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_anim.bvh(filepath=source, update_scene_fps=True)
    armature = next(one for one in bpy.data.objects if one.type == "ARMATURE")
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = map(round, armature.animation_data.action.frame_range)
    bpy.context.view_layer.objects.active = armature
    armature.select_set(True)
    return armature


if __name__ == "__main__":
    if sys.argv[1] == "build":
        with np.load(sys.argv[2], allow_pickle=False) as loaded:
            build(dict(loaded), sys.argv[3:])
    elif sys.argv[1] == "reexport":
        reexport(sys.argv[2], Path(sys.argv[3]))
    else:
        inspect(Path(sys.argv[2]), sys.argv[3])
