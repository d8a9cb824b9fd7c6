"""The policy that a training begins with."""

import torch

from agents.policy.policy import Policy
from trainers.algorithms.ppo_config import PpoConfig

CPU = torch.device("cpu")


def make_policy(config: PpoConfig, device: torch.device = CPU) -> Policy:
    """Return an untrained policy for a run's task and network, on a device."""
    task, network = config.task, config.network
    return Policy(task.observation_size, task.action_size, network.hidden, network.activation).to(device)
