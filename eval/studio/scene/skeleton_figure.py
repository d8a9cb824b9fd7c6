"""A performer's own skeleton in the scene: all bones in one batch, as a pose of 60 joints would take 60 messages else."""

import numpy as np
import viser

from datasets.motion.rotation import normalise
from datasets.motion.skeleton import Skeleton
from eval.viewer.colours import Colour

MIN_BONE_M = 0.004  # of a bone that is drawn
_WIDTH_SHARE, _MIN_WIDTH_M, _MAX_WIDTH_M = 0.2, 0.012, 0.055  # of a bone's length, and its limits
_WAIST = 0.16  # share of the length at which a bone is widest
_RING = [(0.5, 0.0, _WAIST), (0.0, 0.5, _WAIST), (-0.5, 0.0, _WAIST), (0.0, -0.5, _WAIST)]
_VERTICES = np.array([(0.0, 0.0, 0.0), *_RING, (0.0, 0.0, 1.0)])  # of a bone along z
_FACES = np.array([face for one in range(4) for face in ((0, 1 + (one + 1) % 4, 1 + one), (5, 1 + one, 1 + (one + 1) % 4))])


class SkeletonFigure:
    """A performer's skeleton of the scene."""

    def __init__(
        self, scene: viser.SceneApi, path: str, skeleton: Skeleton, joints: np.ndarray, colour: Colour, opacity: float | None
    ) -> None:
        """Add the bones.

        Args:
            scene: Scene of a tab.
            path: Name of the figure's node.
            skeleton: Skeleton of J joints.
            joints: Positions of the joints in one frame [m], shape (J, 3).
            colour: Colour of the bones.
            opacity: Opacity; None for a solid figure.
        """
        parents = np.array(skeleton.parents)
        lengths = np.linalg.norm(joints - joints[np.maximum(parents, 0)], axis=-1)
        self._ends = np.flatnonzero((parents >= 0) & (lengths > MIN_BONE_M))
        self._starts = parents[self._ends]
        widths = np.clip(_WIDTH_SHARE * lengths[self._ends], _MIN_WIDTH_M, _MAX_WIDTH_M)
        self._frame = scene.add_frame(path, show_axes=False)
        places, rotations = self._bones(joints)
        self._node = scene.add_batched_meshes_simple(
            f"{path}/bones",
            _VERTICES,
            _FACES,
            batched_wxyzs=rotations,
            batched_positions=places,
            batched_scales=np.stack([widths, widths, lengths[self._ends]], axis=-1),
            batched_colors=colour,
            opacity=opacity,
            flat_shading=True,
            lod="off",
        )

    def place(self, offset: np.ndarray, shown: bool) -> None:
        """Put the figure aside by ``offset`` [m], and show or hide it."""
        self._frame.position, self._frame.visible = offset, shown

    def pose(self, joints: np.ndarray) -> None:
        """Pose the figure by the positions of its joints [m], shape (J, 3)."""
        self._node.batched_positions, self._node.batched_wxyzs = self._bones(joints)

    def remove(self) -> None:
        """Take the figure out of the scene."""
        self._frame.remove()

    def _bones(self, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the places (N, 3) [m] and rotations (N, 4) of the bones, by the positions of the joints (J, 3) [m]."""
        starts = joints[self._starts]
        return starts.astype(np.float32), rotations_from_z(joints[self._ends] - starts).astype(np.float32)


def rotations_from_z(directions: np.ndarray) -> np.ndarray:
    """Return the shortest rotations, wxyz (N, 4), of the z axis to directions (N, 3)."""
    along = directions / np.maximum(np.linalg.norm(directions, axis=-1, keepdims=True), 1e-9)
    x, y, z = along.T
    turns = np.stack([1.0 + z, -y, x, np.zeros_like(z)], axis=-1)
    turns[z < -1.0 + 1e-9] = (0.0, 1.0, 0.0, 0.0)  # straight down: half a turn about x
    return normalise(turns)
