"""What a control step came to: rewards, and whether the episode is over; pure, batched, NumPy or torch."""

from typing import NamedTuple

from datasets.library.motion_library import Reference
from datasets.motion.body_state import BodyState
from datasets.motion.rotation import Array, array_namespace
from envs.mimic import termination
from envs.mimic.penalties import penalties
from envs.mimic.reward import RewardTerms, compute_reward_terms
from envs.mimic.spec import MimicSpec


class StepOutcome(NamedTuple):
    """Of one control step of N worlds.

    Attributes:
        reward_terms: Of the reward; 0 where physics failed.
        imitation_reward: The reward of eq. 4.10, shape (N,).
        rewards: The same less the penalties; 0 where physics failed, shape (N,).
        root_position: Where the pelvis is [m]; the reference's where physics failed, for an exploded root is nowhere, shape (N, 3).
        terminated: Whether the agent fell, lost the reference, or failed, shape (N,).
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
        """Whether the episode is over either way, shape (N,)."""
        return array_namespace(self.terminated).logical_or(self.terminated, self.truncated)


def evaluate_step(
    spec: MimicSpec, agent: BodyState, reference: Reference, action_delta: Array, failed: Array, at_end: Array
) -> StepOutcome:
    """Return the outcome of a step.

    Args:
        spec: With the penalties.
        agent: Simulated bodies after the step.
        reference: At the same instant.
        action_delta: Of the smoothed actions in this step, shape (N, A).
        failed: Worlds in which physics failed, shape (N,).
        at_end: Worlds whose reference ends here, shape (N,).
    """
    sound = ~failed
    terms = RewardTerms(*(term * sound for term in compute_reward_terms(agent, reference)))
    imitation = terms.total
    rewards = imitation - penalties(spec, agent, action_delta) * sound if spec.has_penalties else imitation
    terminated = failed | termination.has_lost_reference(terms.discount) | termination.has_fallen(agent)
    root = array_namespace(agent.pos).where(failed[:, None], reference.observed.pos[:, 0], agent.pos[:, 0])
    return StepOutcome(terms, imitation, rewards, root, terminated, ~terminated & at_end)
