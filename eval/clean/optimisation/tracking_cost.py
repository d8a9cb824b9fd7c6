"""What a clip asks of a simulation: the states and PD targets of each control step, and what it costs to be elsewhere."""

import mujoco
import numpy as np

from datasets.library.motion_library import MotionLibrary
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_COUNT, HINGE_COUNT
from envs.mimic.actuation import Actuation
from envs.mimic.spec import MimicSpec
from envs.physics.engine_interface import FRAMES_PER_STEP
from envs.physics.generalised_coordinates import VELOCITY_SIZE
from envs.physics.humanoid_mjcf import build_model
from envs.physics.inverse_dynamics import with_feed_forward
from eval.clean.optimisation.step_derivatives import HELP_SIZE, STATE_SIZE

# Weights of squared errors; that of a motor's target is 1/rad². What they were chosen by stands in docs/cleaning.md.
POSITION_WEIGHT = 1000.0  # 1/m², of the mean over the bodies of their squared distances in the world
ANGLE_WEIGHT = 2.0  # 1/rad², of each hinge and of the root about each axis: positions do not tell how a limb turns about itself
ROOT_VELOCITY_WEIGHT, ROOT_SPIN_WEIGHT, HINGE_SPEED_WEIGHT = 3.0, 1.0, 0.02  # s²/m² and s²/rad²
TARGET_WEIGHT = 1.0  # 1/rad², of each motor's target beside the clip's
MAX_STEP_COST = 200.0  # of a step's state: who is lost is lost, however far
HELP_PRICE = 20.0  # of a body weight
SMALL_HELP_BW = 0.03  # body weights, to which the price of help grows with its square, and beyond which with its size


class TrackingCost:
    """Reference and cost of a clip; T control steps.

    Attributes:
        poses: Generalised positions wanted, shape (T + 1, 50).
        velocities: Generalised velocities wanted, shape (T + 1, 49).
        targets: PD targets of the clip itself [rad], shape (T, 43).
    """

    def __init__(self, clip: BodyMotion) -> None:
        """Compute states and targets of a clip at 60 fps, of an odd number of frames."""
        library = with_feed_forward(MotionLibrary.from_clips([clip]))
        at = np.arange(0, len(clip), FRAMES_PER_STEP)
        self.poses, self.velocities = library.start_pose[at].astype(float), library.start_vel[at].astype(float)
        assert library.feed_forward is not None
        spec = MimicSpec()
        observed, still = library.at(at[1:]).observed, np.zeros((len(at) - 1, spec.action_size))
        self.targets = Actuation(spec).pd_targets(observed, still, library.feed_forward[at[1:]]).astype(float)
        self._model = build_model()
        self._data = mujoco.MjData(self._model)

    def __len__(self) -> int:
        """Return the number of control steps."""
        return len(self.targets)

    def wanted(self, steps: int | slice) -> tuple[np.ndarray, np.ndarray]:
        """Return the states wanted at control steps: poses (..., 50) and velocities (..., 49)."""
        return self.poses[steps], self.velocities[steps]

    def weights(self, first: int, stop: int) -> np.ndarray:
        """Return the weights of the states' errors of control steps, shape (stop - first, 98, 98)."""
        weights = np.zeros((stop - first, STATE_SIZE, STATE_SIZE))
        speeds = np.repeat([ROOT_VELOCITY_WEIGHT, ROOT_SPIN_WEIGHT, HINGE_SPEED_WEIGHT], [3, 3, HINGE_COUNT])
        turns = np.repeat([0.0, ANGLE_WEIGHT], [3, VELOCITY_SIZE - 3])
        for matrix, pose in zip(weights, self.poses[first:stop], strict=True):
            jacobian = self._body_jacobian(pose)
            matrix[:VELOCITY_SIZE, :VELOCITY_SIZE] = POSITION_WEIGHT / BODY_COUNT * jacobian.T @ jacobian + np.diag(turns)
            matrix[VELOCITY_SIZE:, VELOCITY_SIZE:] = np.diag(speeds)
        return weights

    def _body_jacobian(self, pose: np.ndarray) -> np.ndarray:
        """Return the derivatives of the positions of all bodies by the pose, shape (60, 49)."""
        self._data.qpos[:] = pose
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        jacobian = np.zeros((BODY_COUNT, 3, VELOCITY_SIZE))
        for body in range(BODY_COUNT):
            mujoco.mj_jacBody(self._model, self._data, jacobian[body], None, 1 + body)
        return jacobian.reshape(-1, VELOCITY_SIZE)


def input_weights(help_bw: np.ndarray) -> np.ndarray:
    """Return the weights of targets and help, shape (n, 49).

    Help is priced by its size, so that it acts where it is needed and nowhere else: the weight of its square is its price over the size
    that it had (iteratively reweighted least squares).

    Args:
        help_bw: Help of the trajectory [body weights], shape (n, 6).
    """
    weights = HELP_PRICE / np.sqrt(help_sizes(help_bw) ** 2 + SMALL_HELP_BW**2)
    return np.concat([np.full((len(help_bw), HINGE_COUNT), TARGET_WEIGHT), np.repeat(weights, HELP_SIZE // 2, axis=1)], axis=1)


def help_sizes(help_bw: np.ndarray) -> np.ndarray:
    """Return the sizes (..., 2) of forces and torques (..., 6) [body weights]."""
    return np.linalg.norm(help_bw.reshape(*help_bw.shape[:-1], 2, 3), axis=-1)
