"""The 3D scene of one tab: ground, light, the figures before and after, and what is drawn on and under them.

Everything hangs on one node, the world. Where the view follows the figure the world moves, and not the camera, which is the user's alone.
"""

from collections.abc import Callable

import numpy as np
import viser
from scipy.ndimage import gaussian_filter1d

from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES, HEAD_BODY
from datasets.motion.rotation import heading
from eval.studio.scene.clip_tracks import ClipTracks
from eval.studio.scene.footprints import add_footprints
from eval.studio.scene.humanoid_figure import HumanoidFigure
from eval.studio.scene.mesh_figure import MeshFigure
from eval.studio.scene.mesh_poses import rest_mesh
from eval.studio.scene.skeleton_figure import SkeletonFigure
from eval.studio.state.view_options import GHOST, HUMANOID, MESH, ONLY_AFTER, ONLY_BEFORE, SIDE_BY_SIDE, SKELETON, ViewOptions
from eval.viewer.colours import AFTER, BEFORE, CENTRE_OF_MASS, FOOT_COLOURS, FOOT_OF_BODY, MISALIGNED, UNSURE, Colour, blend
from eval.viewer.ground import add_ground, add_lights

WORLD = "/world"
_NAMES = {"before": "recorded", "after": "cleaned"}
_ASIDE_M = 0.65  # of each of two figures that stand side by side
_GHOST_OPACITY = 0.35
_FOLLOW_STD_S = 0.35  # of the Gaussian mean of the path that the view follows
_BALL_M = 0.035  # radius of a centre of mass
_NAME_HEIGHT_M = 0.36  # of a figure's name above its head's joint


class Stage:
    """Scene of one tab."""

    def __init__(self, scene: viser.SceneApi, on_body: Callable[[str], None] = lambda _: None) -> None:
        """Add ground and light; ``on_body`` is called with the name of a body that is clicked."""
        self._scene, self._on_body = scene, on_body
        self._world = scene.add_frame(WORLD, show_axes=False)
        add_ground(scene, WORLD)
        self._sun = add_lights(scene)
        self._tracks: ClipTracks | None = None
        self._options = ViewOptions()
        self._humanoids: list[HumanoidFigure] = []
        self._skeletons: list[SkeletonFigure] = []
        self._meshes: list[MeshFigure] = []
        self._balls: list[viser.IcosphereHandle] = []
        self._lines: list[viser.LineSegmentsHandle] = []
        self._marks: viser.SceneNodeHandle | None = None
        self._labels: list[viser.LabelHandle] = []
        self._names: list[viser.LabelHandle] = []
        self._path = np.zeros((1, 3))
        self._side = np.zeros(3)  # unit vector to the first figure's left

    def show(self, tracks: ClipTracks | None, options: ViewOptions) -> None:
        """Show other tracks, or show them otherwise; nothing of a clip where there are none."""
        is_other = tracks is None or self._tracks is None or tracks.session is not self._tracks.session
        is_new = tracks is not self._tracks or options.contacts != self._options.contacts
        self._tracks, self._options = tracks, ViewOptions(**vars(options))
        if tracks is None:
            self._clear()
            return
        if is_other:
            self._clear()
            self._enter(tracks)
        if options.figure == SKELETON and not self._skeletons:
            self._add_skeletons(tracks)
        if options.figure == MESH and not self._meshes:
            self._add_meshes(tracks)
        if is_new:
            self._add_footprints(tracks)
        self._add_labels(tracks)
        self._arrange()

    def draw(self, time_s: float) -> None:
        """Draw the frame at a time of the file [s]."""
        if self._tracks is None:
            return
        tracks, options = self._tracks, self._options
        since = time_s - tracks.session.start_s
        frame = int(np.clip(round(since * tracks.before.fps), 0, len(tracks.before) - 1))
        if options.follows:
            self._world.position = -self._path[min(frame, len(self._path) - 1)]
        if options.figure == HUMANOID:
            for humanoid, motion in zip(self._humanoids, (tracks.before, tracks.after), strict=True):
                if humanoid.is_shown:
                    humanoid.pose(motion.root_position[frame], motion.local_rotations[frame])
            self._humanoids[1].paint(self._colours(tracks, frame))
        else:
            motion = tracks.session.performer.motion
            self._pose_performer(tracks, int(np.clip(round(since * motion.fps), 0, len(motion) - 1)))
        if options.centre_of_mass:
            for ball, line, centre in zip(self._balls, self._lines, tracks.centres[:, frame], strict=True):
                ball.position, line.position = centre, (centre[0], centre[1], 0.0)
                line.scale = (1.0, 1.0, max(float(centre[2]), 1e-3))

    def _pose_performer(self, tracks: ClipTracks, frame: int) -> None:
        """Pose the performer's skeletons or meshes, by a frame of the file."""
        if self._options.figure == SKELETON:
            for skeleton, joints in zip(self._skeletons, (tracks.joints_before, tracks.joints_after), strict=True):
                skeleton.pose(joints[frame])
        else:
            for mesh, (positions, rotations) in zip(self._meshes, (tracks.bones_before, tracks.bones_after), strict=True):
                if mesh.is_shown:
                    mesh.pose(positions[frame], rotations[frame])

    def _enter(self, tracks: ClipTracks) -> None:
        """Add the figures of another clip."""
        for name, colour in (("before", BEFORE), ("after", AFTER)):
            self._humanoids.append(HumanoidFigure(self._scene, f"{WORLD}/{name}", colour))
            self._humanoids[-1].on_click(self._on_body)
            head = self._humanoids[-1].paths[HEAD_BODY]
            self._names.append(self._scene.add_label(f"{head}/name", _NAMES[name], position=(0.0, 0.0, _NAME_HEIGHT_M)))
            self._balls.append(self._scene.add_icosphere(f"{WORLD}/{name}/centre", _BALL_M, CENTRE_OF_MASS, visible=False))
            upright = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
            self._lines.append(
                self._scene.add_line_segments(
                    f"{WORLD}/{name}/plumb", upright, CENTRE_OF_MASS, thickness=2.0, thickness_units="screen", visible=False
                )
            )
        root = tracks.before.root_position * (1.0, 1.0, 0.0)
        self._path = gaussian_filter1d(root, _FOLLOW_STD_S * tracks.before.fps, axis=0, mode="nearest")
        yaw = float(heading(tracks.before.local_rotations[0, 0]))
        self._side = np.array([-np.sin(yaw), np.cos(yaw), 0.0])

    def _add_skeletons(self, tracks: ClipTracks) -> None:
        """Add the performer's skeleton before and after."""
        skeleton = tracks.session.performer.motion.skeleton
        for name, colour in (("before", BEFORE), ("after", AFTER)):
            path = f"{WORLD}/{name} skeleton"
            self._skeletons.append(SkeletonFigure(self._scene, path, skeleton, tracks.joints_before[0], colour, None))

    def _add_meshes(self, tracks: ClipTracks) -> None:
        """Add the performer's mesh before and after."""
        skinned = tracks.session.bvh.stated.mesh
        assert skinned
        mesh = rest_mesh(tracks.session, skinned)
        for name, colour in (("before", BEFORE), ("after", AFTER)):
            self._meshes.append(MeshFigure(self._scene, f"{WORLD}/{name} mesh", mesh, colour))

    def _add_footprints(self, tracks: ClipTracks) -> None:
        """Draw the footprints of the cleaned clip anew."""
        if self._marks:
            self._marks.remove()
        self._marks = add_footprints(self._scene, f"{WORLD}/footprints", *tracks.footprints) if self._options.contacts else None

    def _add_labels(self, tracks: ClipTracks) -> None:
        """Label the misaligned segments."""
        for label in self._labels:
            label.remove()
        self._labels.clear()
        if self._options.misalignments and self._options.figure == HUMANOID and tracks.result:
            for one in tracks.result.misalignments:
                path = self._humanoids[0].paths[BODY_NAMES.index(one.body)]
                self._labels.append(self._scene.add_label(f"{path}/misaligned", f"{one.text} {one.degrees:.0f}°"))

    def _arrange(self) -> None:
        """Put the figures where the options want them."""
        chosen, tracks = self._options.comparison, self._tracks
        assert tracks
        if tracks.result is None:
            chosen = ONLY_BEFORE
        self._sun.cast_shadow = self._options.shadows
        for index in range(len(self._humanoids)):
            self._arrange_figure(index, chosen)
        colours = [BEFORE] * BODY_COUNT
        if self._options.misalignments and tracks.result:
            for one in tracks.result.misalignments:
                colours[BODY_NAMES.index(one.body)] = MISALIGNED
        self._humanoids[0].paint(colours)

    def _arrange_figure(self, index: int, chosen: str) -> None:
        """Put the figures of the recording (0) or of the cleaned clip (1) where they are wanted, and show the one that is."""
        humanoid, figure = self._humanoids[index], self._options.figure
        shown, is_ghost = chosen != (ONLY_AFTER, ONLY_BEFORE)[index], index == 0 and chosen == GHOST
        offset = ((-_ASIDE_M, _ASIDE_M)[index] if chosen == SIDE_BY_SIDE else 0.0) * self._side
        humanoid.place(offset, shown)
        for node in humanoid.nodes:
            node.visible = figure == HUMANOID
        for skeleton in self._skeletons[index : index + 1]:
            skeleton.place(offset, shown and figure == SKELETON)
        meshes = self._meshes[index : index + 1]
        for mesh in meshes:
            mesh.place(offset, shown and figure == MESH)
        for node in (*humanoid.nodes, *(mesh.node for mesh in meshes)):
            node.cast_shadow = self._options.shadows and not is_ghost
            node.opacity = _GHOST_OPACITY if is_ghost else None
        self._names[index].visible = chosen == SIDE_BY_SIDE
        for node in (self._balls[index], self._lines[index]):
            node.visible = self._options.centre_of_mass
        if index == 1 and self._marks:
            self._marks.position = offset

    def _colours(self, tracks: ClipTracks, frame: int) -> list[Colour]:
        """Return the colours of the cleaned figure's bodies in a frame."""
        result = tracks.result
        if result is None:
            return [AFTER] * BODY_COUNT
        usual = blend(UNSURE, AFTER, float(result.confidence[frame])) if self._options.trust else AFTER
        standing = result.contacts[frame] if self._options.contacts else (False, False)
        feet = [FOOT_COLOURS[FOOT_OF_BODY[body]] if body in FOOT_OF_BODY else None for body in range(BODY_COUNT)]
        return [foot if foot and standing[FOOT_OF_BODY[body]] else usual for body, foot in enumerate(feet)]

    def _clear(self) -> None:
        """Take a clip's figures out of the scene."""
        for node in (*self._labels, *self._humanoids, *self._skeletons, *self._meshes, *([self._marks] if self._marks else [])):
            node.remove()
        self._marks = None
        for several in (self._labels, self._names, self._humanoids, self._skeletons, self._meshes, self._balls, self._lines):
            several.clear()
