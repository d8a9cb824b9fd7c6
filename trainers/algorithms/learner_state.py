"""What the next update of any learner depends on, as a tree for ``checkpoint``: weights, optimiser and random generator."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import nn


def numpy_copies(tensors: Mapping[str, torch.Tensor]) -> dict[str, np.ndarray]:
    """Return copies of tensors by name, as arrays, which checkpoints hold and Ray hands over without copies of its own."""
    return {name: tensor.cpu().numpy().copy() for name, tensor in tensors.items()}


def get_state(network: nn.Module, optimiser: torch.optim.Optimizer, random: torch.Generator) -> dict[str, Any]:
    """Return copies of everything."""
    moments = {
        f"{index}/{name}": value for index, state in optimiser.state_dict()["state"].items() for name, value in state.items()
    }  # fmt: skip
    return {
        "network": numpy_copies(network.state_dict()),
        "optimiser": numpy_copies(moments),
        "random": random.get_state().numpy(),
    }


def set_state(network: nn.Module, optimiser: torch.optim.Optimizer, random: torch.Generator, state: dict[str, Any]) -> None:
    """Go back to a state that ``get_state`` returned."""
    network.load_state_dict({name: torch.from_numpy(np.array(array)) for name, array in state["network"].items()})
    moments: dict[int, dict[str, torch.Tensor]] = {}
    for key, array in state["optimiser"].items():
        index, name = key.split("/")
        moments.setdefault(int(index), {})[name] = torch.from_numpy(np.array(array))
    optimiser.load_state_dict({**optimiser.state_dict(), "state": moments})
    random.set_state(torch.from_numpy(np.array(state["random"])))
