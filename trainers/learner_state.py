"""What the next update of any learner depends on, as a tree for ``checkpoint``: weights, optimiser and random generator."""

from typing import Any

import numpy as np
import torch
from torch import nn


def get_state(network: nn.Module, optimiser: torch.optim.Optimizer, random: torch.Generator) -> dict[str, Any]:
    """Return copies of everything."""
    moments = {
        f"{index}/{name}": value.numpy().copy() for index, state in optimiser.state_dict()["state"].items() for name, value in state.items()
    }
    return {
        "network": {name: tensor.numpy().copy() for name, tensor in network.state_dict().items()},
        "optimiser": moments,
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
