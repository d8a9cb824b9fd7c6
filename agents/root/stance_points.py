"""The pelvis moves against the foot it stands on as that foot moves against the pelvis: what is left to a network is which one.

Root3D may give, beside a path, how sure it is of each of four points that carry the body, and leave the distance to them. A
network that has seen few people guesses a speed that it saw people have; the feet know it. B windows, W frames; NumPy or torch.
"""

from agents.root.spec import STANCE_BODIES, RootSpec
from datasets.motion.humanoid import ANKLE_HEIGHT
from datasets.motion.rotation import Array, Constant, array_namespace

HEIGHT_SOFTMAX_SCALE_M = 0.015  # m: before the network is asked, a point that is so much higher than another one counts e times less
_HEIGHTS = Constant([ANKLE_HEIGHT, 0.02] * 2)  # of ankles and toe joints above the ground under a flat foot [m]
_MOST = 40.0  # of a logit, whose exponential is still a finite number in single precision


def stance_paths(spec: RootSpec, features: Array, logits: Array) -> Array:
    """Return the mini-trajectories (B, W, 3) [m] of pelvises that move about the points that carry them.

    Args:
        spec: Of a model that predicts steps ahead.
        features: Raw features of windows, shape (B, W, F).
        logits: Of each point at each step, added to what its height tells, shape (B, W, 4).
    """
    xp = array_namespace(features)
    points = features.reshape(*features.shape[:2], -1, 3)[:, :, [spec.bodies.index(body) for body in STANCE_BODIES]]
    heights = (points[..., 2] - _HEIGHTS.like(features)).mean(1)
    lowest = xp.amin(heights, -1)[:, None]
    weights = xp.exp(xp.clip(logits - ((heights - lowest) / HEIGHT_SOFTMAX_SCALE_M)[:, None], -_MOST, _MOST))
    weights = weights / weights.sum(-1)[..., None]
    after = 2.0 * points[:, -1:] - points[:, -2:-1]  # the last target lies one frame beyond the window
    moved = xp.concat([points[:, 1:], after], 1) - points[:, :1]
    return -(weights[..., None] * moved).sum(2)
