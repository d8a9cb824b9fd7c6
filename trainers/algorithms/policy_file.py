"""Policies in files: with the card that says what they were trained for, and as what a training begins with."""

from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from agents.policy.policy import Policy
from configs.errors import InputError
from envs.mimic.spec import PENALTY_FIELDS, MimicSpec
from trainers.algorithms.ppo_config import PpoConfig

INITIAL_POLICY_FILE = "initial.safetensors"  # in a run's folder: the policy that it began with, if that was not a fresh one
REQUIRED_CARD_KEYS = {"task", "motions", "clips", "performers", "held_out", "samples", "hours", "code"}  # what is read of a policy's card


def load_policy(path: Path) -> tuple[Policy, dict[str, Any], MimicSpec]:
    """Return a policy, its card and the variant of the task that it was trained for.

    Raises:
        InputError: If there is none at ``path``, or none that fits this code.
    """
    policy, card = Policy.load(path)
    lacks = REQUIRED_CARD_KEYS - set(card)
    if lacks:
        raise InputError(f"the policy {path} says nothing of its {', '.join(sorted(lacks))}; train it anew")
    try:
        spec = MimicSpec(**card["task"])
    except (TypeError, ValueError) as error:
        raise InputError(f"the policy {path} is for another task than this code's ({error}); train it anew") from None
    needed = (spec.observation_size, spec.action_size)
    given = (policy.shape["observation_size"], policy.shape["action_size"])
    if needed != given:
        raise InputError(f"the policy {path} maps {given[0]} numbers to {given[1]}, its task {needed[0]} to {needed[1]}; train it anew")
    return policy, card, spec


def load_initial_policy(config: PpoConfig) -> tuple[Policy, dict[str, Any]] | None:
    """Return the policy of a file that a training begins with, and its card; None where it begins with a fresh one.

    Raises:
        InputError: If there is none, or its task or network is not the config's; prices taken from the reward may differ.
    """
    if not config.init:
        return None
    policy, card, spec = load_policy(Path(config.init))
    own = {f"task.{field.name}": getattr(spec, field.name) for field in fields(spec) if field.name not in PENALTY_FIELDS}
    own |= {f"network.{name}": policy.shape[name] for name in ("hidden", "activation")}
    wanted = {f"task.{name}": value for name, value in asdict(config.task).items()}
    wanted |= {"network.hidden": list(config.network.hidden), "network.activation": config.network.activation}
    for name, value in own.items():
        if value != wanted[name]:
            raise InputError(f"init={config.init} was trained with {name}={value}, this run has {wanted[name]}; give it {name}={value}")
    return policy, card
