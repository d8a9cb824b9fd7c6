"""A training run as its folder holds it: the config, the policy that it kept, and that policy's card."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from agents.policy import Policy
from configs.errors import InputError
from configs.load import CONFIGS, load_config
from envs.mimic_spec import MimicSpec
from trainers.ppo_config import PpoConfig

CARD = {"task", "motions", "clips", "performers", "held_out", "samples", "hours", "code"}  # what is read of a policy's card


@dataclass(frozen=True)
class Run:
    """A training run's folder, its config and the policy that it kept."""

    folder: Path
    config: PpoConfig
    policy: Policy
    card: dict[str, Any]
    spec: MimicSpec


def load_run(folder: Path) -> Run:
    """Return a run.

    Args:
        folder: Of the run; or a policy's file, such as the package's, which is taken for one trained by ``configs/clean.yaml``.

    Raises:
        InputError: If there is none, or it holds no policy that fits this code.
    """
    if folder.is_file():
        policy, card, spec = load_policy(folder)
        config = load_config(PpoConfig, CONFIGS / "clean.yaml")
        return Run(folder.parent, replace(config, task=spec), policy, card, spec)
    if not folder.is_dir():
        raise InputError(f"there is no run at {folder}; python -m trainers.ppo --config configs/mixed.yaml leaves one in runs/mixed")
    policy, card, spec = load_policy(folder / "best" / "policy.safetensors")
    return Run(folder, load_config(PpoConfig, folder / "config.yaml"), policy, card, spec)


def load_policy(path: Path) -> tuple[Policy, dict[str, Any], MimicSpec]:
    """Return a policy, its card and the variant of the task that it was trained for.

    Raises:
        InputError: If there is none at ``path``, or none that fits this code.
    """
    policy, card = Policy.load(path)
    lacks = CARD - set(card)
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
