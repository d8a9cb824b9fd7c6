"""Root paths about the points of the feet that carry the body: the pelvis moves opposite to a standing foot seen from the pelvis.

Root3D may predict, beside a path, weights of four points that may carry the body; the distance follows from their motion. A
network that has seen few people guesses a speed that it has seen; the feet show it. B windows, W frames; NumPy or torch.
"""

from agents.root.spec import STANCE_BODIES, RootSpec
from datasets.motion.humanoid import ANKLE_HEIGHT, TOE_HEIGHT
from datasets.motion.rotation import Array, Constant, array_namespace

HEIGHT_SOFTMAX_SCALE_M = 0.015  # m: a point that is higher than another by this has a prior weight e times smaller
_HEIGHTS = Constant([ANKLE_HEIGHT, TOE_HEIGHT] * 2)  # m, heights of ankles and toe joints above the ground under a flat foot
_MAX_LOGIT = 40.0  # whose exponential is finite in single precision


def stance_paths(spec: RootSpec, features: Array, logits: Array) -> Array:
    """Return the mini-trajectories of the pelvis that follow from its points of support [m], shape (B, W, 3).

    Args:
        spec: Spec of a model that predicts steps ahead.
        features: Raw features of windows, shape (B, W, F).
        logits: Logit of each point at each step, added to that of its height, shape (B, W, 4).
    """
    xp = array_namespace(features)
    points = features.reshape(*features.shape[:2], -1, 3)[:, :, [spec.bodies.index(body) for body in STANCE_BODIES]]
    weights = stance_weights(points, logits)
    after = 2.0 * points[:, -1:] - points[:, -2:-1]  # the last target lies one frame beyond the window
    moved = xp.concat([points[:, 1:], after], 1) - points[:, :1]
    return -(weights[..., None] * moved).sum(2)


def stance_weights(points: Array, logits: Array) -> Array:
    """Return the share of the body that each point carries; the lower it is, the more, shape of ``logits``.

    Args:
        points: Ankles and toe joints [m], shape (B, W, 4, 3).
        logits: Logit of each point, added to that of its mean height, shape (B, 4) or (B, steps, 4).
    """
    xp = array_namespace(points)
    heights = (points[..., 2] - _HEIGHTS.like(points)).mean(1)
    logits_of_height = -(heights - xp.amin(heights, -1)[:, None]) / HEIGHT_SOFTMAX_SCALE_M
    if logits.ndim == points.ndim - 1:
        logits_of_height = logits_of_height[:, None]
    weights = xp.exp(xp.clip(logits + logits_of_height, -_MAX_LOGIT, _MAX_LOGIT))
    return weights / weights.sum(-1)[..., None]
