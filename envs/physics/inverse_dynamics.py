"""Feed-forward angles of a clip: inverse dynamics with ground reaction forces, divided by the stiffness of the motors.

A PD motor needs an error to exert a torque: a leg that bears weight under the reference's own angles sinks, an arm that
swings lags behind. The torques of a clip can be computed beforehand; fed forward to the motors as further angles, they leave
to the policy what cannot be: balance.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import nnls

from configs.process_pool import map_on_cores
from datasets.library.motion_library import MotionLibrary
from datasets.motion.humanoid import BODIES, FOOT_AND_TOE_BODIES
from datasets.motion.kinematics import linear_velocity
from envs.physics.humanoid_mjcf import HINGE_KP, HINGE_KV, build_model

VELOCITY_SMOOTHING_S = 0.05  # s, standard deviation of the Gaussian before accelerations are taken
BEARING_HEIGHT_MARGIN_M = 0.08  # m, above the lowest sole point: points that are higher bear no force
MAX_GROUND_OFFSET_M = 0.05  # m; a pose whose lowest sole point is below this stands on the ground, even if it floats or sinks
EFFORT_HEIGHT_SCALE_M = 0.01  # m, height at which the effort of a sole point's force is sqrt(2) times that on the ground
FORCE_EFFORT_WEIGHT = 0.03  # of a newton on the ground against a residual newton on the root
TORQUE_WEIGHT_PER_M = 2.0  # 1/m, weight of the root's residual torque against its residual force
MAX_FEED_FORWARD_RAD = 1.0  # rad
PLANNED_FRICTION = 0.8  # well below the model's: forces near the limit would slip in the simulation
_EDGES = np.array([[x, y, 1.0] for x, y in PLANNED_FRICTION * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])])  # of the friction pyramid


def with_feed_forward(library: MotionLibrary, progress: Callable[[Sequence[Any]], Iterable[Any]] = iter) -> MotionLibrary:
    """Return the library with the angles of ``compute_feed_forward`` for each clip.

    Args:
        library: Packed clips.
        progress: Wraps the loop over the clips, such as a progress bar.
    """
    parts = [slice(clip.start, clip.start + clip.frames) for clip in library.clips]
    states = [(library.start_pose[part], library.start_vel[part]) for part in parts]
    found = map_on_cores(partial(_feed_forward_of, fps=library.fps), states, progress)
    return type(library).from_arrays(library.clips, library.arrays() | {"feed_forward": np.concat(found).astype(np.float32)}, library.fps)


def _feed_forward_of(states: tuple[np.ndarray, np.ndarray], fps: float) -> np.ndarray:
    """Return the feed-forward angles of a clip given by its poses and velocities."""
    return compute_feed_forward(*states, fps)


def compute_feed_forward(poses: np.ndarray, velocities: np.ndarray, fps: float) -> np.ndarray:
    """Return the angles to add to a clip's hinges so that PD motors exert the torques that the clip needs.

    The ground reaction forces act on the sole points near the ground, within friction and not negative, and minimise the
    residual of the root's six equations of motion.

    Args:
        poses: Generalised positions, shape (T, 50).
        velocities: Generalised velocities, shape (T, 49).
        fps: Frames per second.

    Returns:
        Angles [rad], at most ``MAX_FEED_FORWARD_RAD``, shape (T, 43).
    """
    smooth = gaussian_filter1d(velocities.astype(float), VELOCITY_SMOOTHING_S * fps, axis=0, mode="nearest")
    accelerations = linear_velocity(smooth, fps)
    body = _Body()
    torques = [body.torques(*frame) for frame in zip(poses, velocities, accelerations, strict=True)]
    return np.clip(np.array(torques) / HINGE_KP, -MAX_FEED_FORWARD_RAD, MAX_FEED_FORWARD_RAD)


class _Body:
    """The humanoid without contacts, and its sole points."""

    def __init__(self) -> None:
        self._model = build_model()
        self._model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_ACTUATION
        self._model.dof_damping[6:] -= HINGE_KV  # the motors' damping, which their targets compensate by leading ahead
        self._data = mujoco.MjData(self._model)
        self._soles = [(1 + b, point) for side in FOOT_AND_TOE_BODIES for b in side for point in _sole(b)]
        self._jacobian = np.zeros((3, self._model.nv))

    def torques(self, pose: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        """Return the torques of the hinges in one frame [Nm], shape (43,)."""
        data = self._data
        data.qpos[:], data.qvel[:], data.qacc[:] = pose, velocity, acceleration
        mujoco.mj_inverse(self._model, data)
        needed, edges, effort = data.qfrc_inverse.copy(), *self._edge_forces()
        if len(effort):
            weights = np.array([1.0, 1.0, 1.0, TORQUE_WEIGHT_PER_M, TORQUE_WEIGHT_PER_M, TORQUE_WEIGHT_PER_M])
            problem = np.concat([weights[:, None] * edges[:6], np.diag(effort)])
            forces, _ = nnls(problem, np.concat([weights * needed[:6], np.zeros(len(effort))]))
            needed -= edges @ forces
        return needed[6:]

    def _edge_forces(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the generalised force (49, K) of a newton along each friction edge of each near sole point, and its effort (K,)."""
        data = self._data
        points = np.array([data.xpos[b] + data.xmat[b].reshape(3, 3) @ point for b, point in self._soles])
        lowest = points[:, 2].min()
        heights = np.maximum(points[:, 2] - (lowest if lowest < MAX_GROUND_OFFSET_M else 0.0), 0.0)
        edges, effort = [], []
        for (b, _), point, height in zip(self._soles, points, heights, strict=True):
            if height <= BEARING_HEIGHT_MARGIN_M:
                mujoco.mj_jac(self._model, data, self._jacobian, None, point, b)
                edges.append(_EDGES @ self._jacobian)
                effort += [FORCE_EFFORT_WEIGHT * np.sqrt(1.0 + (height / EFFORT_HEIGHT_SCALE_M) ** 2)] * len(_EDGES)
        return (np.concat(edges).T if edges else np.zeros((self._model.nv, 0))), np.array(effort)


def _sole(b: int) -> np.ndarray:
    """Return the lower corners of a foot's or toe's box in its frame [m], shape (4, 3)."""
    corners = np.array(BODIES[b].shape.points)
    return corners[corners[:, 2] < corners[:, 2].min() + 1e-6]
