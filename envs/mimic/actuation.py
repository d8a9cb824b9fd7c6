"""PD targets: the reference's hinge angles, led ahead by its speeds, plus the policy's corrections (thesis, eq. 4.1 and 4.3)."""

import numpy as np

from datasets.library.motion_library import Observed
from datasets.motion.humanoid import HINGE_COUNT
from datasets.motion.rotation import Array, Constant
from envs.mimic.spec import MimicSpec
from envs.physics.humanoid_mjcf import HINGE_KP, HINGE_KV

_VELOCITY_FEED_FORWARD_S = Constant(HINGE_KV / HINGE_KP)  # s: makes the damping of the PD motors act on the speed error, eq. 4.1


class Actuation:
    """Computes the targets of the 43 motors from actions; pure, batched, NumPy or torch."""

    def __init__(self, spec: MimicSpec) -> None:
        """Build the matrix from actions to hinge corrections."""
        self._smoothing = spec.smoothing
        self._residual = Constant(spec.action_scale * np.eye(HINGE_COUNT)[list(spec.residual_hinges)])  # (A, 43) rad

    def smooth(self, newest: Array, before: Array) -> Array:
        """Return the smoothed actions (N, A) from the newest and the previous smoothed ones. Source: eq. 4.5."""
        return self._smoothing * newest + (1.0 - self._smoothing) * before

    def pd_targets(self, observed: Observed, action: Array, feed_forward: Array | None) -> Array:
        """Return the PD targets of the motors [rad], shape (N, 43). Source: eq. 4.3.

        Args:
            observed: Observed track of the reference.
            action: Smoothed action, shape (N, A).
            feed_forward: Angles whose torques carry the reference [rad], shape (N, 43); None without feed-forward.
        """
        targets = observed.hinges + _VELOCITY_FEED_FORWARD_S.like(action) * observed.hinge_vel + action @ self._residual.like(action)
        return targets if feed_forward is None else targets + feed_forward
