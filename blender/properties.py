"""What the add-on keeps: the command's path in the preferences, the switches in the scene, what was found with each cleaned action."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations that are calls.

import bpy  # type: ignore[import-not-found]  # Blender's own module

from .command import COMMAND, QUALITIES

SEARCHES = (
    "A search about as long as the clip on two cores",
    "An optimisation about six times as long",
    "One about eight times as long",
)
ITEMS = [(quality, quality.capitalize(), search) for quality, search in zip(QUALITIES, SEARCHES, strict=True)]


class AdaptMimicPreferences(bpy.types.AddonPreferences):
    """Preferences of the add-on."""

    bl_idname = __package__

    command: bpy.props.StringProperty(
        name="Command",
        description=f"Path of {COMMAND}; empty to look for it on the PATH",
        subtype="FILE_PATH",
    )

    def draw(self, _context: bpy.types.Context) -> None:
        """Draw the preferences."""
        self.layout.prop(self, "command", placeholder=f"{COMMAND} on the PATH")


class AdaptMimicSettings(bpy.types.PropertyGroup):
    """Switches of a cleaning, in the scene."""

    quality: bpy.props.EnumProperty(name="Quality", description="How long the simulation searches", items=ITEMS, default="good")
    restore: bpy.props.BoolProperty(name="Restore poses", description="Take a suit's faults out of the poses", default=True)
    physics: bpy.props.BoolProperty(name="Physics", description="Let a simulated body perform the clip", default=True)
    zero_ground: bpy.props.BoolProperty(
        name="Ground on Z = 0", description="Put the ground that is found under the feet on the grid, instead of leaving it at its height"
    )
    mapping: bpy.props.StringProperty(
        name="Joint Names",
        description="YAML file that names the joints, as in 'thigh_l: LeftUpLeg', where they are not found by their own names",
        subtype="FILE_PATH",
    )


class AdaptMimicNotice(bpy.types.PropertyGroup):
    """A line about a cleaned action."""

    text: bpy.props.StringProperty(name="Text")
    timed: bpy.props.BoolProperty(name="Has a frame")
    frame: bpy.props.IntProperty(name="Frame")


class AdaptMimicConstraint(bpy.types.PropertyGroup):
    """A constraint that has no influence in a cleaned action, and the influence that it had."""

    path: bpy.props.StringProperty(name="Path from the armature")
    influence: bpy.props.FloatProperty(name="Influence")


class AdaptMimicCleaning(bpy.types.PropertyGroup):
    """What was done to an action: kept with it, so that undo and the file have it."""

    source: bpy.props.PointerProperty(name="Recorded", type=bpy.types.Action)
    summary: bpy.props.StringProperty(name="Summary")
    notices: bpy.props.CollectionProperty(type=AdaptMimicNotice)
    constraints: bpy.props.CollectionProperty(type=AdaptMimicConstraint)


CLASSES = (AdaptMimicPreferences, AdaptMimicSettings, AdaptMimicNotice, AdaptMimicConstraint, AdaptMimicCleaning)


def command_in_preferences() -> str:
    """Return the path of the command in the preferences; empty where there is none."""
    addon = bpy.context.preferences.addons.get(__package__)
    return addon.preferences.command if addon and addon.preferences else ""
