"""Root paths about the points of the feet that carry the body: the pelvis moves opposite to a standing foot seen from the pelvis.

Root3D may predict, beside a path, weights of four points that may carry the body; the distance follows from their motion. A
network that has seen few people guesses a speed that it has seen; the feet show it. B windows, W frames; NumPy or torch.
"""

from agents.root.recurrent.stance_weights import stance_weights
from agents.root.spec import RootSpec
from datasets.imu.root_features import STANCE_BODIES
from datasets.motion.rotation import Array, array_namespace


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
