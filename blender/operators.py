"""Operators: clean, cancel, before or after, go to a frame."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations that are calls.

from collections.abc import Iterator
from typing import Any

import bpy  # type: ignore[import-not-found]  # Blender's own module

from .addon_error import AddonError
from .armature_sampling import MODES
from .cleaning import Cleaning, Status, run_for, run_to_the_end
from .command import STAGES, CleaningCall, find_command
from .properties import command_in_preferences

TICK_S = 0.1  # between two turns of a cleaning
TURN_S = 0.04  # that a turn takes of Blender's time


class Running:
    """The cleaning that runs in this Blender, and what became of the last one.

    Attributes:
        cleaning: The cleaning that runs; None where none does.
        error: What the last one could not do; empty if it could.
    """

    cleaning: Cleaning | None = None
    error: str = ""


def selected_armature(context: Any) -> Any:
    """Return the active object if it is an armature that is not being edited, otherwise None."""
    active = context.object
    return active if active and active.type == "ARMATURE" and active.mode in MODES else None


class ADAPT_MIMIC_OT_clean(bpy.types.Operator):  # noqa: N801  # Blender's way to name operators
    """Clean the armature's action into a new one beside it; the recorded action stays."""

    bl_idname = "adapt_mimic.clean"
    bl_label = "Clean"
    bl_description = "Clean the armature's action into a new action beside it; the recorded one stays"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012  # Blender's own form

    _timer: Any = None
    _cleaning: Any = None  # its own: the button may have stopped it, and begun another
    _steps: Iterator[Status] = iter(())

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return whether there is an armature, and no cleaning runs."""
        return Running.cleaning is None and selected_armature(context) is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Clean and return when it is done, as for scripts."""
        try:
            self._cleaning = new_cleaning(context)
            run_to_the_end(self._cleaning)
        except AddonError as error:
            return self._fail(context, error)
        return self._done(context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Begin to clean; Blender calls ``modal`` from then on."""
        try:
            Running.cleaning = self._cleaning = new_cleaning(context)
        except AddonError as error:
            return self._fail(context, error)
        self._steps = self._cleaning.steps()
        self._timer = context.window_manager.event_timer_add(TICK_S, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Go on with the cleaning at each tick of the timer; every other event is the user's."""
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if Running.cleaning is not self._cleaning:  # stopped by its button
            self._clear(context)
            return {"CANCELLED"}
        try:
            done = run_for(self._steps, TURN_S)
        except AddonError as error:
            self._clear(context)
            return self._fail(context, error)
        except BaseException:
            self._clear(context)
            raise
        redraw(context)
        if not done:
            return {"PASS_THROUGH"}
        self._clear(context)
        return self._done(context)

    def cancel(self, context: bpy.types.Context) -> None:
        """Stop the cleaning, which Blender asks for where another file is opened or it ends."""
        self._clear(context)

    def _clear(self, context: bpy.types.Context) -> None:
        if self._timer:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        if Running.cleaning is self._cleaning:
            stop_running()
        redraw(context)

    def _fail(self, context: bpy.types.Context, error: AddonError) -> set[str]:
        Running.error = str(error)
        if self._cleaning and self._cleaning.draft:
            context.scene.adapt_mimic.mapping = str(self._cleaning.draft)
        self.report({"ERROR"}, Running.error)
        return {"CANCELLED"}

    def _done(self, context: bpy.types.Context) -> set[str]:
        action = context.object.animation_data.action if selected_armature(context) else None
        self.report({"INFO"}, action.adapt_mimic.summary if action and action.adapt_mimic.summary else "Cleaned")
        return {"FINISHED"}


class ADAPT_MIMIC_OT_cancel(bpy.types.Operator):  # noqa: N801
    """Stop the cleaning that runs; nothing is changed."""

    bl_idname = "adapt_mimic.cancel"
    bl_label = "Cancel"
    bl_description = "Stop the cleaning; nothing is changed"
    bl_options = {"INTERNAL"}  # noqa: RUF012

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Return whether a cleaning runs."""
        return Running.cleaning is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Stop it."""
        stop_running()
        redraw(context)
        return {"FINISHED"}


class ADAPT_MIMIC_OT_compare(bpy.types.Operator):  # noqa: N801
    """Change between the recorded and the clean action."""

    bl_idname = "adapt_mimic.compare"
    bl_label = "Before / After"
    bl_description = "Change between the recorded action and the clean one"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return whether the armature's action has a counterpart."""
        armature = selected_armature(context)
        return bool(armature and armature.animation_data and counterpart(armature.animation_data.action))

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Give the armature the counterpart of its action, and constraints the influence that they have with it."""
        armature = selected_armature(context)
        animation = armature.animation_data
        shown, slot = animation.action, animation.action_slot
        other = counterpart(shown)
        animation.action, animation.action_slot = other, other.slots[slot.identifier]
        for held in shown.adapt_mimic.constraints if shown.adapt_mimic.source == other else ():
            armature.path_resolve(held.path).influence = held.influence
        return {"FINISHED"}


class ADAPT_MIMIC_OT_go_to(bpy.types.Operator):  # noqa: N801
    """Go to the frame of which a notice speaks."""

    bl_idname = "adapt_mimic.go_to"
    bl_label = "Go to Frame"
    bl_description = "Go to the frame of this notice"
    bl_options = {"INTERNAL"}  # noqa: RUF012

    frame: bpy.props.IntProperty()

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Set the scene's frame."""
        context.scene.frame_set(self.frame)
        return {"FINISHED"}


def new_cleaning(context: Any) -> Cleaning:
    """Return a cleaning of the active armature with the scene's settings.

    Raises:
        AddonError: If the armature cannot be cleaned, or the command is not there.
    """
    Running.error = ""
    settings = context.scene.adapt_mimic
    without = tuple(stage for stage in STAGES if not getattr(settings, stage))
    mapping = bpy.path.abspath(settings.mapping) if settings.mapping else ""
    call = CleaningCall(find_command(command_in_preferences()), settings.quality, without, mapping, settings.zero_ground)
    return Cleaning(selected_armature(context), call)


def counterpart(action: Any) -> Any:
    """Return the recorded action of a clean one, or the newest clean one of a recorded action; None where there is none."""
    if action is None:
        return None
    if action.adapt_mimic.source:
        return action.adapt_mimic.source
    clean = [one for one in bpy.data.actions if one.adapt_mimic.source == action]
    return max(clean, key=lambda one: one.session_uid, default=None)


def stop_running() -> None:
    """Stop the cleaning that runs, if any."""
    if Running.cleaning:
        Running.cleaning.stop()
        Running.cleaning = None


def redraw(context: Any) -> None:
    """Have the panels drawn anew."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


CLASSES = (ADAPT_MIMIC_OT_clean, ADAPT_MIMIC_OT_cancel, ADAPT_MIMIC_OT_compare, ADAPT_MIMIC_OT_go_to)
