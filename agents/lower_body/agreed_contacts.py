"""Contacts of toe-bases of feet that are not tracked: what the network says of them, weighed with what its legs do."""

import numpy as np

from datasets.trackers.trackers import TRACKER_RATE_HZ

# Of somebody whom it does not know the network tells a foot's pose better than its contacts: it says that people who wave stand on one
# foot, and that feet of walks on other skeletons lift a tenth of a second too soon. The weights are those of a logistic regression on the
# held-out performer of the package's network; how right contacts are with and without stands in docs/lower_body.md.
SPEED_WEIGHT, HEIGHT_WEIGHT = 0.35, 11.6  # of the logarithm of a toe-base's speed, and of each metre that it is above the other one
USUAL_SPEED_M_S = 0.74  # m/s, of a toe-base of which its speed says neither
SLOW_M_S = 0.1  # m/s, far below which speeds differ by noise alone


def agreed_contacts(logits: np.ndarray, toes: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Return whether each toe-base is in contact, shape (n, 2).

    Args:
        logits: The network's logits of contact in n frames, shape (n, 2).
        toes: Predicted positions of the toe-bases in the world [m], shape (n, 2, 3).
        before: The same in the frames before, NaN where there is none, of which the network's word is taken.
    """
    speeds = np.linalg.norm(toes - before, axis=-1) * TRACKER_RATE_HZ
    higher = toes[..., 2] - toes[..., ::-1, 2]
    doubt = SPEED_WEIGHT * np.log((speeds + SLOW_M_S) / USUAL_SPEED_M_S) + HEIGHT_WEIGHT * higher
    return np.tanh(0.5 * logits) > np.where(np.isnan(speeds), 0.0, doubt)
