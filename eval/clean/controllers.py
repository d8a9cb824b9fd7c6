"""Controllers of a search's samples: the share of the policy's residual, and whether the legs exert the virtual model's forces.

No controller is best for all motion: the policy lasts but does not aim, virtual forces balance who stands and hinder who leaps. So
samples have different ones, and go on with those of the samples that did best (docs/cleaning.md).
"""

from typing import NamedTuple

import numpy as np

CHANGE_RATE = 0.2  # share of the samples that draw a new controller in a window


class Controllers(NamedTuple):
    """Controllers of K samples.

    Attributes:
        residual_share: Share of the policy's residual that is played, shape (K, 1).
        virtual_model_gain: 1 for legs that exert the virtual forces, 0 for others, shape (K, 1).
    """

    residual_share: np.ndarray
    virtual_model_gain: np.ndarray

    def branch(self, parents: np.ndarray) -> "Controllers":
        """Return the controllers of the samples that each one copies, parents (K,)."""
        return Controllers(*(part[parents] for part in self))


def draw_controllers(random: np.random.Generator, count: int, residual_shares: tuple[float, float], virtual_share: float) -> Controllers:
    """Return random controllers.

    Args:
        random: Random numbers.
        count: Number of controllers K.
        residual_shares: Smallest and largest share of the policy's residual; all between them are equally likely.
        virtual_share: Share of the controllers with virtual forces.
    """
    shares = random.uniform(*residual_shares, (count, 1))
    return Controllers(shares, (random.random((count, 1)) < virtual_share).astype(float))


def change_controllers(random: np.random.Generator, old: Controllers, new: Controllers, num_unchanged: int) -> Controllers:
    """Return the old controllers with new ones for ``CHANGE_RATE`` of the samples, but never for the first ``num_unchanged``."""
    changes = random.random(old.residual_share.shape) < CHANGE_RATE
    changes[:num_unchanged] = False
    return Controllers(*(np.where(changes, after, before) for before, after in zip(old, new, strict=True)))
