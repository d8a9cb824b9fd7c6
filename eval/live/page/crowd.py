"""The users' figures: one batched mesh for each of the 20 bodies, so that a frame is 40 arrays, however many users there are."""

from collections.abc import Mapping, Sequence

import numpy as np
import viser

from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES, HEAD_BODY, SKELETON
from datasets.motion.skeleton import forward_kinematics
from eval.live.messages import CALIBRATING, LIVE, STATES, UserView
from eval.viewer.colours import FOOT_COLOURS, FOOT_OF_BODY, NOT_YET, Colour, blend, in_linear, user_colour
from eval.viewer.mannequin import body_meshes

T_POSE = "stand in a T-pose, arms straight out"
_PALE = 0.45  # share of a user's own colour while the user is not live
_LABEL_HEIGHT_M = 0.4  # above the head's joint


class Crowd:
    """Figures of users, each with a label.

    Attributes:
        nodes: Mesh of each body, an instance for each user; empty where nobody is.
        labels: Label above each user, by user number.
    """

    def __init__(self, scene: viser.SceneApi, path: str) -> None:
        """Start with nobody, below the node ``path``."""
        self._scene, self._path = scene, path
        self._users: tuple[int, ...] = ()
        self.nodes: list[viser.BatchedMeshHandle] = []
        self.labels: dict[int, viser.LabelHandle] = {}

    def draw(self, views: Mapping[int, UserView]) -> None:
        """Draw the last frame of each user, by user number, and nobody else."""
        if tuple(views) != self._users:
            self._admit(tuple(views))
        if not views:
            return
        seen = list(views.values())
        positions, rotations = body_places(seen)
        colours = in_linear(np.array([body_colours(user, view) for user, view in views.items()]))
        scales = np.array([view.scale for view in seen])
        for body, node in enumerate(self.nodes):
            node.batched_positions, node.batched_wxyzs = positions[:, body], rotations[:, body]
            node.batched_colors, node.batched_scales = colours[:, body], scales
        for (user, view), head in zip(views.items(), positions[:, HEAD_BODY], strict=True):
            self.labels[user].position = (*head[:2], head[2] + _LABEL_HEIGHT_M * view.scale)
            self.labels[user].text = label_text(view)

    def _admit(self, users: tuple[int, ...]) -> None:
        """Make figures for these users, instead of those that there were."""
        for user in set(self._users) - set(users):
            self.labels.pop(user).remove()
        for user in users:
            if user not in self.labels:
                self.labels[user] = self._scene.add_label(f"{self._path}/label {user}", "", anchor="bottom-center")
        for node in self.nodes:
            node.remove()
        self.nodes = [self._add_body(body, len(users)) for body in range(BODY_COUNT)] if users else []
        self._users = users

    def _add_body(self, body: int, count: int) -> viser.BatchedMeshHandle:
        """Add a body's mesh for ``count`` users."""
        mesh = body_meshes()[body]
        return self._scene.add_batched_meshes_simple(
            f"{self._path}/{BODY_NAMES[body]}",
            mesh.vertices,
            mesh.faces,
            np.tile((1.0, 0.0, 0.0, 0.0), (count, 1)),
            np.zeros((count, 3)),
            batched_scales=np.ones(count),
            batched_colors=np.zeros((count, 3), dtype=np.uint8),
            lod="off",
        )


def body_places(views: Sequence[UserView]) -> tuple[np.ndarray, np.ndarray]:
    """Return positions [m], shape (n, 20, 3), and rotations, wxyz, shape (n, 20, 4), of the bodies of n users in the world."""
    offsets = np.stack([SKELETON.offsets * view.scale for view in views])
    offsets[:, 0] = [view.root for view in views]
    return forward_kinematics(SKELETON.parents, offsets, np.stack([view.rotations for view in views]))


def body_colours(user: int, view: UserView) -> list[Colour]:
    """Return the colours of the 20 bodies: the user's own, pale before the user is live, and a foot's own where it stands."""
    own = blend(NOT_YET, user_colour(user), 1.0 if view.state == STATES[LIVE] else _PALE, levels=100)
    standing = {body: FOOT_COLOURS[foot] for body, foot in FOOT_OF_BODY.items() if view.contacts[foot]}
    return [standing.get(body, own) for body in range(BODY_COUNT)]


def label_text(view: UserView) -> str:
    """Return a user's name and state, and what to do where that needs saying."""
    return f"{view.name}: {view.state}" + (f"; {T_POSE}" if view.state == STATES[CALIBRATING] else "")
