"""The panel in the 3D view's sidebar."""

import textwrap
from typing import Any

import bpy  # type: ignore[import-not-found]  # Blender's own module

from .operators import Running, counterpart, selected_armature

PIXELS_PER_LETTER = 7.0  # of Blender's font at the usual size
MIN_LETTERS = 24
MAX_NOTICES = 30


class VIEW3D_PT_adapt_mimic(bpy.types.Panel):  # noqa: N801  # Blender's way to name panels
    """Panel with the button, its switches, and what was found."""

    bl_idname = "VIEW3D_PT_adapt_mimic"
    bl_label = "Adapt Mimic"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Animation"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel."""
        layout, armature = self.layout, selected_armature(context)
        letters = letters_in_a_line(context)
        if Running.cleaning:
            status = Running.cleaning.status
            layout.progress(factor=status.share, type="BAR", text=status.text)
            layout.operator("adapt_mimic.cancel", icon="CANCEL")
            return
        settings = context.scene.adapt_mimic
        layout.row().prop(settings, "quality", expand=True)
        stages = layout.column(heading="Stages", align=True)
        stages.prop(settings, "restore")
        stages.prop(settings, "physics")
        layout.prop(settings, "zero_ground")
        layout.prop(settings, "mapping", placeholder="Found by name")
        layout.operator("adapt_mimic.clean", icon="ACTION")
        if armature is None:
            draw_lines(layout, "Select an armature, in Object or Pose Mode.", letters)
        if Running.error:
            draw_lines(layout.box(), Running.error, letters, icon="ERROR")
        if armature and armature.animation_data:
            draw_found(layout, armature.animation_data.action, letters)


def draw_found(layout: Any, action: Any, letters: int) -> None:
    """Draw what is known of an action that was cleaned, or from which a clean one was made."""
    if not counterpart(action):
        return
    kept = action.adapt_mimic
    layout.operator("adapt_mimic.compare", text="Show Before" if kept.source else "Show After", icon="UV_SYNC_SELECT")
    if not kept.source:
        return
    box = layout.box()
    draw_lines(box, kept.summary, letters, icon="CHECKMARK")
    for notice in kept.notices[:MAX_NOTICES]:
        row = box.row(align=True)
        draw_lines(row.column(align=True), notice.text, letters)
        if notice.timed:
            row.operator("adapt_mimic.go_to", text=str(notice.frame)).frame = notice.frame
    if len(kept.notices) > MAX_NOTICES:
        box.label(text=f"and {len(kept.notices) - MAX_NOTICES} more")


def letters_in_a_line(context: Any) -> int:
    """Return how many letters a line of the panel has room for."""
    return max(int(context.region.width / (PIXELS_PER_LETTER * context.preferences.system.ui_scale)) - 6, MIN_LETTERS)


def draw_lines(layout: Any, text: str, letters: int, icon: str = "NONE") -> None:
    """Draw a text in as many lines as it takes: Blender cuts what is wider than the panel."""
    column = layout.column(align=True)
    for number, line in enumerate(textwrap.wrap(text, letters)):
        column.label(text=line, icon=icon if number == 0 else "BLANK1" if icon != "NONE" else "NONE")


CLASSES = (VIEW3D_PT_adapt_mimic,)
