"""Rewards an agent that moves like people, and learns from it what does not: AMP (Peng et al. 2021; thesis 4.6)."""

from typing import Any

import numpy as np
import torch

from agents.policy.amp_discriminator import Discriminator, instant_features, style_reward
from configs.errors import InputError
from datasets.library.motion_library import MotionLibrary
from envs.physics.protocol import FRAMES_PER_STEP
from trainers.algorithms.learner_state import get_state, set_state
from trainers.algorithms.rollout import Rollout
from trainers.data.root_reconstruction import FAULTY_SYSTEMS

BATCH = 1024  # transitions of each kind in a step of the discriminator
LEARNING_RATE = 1e-4


class StyleLearner:
    """Owns the discriminator, its optimiser and the random order of its samples."""

    def __init__(self, weight: float, seed: int, library: MotionLibrary, device: torch.device) -> None:
        """Build the discriminator.

        Args:
            weight: Of the style reward beside the env's.
            seed: Of the samples drawn.
            library: Training clips; those that suits recorded are not looked at, the clean ones behind them are clips themselves.
            device: Where rollouts are.

        Raises:
            InputError: If there is no clean clip.
        """
        clean = [clip for clip in library.clips if clip.system not in FAULTY_SYSTEMS]
        if not clean:
            raise InputError("learner.style compares with clean motion, but data.motions holds recordings of IMU suits only; set it to 0")
        self._weight, self._library, self._device = weight, library, device
        self._rows = np.concat([np.arange(clip.start, clip.start + clip.frames - FRAMES_PER_STEP) for clip in clean])
        self.discriminator = Discriminator().to(device)
        self.optimiser = torch.optim.Adam(self.discriminator.parameters(), lr=LEARNING_RATE)
        self.random = torch.Generator().manual_seed(seed)

    def judge(self, rollouts: list[Rollout]) -> tuple[list[Rollout], dict[str, float]]:
        """Return rollouts with the style rewards added, and diagnostics by name; then learn from the rollouts."""
        transitions, styles = zip(*map(self._look, rollouts), strict=True)
        judged = [one._replace(rewards=one.rewards + self._weight * style) for one, style in zip(rollouts, styles, strict=True)]
        reward = float(np.mean([style.mean().item() for style in styles]))
        return judged, {"style_reward": reward, **self._learn(torch.concat(transitions))}

    @torch.no_grad()
    def _look(self, rollout: Rollout) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the transitions within episodes (M, 236), and the style reward of every step (T, N).

        That of an episode's last step is 0: the bodies after it are the next episode's.
        """
        within = ~rollout.ended
        transitions = torch.concat([rollout.instants[:-1], rollout.instants[1:]], dim=-1)[within]
        style = torch.zeros_like(rollout.rewards)
        style[within] = style_reward(self.discriminator(transitions))
        return transitions, style

    def _learn(self, agent: torch.Tensor) -> dict[str, float]:
        """Pass once over the agent's transitions, as many real ones beside them; return the mean scores of both."""
        order = torch.randperm(len(agent), generator=self.random)
        scores = []
        for begin in range(0, len(order), BATCH):
            picked = order[begin : begin + BATCH].to(self._device)
            real = self._draw(len(picked))
            self.discriminator.normaliser.update(real)
            loss, of_real, of_agent = self.discriminator.loss(real, agent[picked])
            self.optimiser.zero_grad(set_to_none=True)
            loss.backward()
            self.optimiser.step()
            scores.append((of_real.mean().item(), of_agent.mean().item()))
        real_score, agent_score = np.reshape(scores, (-1, 2)).mean(axis=0).tolist()
        return {"style_real": real_score, "style_agent": agent_score}

    def _draw(self, count: int) -> torch.Tensor:
        """Return random transitions (count, 236) of the clean clips, all frames alike."""
        rows = self._rows[torch.randint(len(self._rows), (count,), generator=self.random).numpy()]
        instants = [instant_features(self._library.at(at).rewarded) for at in (rows, rows + FRAMES_PER_STEP)]
        return torch.from_numpy(np.concat(instants, axis=1)).to(self._device)

    def get_state(self) -> dict[str, Any]:
        """Return everything that the next judgement depends on beside the rollouts."""
        return get_state(self.discriminator, self.optimiser, self.random)

    def set_state(self, state: dict[str, Any]) -> None:
        """Go back to a state that ``get_state`` returned."""
        set_state(self.discriminator, self.optimiser, self.random, state)
