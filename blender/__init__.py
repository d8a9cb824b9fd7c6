"""Blender add-on: cleans the motion of an armature by the command ``adapt-mimic``, which runs in a process of its own.

Modules without ``bpy`` in them are imported without Blender, too: ``rotations``, ``bvh_motion``, ``bvh_text``, ``command``, ``events``.
"""


def register() -> None:
    """Register the add-on's classes with Blender, which calls this when the add-on is enabled."""
    from . import registration

    registration.register()


def unregister() -> None:
    """Stop a cleaning that runs and take the add-on's classes back, which Blender calls when the add-on is disabled."""
    from . import registration

    registration.unregister()
