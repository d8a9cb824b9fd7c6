"""Small parts for tests of cleaning: an untrained policy, its file, a search of eight samples, somebody who stands and sways."""

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
import torch

from agents.policy.policy import Policy
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import rotations_from_hinges
from envs.mimic.spec import MimicSpec
from eval.clean.quality import QUALITIES, SearchSettings, SimulationSettings, Simulator
from tests.builders import hinge, posed
from trainers.algorithms.policy_file import REQUIRED_CARD_KEYS

SPEC = MimicSpec(frame="heading", com_error=True, preview=(1,), feed_forward=True)


def untrained(spec: MimicSpec = SPEC) -> Policy:
    """Return a small policy that learnt nothing, always the same; its actions are hardly more than none."""
    torch.manual_seed(0)
    return Policy(spec.observation_size, spec.action_size, (8,))


def saved(folder: Path) -> Path:
    """Save the untrained policy; return its file."""
    path = folder / "policy.safetensors"
    untrained().save(path, {**dict.fromkeys(REQUIRED_CARD_KEYS, ""), "task": asdict(SPEC)})
    return path


FEW = SearchSettings(num_samples=8, num_survivors=2)


def shrink_search(patch: pytest.MonkeyPatch) -> None:
    """Have the command line search with few samples, whatever the quality."""
    for quality in QUALITIES:
        patch.setitem(QUALITIES, quality, FEW)


def simulator(search: SimulationSettings = FEW) -> Simulator:
    """Return a simulator along the untrained policy, by default with few samples."""
    return Simulator(untrained(), SPEC, 1, search)


def standing(frames: int, fps: float = 60.0) -> BodyMotion:
    """Return somebody who stands with hanging arms, 2 cm of swaying to the side and bent elbows that swing."""
    time = np.arange(frames) / fps
    still = posed({}, frames)
    hinges = np.zeros((frames, 43))
    hinges[:, hinge("upper_arm_l_x")], hinges[:, hinge("upper_arm_r_x")] = -1.2, 1.2
    hinges[:, hinge("forearm_l_z")] = -0.4 - 0.2 * np.sin(3.0 * time)
    hinges[:, hinge("forearm_r_z")] = 0.4 + 0.2 * np.sin(3.0 * time)
    hinges[:, [hinge("thigh_l_x"), hinge("thigh_r_x")]] = -0.024 * np.sin(2.0 * time)[:, None]
    hinges[:, [hinge("foot_l_x"), hinge("foot_r_x")]] = 0.024 * np.sin(2.0 * time)[:, None]
    root = still.root_position - 0.83 * np.stack([0.0 * time, np.sin(0.024 * np.sin(2.0 * time)), 0.0 * time], axis=1) * [0.0, -1.0, 0.0]
    return replace(still, root_position=root, local_rotations=rotations_from_hinges(still.local_rotations[:, 0], hinges), fps=fps)
