"""Outcome of a control step: rewards, termination and truncation; pure, batched, NumPy or torch."""

from typing import NamedTuple

from datasets.library.motion_library import Reference
from datasets.motion.body_state import BodyState
from datasets.motion.rotation import Array, array_namespace
from envs.mimic import termination
from envs.mimic.penalties import penalties
from envs.mimic.reward import RewardTerms, compute_reward_terms
from envs.mimic.spec import MimicSpec


class StepOutcome(NamedTuple):
    """Outcome of one control step of N worlds.

    Attributes:
        reward_terms: Terms of the reward; 0 where physics failed.
        imitation_reward: Reward of eq. 4.10, shape (N,).
        rewards: Imitation reward less the penalties; 0 where physics failed, shape (N,).
        root_position: Position of the pelvis [m]; the reference's where physics failed, shape (N, 3).
        terminated: Whether the agent fell, lost the reference or strayed from it, or physics failed, shape (N,).
        truncated: Whether an episode that did not terminate is at its end, shape (N,).
    """

    reward_terms: RewardTerms
    imitation_reward: Array
    rewards: Array
    root_position: Array
    terminated: Array
    truncated: Array

    @property
    def ended(self) -> Array:
        """Whether the episode terminated or was truncated, shape (N,)."""
        return array_namespace(self.terminated).logical_or(self.terminated, self.truncated)


def evaluate_step(
    spec: MimicSpec,
    agent: BodyState,
    reference: Reference,
    action_delta: Array,
    failed: Array,
    at_end: Array,
    max_body_error_m: float | None = None,
) -> StepOutcome:
    """Return the outcome of a control step.

    Args:
        spec: Variant of the task, with the weights of the penalties.
        agent: Simulated bodies after the step.
        reference: Reference at the same instant.
        action_delta: Change of the smoothed actions in this step, shape (N, A).
        failed: Whether physics failed in each world, shape (N,).
        at_end: Whether the episode of each world is at its last step, shape (N,).
        max_body_error_m: Mean distance of the bodies from the rewarded track at which an episode of a training ends [m]; None for no end.
    """
    sound = ~failed
    terms = RewardTerms(*(term * sound for term in compute_reward_terms(agent, reference)))
    imitation = terms.total
    rewards = imitation - penalties(spec, agent, action_delta) * sound if spec.has_penalties else imitation
    terminated = failed | termination.has_lost_reference(terms.discount) | termination.has_fallen(agent)
    if max_body_error_m is not None:
        terminated = terminated | termination.has_strayed(agent, reference.rewarded, max_body_error_m)
    root = array_namespace(agent.pos).where(failed[:, None], reference.observed.pos[:, 0], agent.pos[:, 0])
    return StepOutcome(terms, imitation, rewards, root, terminated, ~terminated & at_end)
