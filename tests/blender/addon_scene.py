"""Script for a Python with Blender in it, of the tests: installs the add-on, builds a figure, cleans it, and says what came of it.

python addon_scene.py FOLDER      reads FOLDER/scenario.json, writes FOLDER/facts.json and FOLDER/poses.npz
"""

import json
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy  # type: ignore[import-not-found]
import numpy as np
from mathutils import Matrix  # type: ignore[import-not-found]

sys.path.insert(0, str(Path(__file__).parents[1] / "datasets" / "formats"))
import blender_builder  # type: ignore[import-not-found]

MAX_MODAL_S = 120.0
ADDON = "bl_ext.user_default.adapt_mimic"


def install(scenario: dict) -> None:
    """Install the add-on as a user does, and name the command in its preferences."""
    bpy.ops.extensions.package_install_files(filepath=scenario["zip"], repo="user_default", enable_on_install=True)
    bpy.context.preferences.addons[ADDON].preferences.command = scenario["command"]


def build(folder: Path, scenario: dict) -> bpy.types.Object:
    """Build the figure of FOLDER/spec.npz, changed as the scenario wants it; return its armature."""
    with np.load(folder / "spec.npz", allow_pickle=False) as loaded:
        blender_builder.build(dict(loaded), [])
    scene = bpy.context.scene
    armature = next(one for one in scene.objects if one.type == "ARMATURE")
    bpy.context.view_layer.objects.active = armature
    if scenario.get("mode"):
        rekey(armature, scenario["mode"])
    if scenario.get("rig"):
        add_controls(armature)
    shift = scenario.get("first", 1) - 1
    for curve in curves(armature):
        for key in curve.keyframe_points:
            key.co[0] += shift
        curve.update()
    if scenario.get("carried"):
        carrier = bpy.data.objects.new("Carrier", None)
        scene.collection.objects.link(carrier)
        for frame, x in ((1 + shift, 0.0), (31 + shift, 2.0)):
            carrier.location = (x, 0.0, 0.0)
            carrier.keyframe_insert("location", frame=frame)
        armature.parent = carrier
    return armature


def curves(armature: Any, action: Any = None) -> list:
    """Return the F-curves of an action, of the armature's own if None."""
    action = action or armature.animation_data.action
    return [curve for layer in action.layers for strip in layer.strips for bag in strip.channelbags for curve in bag.fcurves]


def rekey(armature: bpy.types.Object, mode: str) -> None:
    """Key all bones in another rotation mode."""
    first, last = map(round, armature.animation_data.action.frame_range)
    kept = {}
    for frame in range(first, last + 1):
        bpy.context.scene.frame_set(frame)
        kept[frame] = {bone.name: bone.matrix_basis.copy() for bone in armature.pose.bones}
    bag = armature.animation_data.action.layers[0].strips[0].channelbags[0]
    bag.fcurves.clear()
    for frame, bases in kept.items():
        for bone in armature.pose.bones:
            bone.rotation_mode = mode
            bone.matrix_basis = bases[bone.name]
            bone.keyframe_insert("rotation_axis_angle" if mode == "AXIS_ANGLE" else "rotation_euler", frame=frame)
            if bone.parent is None:
                bone.keyframe_insert("location", frame=frame)


def add_controls(armature: bpy.types.Object) -> None:
    """Add a bone that does not deform and holds the left foot by IK; it swings."""
    bpy.ops.object.mode_set(mode="EDIT")
    foot, control = armature.data.edit_bones["LeftFoot"], armature.data.edit_bones.new("foot_ik")
    control.head, control.tail = foot.head, foot.head + foot.vector
    control.use_deform = False
    bpy.ops.object.mode_set(mode="POSE")
    ik = armature.pose.bones["LeftLeg"].constraints.new("IK")
    ik.target, ik.subtarget, ik.chain_count = armature, "foot_ik", 2
    for frame, x in ((1, 0.0), (15, 0.2), (30, 0.0)):
        armature.pose.bones["foot_ik"].location = (x, 0.1, 0.0)
        armature.pose.bones["foot_ik"].keyframe_insert("location", frame=frame)


def evaluated(armature: bpy.types.Object, frames: range) -> tuple[np.ndarray, np.ndarray]:
    """Return the places of the bones (T, B, 3) in the world and their turns from the rest pose there (T, B, 3, 3)."""
    places, turns, rest = [], [], []
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        world = armature.matrix_world
        if not rest:
            rest = [np.array((world @ bone.bone.matrix_local).to_3x3().normalized()) for bone in armature.pose.bones]
        poses = [world @ bone.matrix for bone in armature.pose.bones]
        places.append([tuple(pose.translation) for pose in poses])
        turns.append([np.array(pose.to_3x3().normalized()) @ own.T for pose, own in zip(poses, rest, strict=True)])
    return np.array(places), np.array(turns)


def keys(armature: bpy.types.Object, action: bpy.types.Action) -> dict[str, list]:
    """Return the keys of an action by property and axis."""
    return {
        f"{curve.data_path}[{curve.array_index}]": [list(key.co) for key in curve.keyframe_points] for curve in curves(armature, action)
    }


def clean() -> str:
    """Clean as a script does; return what Blender says."""
    try:
        return sorted(bpy.ops.adapt_mimic.clean("EXEC_DEFAULT", True))[0]
    except RuntimeError as error:
        return str(error).strip()


class Window:
    """Stands for Blender's window manager, which has no window here: it notes timers and handlers."""

    def __init__(self) -> None:
        """Begin without any."""
        self.windows, self.timers, self.handlers = [], [], []

    def event_timer_add(self, step: float, window: object) -> float:
        """Note a timer."""
        self.timers.append(step)
        return step

    def event_timer_remove(self, timer: float) -> None:
        """Forget a timer."""
        self.timers.remove(timer)

    def modal_handler_add(self, operator: object) -> None:
        """Note a handler."""
        self.handlers.append(operator)


def run_modal(armature: bpy.types.Object, cancel: bool, undo: bool) -> dict:
    """Clean tick by tick, as Blender with a window does; say what came of it.

    Args:
        armature: The armature.
        cancel: Whether to press Cancel once the command runs.
        undo: Whether to do something else and undo it after each tick, which makes everything in Blender anew.
    """
    functions = {name: value for name, value in vars(bpy.types.ADAPT_MIMIC_OT_clean).items() if not name.startswith("__")}
    operator: Any = type("Clean", (), functions | {"report": lambda _self, kind, text: reports.append([sorted(kind)[0], text])})()
    reports: list = []
    window, name = Window(), armature.name
    context = SimpleNamespace(window_manager=window, window=None, scene=bpy.context.scene, object=armature)
    tick, other = SimpleNamespace(type="TIMER"), SimpleNamespace(type="MOUSEMOVE")
    answers, longest, bars, end = [operator.invoke(context, other)], 0.0, [], time.monotonic() + MAX_MODAL_S
    while answers[-1] & {"RUNNING_MODAL", "PASS_THROUGH"} and time.monotonic() < end:
        assert operator.modal(context, other) == {"PASS_THROUGH"}
        begin = time.monotonic()
        answers.append(operator.modal(context, tick))
        longest = max(longest, time.monotonic() - begin)
        if undo and answers[-1] == {"PASS_THROUGH"}:
            bpy.context.scene.cursor.location.x += 1.0
            bpy.ops.ed.undo_push(message="moved")
            bpy.ops.ed.undo()
            context.object, context.scene = bpy.data.objects[name], bpy.context.scene
        bars.append(drawn(context.object)[0])
        if cancel and "Simulating" in bars[-1]:
            assert not bpy.ops.adapt_mimic.clean.poll()
            assert bpy.ops.adapt_mimic.cancel() == {"FINISHED"}
        time.sleep(0.02)
    told = {"answer": sorted(answers[-1])[0], "longest_s": longest, "bars": sorted(set(bars)), "timers": len(window.timers)}
    return told | {"reports": reports, "begun": len(window.handlers), "ready": bpy.ops.adapt_mimic.clean.poll()}


def main(folder: Path) -> None:
    """Play a scenario."""
    scenario = json.loads((folder / "scenario.json").read_text())
    armature = build(folder, scenario)  # first: it begins with Blender's factory settings
    install(scenario)
    name, recorded = armature.name, armature.animation_data.action
    old_name, old_keys = recorded.name, keys(armature, recorded)
    first, last = (round(frame) for frame in recorded.frame_range)
    frames = range(first, last + 1)
    before = evaluated(armature, frames)
    bpy.ops.ed.undo_push(message="before")
    for attribute, value in scenario.get("settings", {}).items():
        setattr(bpy.context.scene.adapt_mimic, attribute, value)
    exec(scenario.get("prepare", ""), {"bpy": bpy, "armature": armature, "Matrix": Matrix})
    modal = scenario.get("modal")
    facts: dict[str, Any] = run_modal(armature, modal == "cancel", modal == "undo") if modal else {"said": clean()}
    armature = bpy.data.objects[name]
    facts |= {"scenes": len(bpy.data.scenes), "modes": sorted({bone.rotation_mode for bone in armature.pose.bones})}
    recorded, action = bpy.data.actions[old_name], armature.animation_data.action
    if action not in (recorded, None):
        after = evaluated(armature, frames)
        facts |= told_of(armature, recorded, action)
        facts["old_same"] = keys(armature, recorded) == old_keys
        bpy.ops.adapt_mimic.compare()
        facts["compared"] = armature.animation_data.action.name
        again = evaluated(armature, frames)
        bpy.ops.adapt_mimic.compare()
        facts["compared_again"] = armature.animation_data.action.name
        np.savez(folder / "poses.npz", names=armature.pose.bones.keys(), before=before[0], places=after[0], turns=after[1], again=again[0])
        if not modal:  # which Blender ends with a step of undo
            bpy.ops.ed.undo()
        facts["undone"] = sorted(action.name for action in bpy.data.actions if action.name.startswith(old_name))
        facts["undone_action"] = bpy.data.objects[name].animation_data.action.name
    facts["panel"] = drawn(bpy.data.objects[name])
    bpy.ops.preferences.addon_disable(module=ADDON)
    facts["left"] = [hasattr(bpy.types.Scene, "adapt_mimic"), hasattr(bpy.types.Action, "adapt_mimic")]
    (folder / "facts.json").write_text(json.dumps(facts))


def told_of(armature: bpy.types.Object, recorded: bpy.types.Action, action: bpy.types.Action) -> dict:
    """Return what a clean action holds."""
    old, new = keys(armature, recorded), keys(armature, action)
    return {
        "old": recorded.name,
        "new": action.name,
        "kept": recorded.use_fake_user,
        "changed": sorted({path.split('"')[1] for path in new if new[path] != old.get(path)}),
        "gone": sorted(set(old) - set(new)),
        "markers": [[marker.frame, marker.name] for marker in action.pose_markers],
        "notices": [[notice.text, notice.frame if notice.timed else None] for notice in action.adapt_mimic.notices],
        "summary": action.adapt_mimic.summary,
        "influences": [constraint.influence for bone in armature.pose.bones for constraint in bone.constraints],
        "panel_after": drawn(armature),
    }


class Drawn:
    """Stands for a layout of Blender's: notes what is drawn, and checks the names of operators, properties and icons."""

    def __init__(self, lines: list[str]) -> None:
        """Note everything in some lines."""
        self.lines = lines

    def label(self, text: str = "", icon: str = "NONE") -> None:
        """Note a text."""
        assert icon in bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items
        self.lines.append(text)

    def prop(self, data: object, name: str, expand: bool = False, **_others: object) -> None:
        """Note a property."""
        self.lines.append(f"{name}={getattr(data, name)}")

    def operator(self, name: str, text: str = "", icon: str = "NONE") -> SimpleNamespace:
        """Note a button."""
        assert icon in bpy.types.UILayout.bl_rna.functions["operator"].parameters["icon"].enum_items
        assert getattr(bpy.ops.adapt_mimic, name.split(".")[1]).get_rna_type()
        self.lines.append(f"[{text or name}]")
        return SimpleNamespace()

    def progress(self, factor: float, type: str, text: str) -> None:
        """Note a bar."""
        assert 0.0 <= factor <= 1.0
        assert type == "BAR"
        self.lines.append(text)

    def column(self, **_others: object) -> "Drawn":
        """Return this layout."""
        return self

    row = box = column


def drawn(armature: bpy.types.Object) -> list[str]:
    """Return what the panel shows for an armature."""
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))  # which is 0 without a window
    context = SimpleNamespace(object=armature, scene=bpy.context.scene, region=SimpleNamespace(width=400), preferences=preferences)
    lines: list[str] = []
    bpy.types.VIEW3D_PT_adapt_mimic.draw(SimpleNamespace(layout=Drawn(lines)), context)
    return lines


if __name__ == "__main__":
    main(Path(sys.argv[1]))
