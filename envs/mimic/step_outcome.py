"""What a control step came to: rewards, and whether the episode is over; pure, batched, NumPy or torch."""

from typing import NamedTuple

from datasets.library.motion_library import Reference
from datasets.motion.body_state import BodyState
from datasets.motion.rotation import Array, namespace
from envs.mimic import termination
from envs.mimic.penalties import penalties
from envs.mimic.reward import Reward, reward
from envs.mimic.spec import MimicSpec


class Outcome(NamedTuple):
    """Of one control step of N worlds.

    Attributes:
        terms: Of the reward; 0 where physics failed.
        imitation: The reward of eq. 4.10, shape (N,).
        rewards: The same less the penalties; 0 where physics failed, shape (N,).
        root: Where the pelvis is [m]; the reference's where physics failed, for an exploded root is nowhere, shape (N, 3).
        terminated: Whether the agent fell, lost the reference, or failed, shape (N,).
        truncated: Whether an episode that did not terminate is at its end, shape (N,).
    """

    terms: Reward
    imitation: Array
    rewards: Array
    root: Array
    terminated: Array
    truncated: Array

    @property
    def ended(self) -> Array:
        """Whether the episode is over either way, shape (N,)."""
        return namespace(self.terminated).logical_or(self.terminated, self.truncated)


def judge(spec: MimicSpec, agent: BodyState, reference: Reference, change: Array, failed: Array, over: Array) -> Outcome:
    """Return the outcome of a step.

    Args:
        spec: With the penalties.
        agent: Simulated bodies after the step.
        reference: At the same instant.
        change: Of the smoothed actions in this step, shape (N, A).
        failed: Worlds in which physics failed, shape (N,).
        over: Worlds whose reference ends here, shape (N,).
    """
    sound = ~failed
    terms = Reward(*(term * sound for term in reward(agent, reference)))
    imitation = terms.total
    rewards = imitation - penalties(spec, agent, change) * sound if spec.penalised else imitation
    terminated = failed | termination.lost(terms.discount) | termination.fallen(agent)
    root = namespace(agent.pos).where(failed[:, None], reference.observed.pos[:, 0], agent.pos[:, 0])
    return Outcome(terms, imitation, rewards, root, terminated, ~terminated & over)
