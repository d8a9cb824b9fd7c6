"""Weights of the points of the feet that may carry the body: the lower a point, the more, and as a network says. NumPy or torch."""

from datasets.motion.humanoid import ANKLE_HEIGHT, TOE_HEIGHT
from datasets.motion.rotation import Array, Constant, array_namespace

HEIGHT_SOFTMAX_SCALE_M = 0.015  # m: a point that is higher than another by this has a prior weight e times smaller
_HEIGHTS = Constant([ANKLE_HEIGHT, TOE_HEIGHT] * 2)  # m, heights of ankles and toe joints above the ground under a flat foot
_MAX_LOGIT = 40.0  # whose exponential is finite in single precision


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
