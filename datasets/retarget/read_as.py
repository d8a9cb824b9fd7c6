"""What a recording was taken for, in one line: axes, unit, rate, heading, ground, joints, and how well it is met."""

import numpy as np

from datasets.performer.performer_clip import name_of_unit
from datasets.retarget.retarget import Retargeted
from datasets.retarget.retarget_error import measure_retarget


def describe_reading(retargeted: Retargeted) -> str:
    """Return the line that says what a recording was taken for."""
    clip = retargeted.performer_clip
    error = 1e3 * float(np.nanmean(measure_retarget(retargeted).error_local))
    parts = [
        f"{clip.up_axis.upper()} up",
        *(["left and right exchanged"] if clip.reading.mirror else []),
        name_of_unit(clip.unit),
        f"{clip.motion.fps:g} fps",
        f"facing {facing(retargeted)}",
        f"ground at {retargeted.ground:.2f} m{', put on 0' if clip.reading.zero_ground else ''}",
        f"joints by name{' and mapping' if clip.reading.joints else ''}",
        f"retargeting error {error:.0f} mm",
    ]
    return f"read as: {', '.join(parts)}"


def facing(retargeted: Retargeted) -> str:
    """Return the axis of the file that is nearest to where the first frame faces, such as "+Z"."""
    ahead = retargeted.performer_clip.axes.T @ np.array([np.cos(retargeted.yaw), np.sin(retargeted.yaw), 0.0])
    axis = int(np.abs(ahead).argmax())
    return ("-" if ahead[axis] < 0.0 else "+") + "XYZ"[axis]
