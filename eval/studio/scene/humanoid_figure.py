"""The humanoid in the scene: one mesh for each body, which hangs on its parent's, so that a pose is 20 rotations and one place."""

from collections.abc import Callable, Sequence

import numpy as np
import viser

from datasets.motion.humanoid import BODIES, BODY_NAMES
from eval.viewer.colours import Colour
from eval.viewer.mannequin import body_meshes


class HumanoidFigure:
    """A humanoid of the scene.

    Attributes:
        nodes: Mesh of each body, in the order of the bodies.
        paths: Name of each body's node, under which what follows the body may hang.
    """

    def __init__(self, scene: viser.SceneApi, path: str, colour: Colour, opacity: float | None = None) -> None:
        """Add the meshes.

        Args:
            scene: Scene of a tab.
            path: Name of the figure's node.
            colour: Colour of all bodies.
            opacity: Opacity; None for a solid figure.
        """
        self._frame = scene.add_frame(path, show_axes=False)
        self._is_shown, self._colours = True, [colour] * len(BODIES)
        self.nodes: list[viser.MeshHandle] = []
        self.paths: list[str] = []
        for body, mesh in zip(BODIES, body_meshes(), strict=True):
            above = path if body.parent is None else self.paths[BODY_NAMES.index(body.parent)]
            self.paths.append(f"{above}/{body.name}")
            self.nodes.append(
                scene.add_mesh_simple(
                    self.paths[-1],
                    mesh.vertices,
                    mesh.faces,
                    color=colour,
                    opacity=opacity,
                    cast_shadow=opacity is None,
                    receive_shadow=opacity is None,
                    position=body.offset,
                )
            )

    @property
    def is_shown(self) -> bool:
        """Whether the figure is seen."""
        return self._is_shown

    def on_click(self, answer: Callable[[str], None]) -> None:
        """Call ``answer`` with the name of a body that is clicked."""
        for name, node in zip(BODY_NAMES, self.nodes, strict=True):
            node.on_click(lambda _, name=name: answer(name))

    def place(self, offset: np.ndarray, shown: bool) -> None:
        """Put the figure aside by ``offset`` [m], and show or hide it."""
        self._frame.position, self._frame.visible, self._is_shown = offset, shown, shown

    def pose(self, root_position: np.ndarray, local_rotations: np.ndarray) -> None:
        """Pose the figure by the place of its pelvis (3,) [m] and the rotations of its bodies against their parents (20, 4)."""
        self.nodes[0].position = root_position
        for node, rotation in zip(self.nodes, local_rotations, strict=True):
            node.wxyz = rotation

    def paint(self, colours: Sequence[Colour]) -> None:
        """Colour the bodies."""
        for body, (node, colour) in enumerate(zip(self.nodes, colours, strict=True)):
            if colour != self._colours[body]:
                node.color = colour
        self._colours = list(colours)

    def remove(self) -> None:
        """Take the figure out of the scene."""
        self._frame.remove()
