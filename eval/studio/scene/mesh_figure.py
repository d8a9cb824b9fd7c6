"""A performer's mesh in the scene: it is sent once, and the browser skins it by the poses of its bones."""

import numpy as np
import viser

from eval.studio.scene.mesh_poses import RestMesh
from eval.viewer.colours import Colour

_NO_TURN = (1.0, 0.0, 0.0, 0.0)


class MeshFigure:
    """A performer's mesh of the scene.

    Attributes:
        node: The mesh.
    """

    def __init__(self, scene: viser.SceneApi, path: str, mesh: RestMesh, colour: Colour) -> None:
        """Add the mesh in its rest pose.

        Args:
            scene: Scene of a tab.
            path: Name of the figure's node.
            mesh: Mesh on B bones.
            colour: Colour of the mesh.
        """
        self._frame, self._is_shown = scene.add_frame(path, show_axes=False), True
        self.node = scene.add_mesh_skinned(
            f"{path}/skin",
            mesh.vertices,
            mesh.faces,
            bone_wxyzs=np.tile(_NO_TURN, (len(mesh.bones), 1)),
            bone_positions=mesh.bones,
            skin_weights=mesh.weights,
            color=colour,
            side="double",  # clothes and hair are seen from both sides
        )

    @property
    def is_shown(self) -> bool:
        """Whether the figure is seen."""
        return self._is_shown

    def place(self, offset: np.ndarray, shown: bool) -> None:
        """Put the figure aside by ``offset`` [m], and show or hide it."""
        self._frame.position, self._frame.visible, self._is_shown = offset, shown, shown

    def pose(self, positions: np.ndarray, rotations: np.ndarray) -> None:
        """Pose the figure by the places (B, 3) [m] and the rotations against the rest pose, wxyz (B, 4), of its bones."""
        for bone, position, rotation in zip(self.node.bones, positions, rotations, strict=True):
            bone.position, bone.wxyz = position, rotation

    def remove(self) -> None:
        """Take the figure out of the scene."""
        self._frame.remove()
