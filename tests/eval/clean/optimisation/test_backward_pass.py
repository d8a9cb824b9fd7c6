"""The backward pass, by hand and against least squares over all inputs at once."""

import numpy as np
import pytest

from eval.clean.optimisation.backward_pass import FeedbackLaw, backward_pass
from eval.clean.optimisation.step_derivatives import Linearisation

NOTHING = np.zeros(0)


def step(by_state: np.ndarray, by_input: np.ndarray) -> Linearisation:
    return Linearisation(by_state, by_input, NOTHING, NOTHING)


def one_step(gap: float = 0.0, damping: float = 0.0) -> FeedbackLaw:
    """Return the law of x' = 2 x + 3 u, where 0 is wanted after it and the trajectory is at 5, at 4 x'^2 + 6 u^2."""
    step_of_one = step(np.array([[2.0]]), np.array([[3.0]]))
    errors, weights = np.array([[0.0], [5.0]]), np.array([[[0.0]], [[4.0]]])
    return backward_pass([step_of_one], np.array([[gap]]), errors, np.zeros((1, 1)), weights, np.array([[6.0]]), damping)


def test_one_step_of_one_number() -> None:
    # u minimises 4 (5 + 3 u)^2 + 6 u^2, so u = -60 / 42. From x off by 1 it is 7 instead of 5: u = -84 / 42.
    law = one_step()
    assert law.change[0, 0] == pytest.approx(-60.0 / 42.0)
    assert law.gains[0, 0, 0] == pytest.approx(-24.0 / 42.0)
    # What remains: 4 (5 - 60/14)^2 + 6 (60/42)^2 = 14.286, and from 1 off 4 (7 - 6)^2 + 6 x 4 = 28.
    assert law.cost_to_go(0, np.array([[1.0]]))[0] == pytest.approx(28.0 - 14.2857, abs=1e-3)


def test_a_gap_after_the_step_counts() -> None:
    # A state that comes out 2 lower than planned: 3 instead of 5 are to be made up for, u = -36 / 42.
    assert one_step(gap=-2.0).change[0, 0] == pytest.approx(-36.0 / 42.0)


def test_damping_keeps_inputs_as_they_are() -> None:
    # u minimises 4 (5 + 3 u)^2 + 6 u^2 + 2 x 6 u^2: -60 / 54.
    assert one_step(damping=2.0).change[0, 0] == pytest.approx(-60.0 / 54.0)


def test_many_steps_are_least_squares() -> None:
    random, n, states, inputs = np.random.default_rng(0), 6, 3, 2
    steps = [step(random.normal(size=(states, states)), random.normal(size=(states, inputs))) for _ in range(n)]
    gaps, errors, played = random.normal(size=(n, states)), random.normal(size=(n + 1, states)), random.normal(size=(n, inputs))
    roots = random.normal(size=(n + 1, states, states))
    weights, prices = roots.swapaxes(1, 2) @ roots, random.uniform(0.5, 2.0, (n, inputs))

    def residuals(changes: np.ndarray) -> np.ndarray:
        moved, parts = np.zeros(states), []
        for t in range(n):
            parts.append(np.sqrt(prices[t]) * (played[t] + changes[t]))
            moved = steps[t].by_state @ moved + steps[t].by_input @ changes[t] + gaps[t]
            parts.append(roots[t + 1] @ (errors[t + 1] + moved))
        return np.concat(parts)

    base = residuals(np.zeros((n, inputs)))
    columns = [residuals(one.reshape(n, inputs)) - base for one in np.eye(n * inputs)]
    best = np.linalg.lstsq(np.transpose(columns), -base, rcond=None)[0].reshape(n, inputs)
    law = backward_pass(steps, gaps, errors, played, weights, prices)
    moved = np.zeros(states)
    for t in range(n):
        change = law.change[t] + law.gains[t] @ moved
        assert change == pytest.approx(best[t], abs=1e-9)
        moved = steps[t].by_state @ moved + steps[t].by_input @ change + gaps[t]
