"""Registers the add-on's classes and properties with Blender."""

import bpy  # type: ignore[import-not-found]  # Blender's own module

from . import operators, panel, properties

CLASSES = (*properties.CLASSES, *operators.CLASSES, *panel.CLASSES)


def register() -> None:
    """Register everything."""
    for one in CLASSES:
        bpy.utils.register_class(one)
    bpy.types.Scene.adapt_mimic = bpy.props.PointerProperty(type=properties.AdaptMimicSettings)
    bpy.types.Action.adapt_mimic = bpy.props.PointerProperty(type=properties.AdaptMimicCleaning)


def unregister() -> None:
    """Take everything back; a cleaning that runs is stopped."""
    operators.stop_running()
    del bpy.types.Action.adapt_mimic
    del bpy.types.Scene.adapt_mimic
    for one in reversed(CLASSES):
        bpy.utils.unregister_class(one)
