"""Trained run, read from its folder: config, best policy, and that policy's card."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from agents.policy.policy import Policy
from configs.errors import InputError
from configs.load import CONFIG_DIR, load_config
from envs.mimic.spec import MimicSpec
from trainers.algorithms.policy_file import load_policy
from trainers.algorithms.ppo_config import PpoConfig


@dataclass(frozen=True)
class TrainedRun:
    """A training run with its best policy.

    Attributes:
        folder: Folder of the run.
        config: Config of the run.
        policy: Best policy by model selection.
        card: Card of the policy.
        spec: Variant of the task that the policy was trained for.
    """

    folder: Path
    config: PpoConfig
    policy: Policy
    card: dict[str, Any]
    spec: MimicSpec


def load_run(folder: Path) -> TrainedRun:
    """Return a run.

    Args:
        folder: Folder of the run; or a policy's file, such as the package's, which is taken for one trained by ``configs/clean.yaml``.

    Raises:
        InputError: If there is no such folder, or it holds no policy that fits this code.
    """
    if folder.is_file():
        policy, card, spec = load_policy(folder)
        config = load_config(PpoConfig, CONFIG_DIR / "clean.yaml")
        return TrainedRun(folder.parent, replace(config, task=spec), policy, card, spec)
    if not folder.is_dir():
        raise InputError(f"there is no run at {folder}; python -m trainers.ppo --config configs/mixed.yaml leaves one in runs/mixed")
    policy, card, spec = load_policy(folder / "best" / "policy.safetensors")
    return TrainedRun(folder, load_config(PpoConfig, folder / "config.yaml"), policy, card, spec)
