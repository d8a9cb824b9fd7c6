"""Backward pass of the iterative linear quadratic regulator (Li and Todorov 2004; Tassa, Erez and Todorov 2012); pure.

Given the derivatives of each step of a trajectory and a quadratic cost of its states and inputs, it finds what to change of the inputs, and
how to answer to states that turn out otherwise.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from eval.clean.optimisation.step_derivatives import Linearisation


class FeedbackLaw(NamedTuple):
    """What to add to the inputs of n steps, and what the rest of them will cost then.

    Attributes:
        change: Change of the inputs, shape (n, 49).
        gains: Answers to changes of the state, shape (n, 49, 98).
        slopes: Half of the derivatives of the cost to go by the state, before each step and at the end, shape (n + 1, 98).
        curvatures: Half of its second derivatives, shape (n + 1, 98, 98).
    """

    change: np.ndarray
    gains: np.ndarray
    slopes: np.ndarray
    curvatures: np.ndarray

    def cost_to_go(self, step: int, moved: np.ndarray) -> np.ndarray:
        """Return the cost from a step on beside the trajectory's own, shape (K,), of states that are ``moved`` (K, 98) from it."""
        return 2.0 * moved @ self.slopes[step] + (moved @ self.curvatures[step] * moved).sum(axis=1)


def backward_pass(
    steps: Sequence[Linearisation],
    gaps: np.ndarray,
    state_errors: np.ndarray,
    inputs: np.ndarray,
    state_weights: np.ndarray,
    input_weights: np.ndarray,
    damping: float = 0.0,
) -> FeedbackLaw:
    """Return the feedback law that minimises the cost: squares of states' errors and of inputs, by weights.

    Args:
        steps: Derivatives of the n steps.
        gaps: What the state after each step has beyond the next one of the trajectory, shape (n, 98); 0 of one that was simulated.
        state_errors: Differences of the trajectory's states from those wanted, shape (n + 1, 98).
        inputs: Inputs of the trajectory, all of which cost, shape (n, 49).
        state_weights: Weights of the states' errors, shape (n + 1, 98, 98).
        input_weights: Weights of the inputs, shape (n, 49).
        damping: Weight of the inputs' changes, as a share of ``input_weights``: the more of it, the nearer to the trajectory.
    """
    n, diagonal = len(steps), np.diag_indices(inputs.shape[1])
    change, gains = np.empty_like(inputs), np.empty((*inputs.shape, state_errors.shape[1]))
    curvature = state_weights[n]
    slope = curvature @ state_errors[n]
    slopes, curvatures = [slope], [curvature]
    for t in range(n - 1, -1, -1):
        by_state, by_input, *_ = steps[t]
        slope = slope + curvature @ gaps[t]
        input_slope = input_weights[t] * inputs[t] + by_input.T @ slope
        mixed = by_input.T @ (curvature @ by_state)
        input_curvature = by_input.T @ (curvature @ by_input)
        input_curvature[diagonal] += input_weights[t]
        damped = input_curvature.copy()
        damped[diagonal] += damping * input_weights[t]
        solution = -np.linalg.solve(damped, np.concat([input_slope[:, None], mixed], axis=1))
        change[t], gains[t] = solution[:, 0], solution[:, 1:]
        answered = gains[t].T @ input_curvature
        slope = state_weights[t] @ state_errors[t] + by_state.T @ slope
        slope += answered @ change[t] + gains[t].T @ input_slope + mixed.T @ change[t]
        curvature = state_weights[t] + by_state.T @ (curvature @ by_state)
        curvature += answered @ gains[t] + gains[t].T @ mixed + mixed.T @ gains[t]
        curvature = 0.5 * (curvature + curvature.T)
        slopes.append(slope)
        curvatures.append(curvature)
    return FeedbackLaw(change, gains, np.array(slopes[::-1]), np.array(curvatures[::-1]))
