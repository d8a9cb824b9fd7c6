"""Model files: weights, shape and model card of a network in one safetensors file, written atomically."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import nn

from configs.atomic_file import atomic_write
from configs.errors import InputError

N = TypeVar("N", bound=nn.Module)


def save_network(network: nn.Module, path: Path, shape: dict[str, Any], card: dict[str, Any]) -> None:
    """Write a network.

    Args:
        network: Network, of which all parameters and buffers are written.
        path: File to write.
        shape: JSON values that the network is built from.
        card: Model card: JSON values about the network and its training.

    Raises:
        OSError: If the file could not be written; an existing file stays.
    """
    weights = {name: tensor.contiguous() for name, tensor in network.state_dict().items()}
    try:
        with atomic_write(path) as temporary:
            save_file(weights, temporary, metadata={"shape": json.dumps(shape), "card": json.dumps(card)})
    except SafetensorError as error:  # such as a full disk; the values themselves are valid
        raise OSError(f"{path} could not be written: {error}") from error


def load_network(path: Path, build: Callable[..., N], what: str, where: str) -> tuple[N, dict[str, Any]]:
    """Return a network that ``save_network`` wrote, and its card.

    Args:
        path: File to read.
        build: Returns an untrained network from the shape's values as keywords.
        what: Kind of network for error messages, such as "policy".
        where: Hint for error messages where a user finds one.

    Raises:
        InputError: If there is no such file, or it does not hold such a network.
    """
    if not path.is_file():
        raise InputError(f"there is no {what} at {path}; {where}")
    try:
        with safe_open(path, framework="pt") as file:
            metadata = file.metadata() or {}
            weights = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (not a mapping)
        network = build(**json.loads(metadata["shape"]))
        network.load_state_dict(weights)
        return network, json.loads(metadata["card"])
    except (SafetensorError, KeyError, TypeError, RuntimeError, json.JSONDecodeError):
        raise InputError(f"{path} holds no {what} of this project (a safetensors file with its shape and card)") from None
