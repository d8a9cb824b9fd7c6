"""Picture of a retargeted clip: performer and humanoid over each other from the side and the front, and the feet's height."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from datasets.motion.humanoid import BODIES, BODY_COM_OFFSETS, BODY_NAMES
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import heading, rotate
from datasets.retarget.retarget import Retargeted
from datasets.retarget.retarget_error import RetargetMetrics, performer_points

POSES = 8  # drawn side by side
SPACING = 1.3  # m, between poses
COLOURS = {"l": "tab:blue", "r": "tab:red"}
_PARENTS = {body.name: body.parent for body in BODIES}


def draw(retargeted: Retargeted, fidelity: RetargetMetrics, path: Path) -> None:
    """Draw a clip into a PNG file.

    Args:
        retargeted: Retargeted clip.
        fidelity: Measures of its retargeting.
        path: PNG file to write.
    """
    figure = Figure(figsize=(16, 11), layout="constrained")
    FigureCanvasAgg(figure)
    side, front, feet = figure.subplots(3, 1, height_ratios=(4, 4, 1.5))
    frames = np.linspace(0, len(retargeted.motion) - 1, POSES).round().astype(int)
    _poses(side, retargeted, frames, 0, "side, facing right")
    _poses(front, retargeted, frames, 1, "front, facing out of the picture")
    feet.plot(np.arange(len(retargeted.motion)) / retargeted.motion.fps, 100 * fidelity.lowest_foot, linewidth=1)
    feet.axhline(0.0, color="black", linewidth=0.5)
    feet.set(xlabel="time [s]", ylabel="lowest foot [cm]", xmargin=0)
    figure.suptitle(f"{retargeted.motion.name}: performer grey, humanoid blue (left) and red (right)")
    figure.savefig(path, dpi=70)


def _poses(axes: Axes, retargeted: Retargeted, frames: np.ndarray, view: int, title: str) -> None:
    """Draw the poses of some frames, each turned to face x, seen from its right (``view`` 0) or from its front (``view`` 1)."""
    positions, rotations = body_poses(retargeted.motion)
    performer = performer_points(retargeted)
    for place, frame in enumerate(frames):
        yaw = heading(rotations[frame, 0])

        def flat(point: np.ndarray, place: int = place, frame: int = frame, yaw: float = yaw) -> tuple[float, float]:
            x, y, z = point - positions[frame, 0] * (1.0, 1.0, 0.0)
            across = (np.cos(yaw) * x + np.sin(yaw) * y, np.cos(yaw) * y - np.sin(yaw) * x)[view]
            return SPACING * place + float(across), float(z)

        for body in performer:
            over = _PARENTS[body]
            while over is not None and over not in performer:
                over = _PARENTS[over]
            if over is not None:
                _line(axes, flat(performer[over][frame]), flat(performer[body][frame]), "0.6", 4.0)
        for index, body in enumerate(BODIES):
            here = positions[frame, index]
            colour = COLOURS.get(body.name[-1] if body.name[-2] == "_" else "", "tab:green")
            if body.parent is not None:
                _line(axes, flat(positions[frame, BODY_NAMES.index(body.parent)]), flat(here), colour, 1.5)
            if body.name[:4] in ("head", "hand", "toe_", "foot"):
                centre = here + 1.5 * rotate(rotations[frame, index], BODY_COM_OFFSETS[index])
                _line(axes, flat(here), flat(centre), colour, 1.5)
        axes.text(SPACING * place, -0.15, f"{frame / retargeted.motion.fps:.2f} s", ha="center")
    axes.axhline(0.0, color="black", linewidth=0.5)
    axes.set(aspect="equal", title=title, ylabel="height [m]", xticks=[])


def _line(axes: Axes, a: tuple[float, float], b: tuple[float, float], colour: str, width: float) -> None:
    """Draw a straight line."""
    axes.plot(*zip(a, b, strict=True), color=colour, linewidth=width, solid_capstyle="round")
