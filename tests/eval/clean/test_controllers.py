"""Controllers of a search's samples: drawn within limits, copied with the samples, changed for some of them."""

import numpy as np
import pytest

from eval.clean.controllers import Controllers, change_controllers, draw_controllers


def test_controllers_are_drawn_within_their_limits() -> None:
    drawn = draw_controllers(np.random.default_rng(0), 1000, (0.2, 0.6), 0.25)
    assert drawn.residual_share.shape == drawn.virtual_model_gain.shape == (1000, 1)
    assert (drawn.residual_share.min(), drawn.residual_share.max()) == pytest.approx((0.2, 0.6), abs=0.01)
    assert set(drawn.virtual_model_gain.ravel()) == {0.0, 1.0}
    assert drawn.virtual_model_gain.mean() == pytest.approx(0.25, abs=0.05)


@pytest.mark.parametrize("virtual_share", [0.0, 1.0])
def test_one_controller_for_all(virtual_share: float) -> None:
    drawn = draw_controllers(np.random.default_rng(0), 5, (0.5, 0.5), virtual_share)
    assert np.array_equal(drawn.residual_share, np.full((5, 1), 0.5))
    assert np.array_equal(drawn.virtual_model_gain, np.full((5, 1), virtual_share))


def test_copies_have_the_controllers_of_the_samples_that_they_copy() -> None:
    old = Controllers(np.array([[0.1], [0.2], [0.3]]), np.array([[0.0], [1.0], [0.0]]))
    copied = old.branch(np.array([1, 1, 0]))
    assert copied.residual_share.ravel().tolist() == [0.2, 0.2, 0.1]
    assert copied.virtual_model_gain.ravel().tolist() == [1.0, 1.0, 0.0]


def test_a_fifth_of_the_samples_changes_but_no_first_copy() -> None:
    old, new = (Controllers(np.full((1000, 1), share), np.full((1000, 1), gain)) for share, gain in ((0.1, 0.0), (0.4, 1.0)))
    changed = change_controllers(np.random.default_rng(0), old, new, 200)
    assert (changed.residual_share[:200] == 0.1).all()
    assert 120 < (changed.residual_share[200:] == 0.4).sum() < 200  # 160 of 800 are expected; a deviation is 11
    assert np.array_equal(changed.residual_share == 0.4, changed.virtual_model_gain == 1.0)
