"""A motion folder small enough to train on in seconds."""

from pathlib import Path

import numpy as np
import pytest

from datasets.library import sources
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_COUNT
from trainers.algorithms.ppo_config import CollectConfig, LearnerConfig, NetworkConfig, PpoConfig
from trainers.data.motion_config import DataConfig


def standing(name: str, performer: str, frames: int = 240) -> BodyMotion:
    """Return a T-pose that sways a little, feet on the ground: 0.03 + 0.83 + 0.08 m below the pelvis."""
    sway = 0.01 * np.sin(np.linspace(0.0, 6.0, frames))
    root = np.stack([sway, np.zeros(frames), np.full(frames, 0.94)], axis=1)
    rotations = np.zeros((frames, BODY_COUNT, 4))
    rotations[..., 0] = 1.0
    return BodyMotion(root, rotations, 60.0, name, performer, "optical", "stand")


def small_run(name: str, folder: Path) -> PpoConfig:
    """Return the config of a run of six iterations, in one process."""
    return PpoConfig(
        name=name,
        runs_dir=str(folder),
        data=DataConfig(suit_clips=0),
        network=NetworkConfig(hidden=(16,)),
        collect=CollectConfig(actors=0, envs=4, threads=1, horizon=8),
        learner=LearnerConfig(epochs=2, minibatch=16, learning_rate=1e-3, threads=1),
        device="cpu",
        samples=6 * 32,
        evaluate_every=3,
        checkpoint_every=2,
    )


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> PpoConfig:
    """Return the config of a small run on two standing performers."""
    clips = [standing("one", "ann"), standing("two", "bob", 130)]
    monkeypatch.setattr(sources, "load_clips", lambda *_, **__: clips)
    monkeypatch.setattr(
        "trainers.data.training_motions.load_source_motions", lambda *_, **__: [sources.SourceMotion(clip) for clip in clips]
    )
    return small_run("tiny", tmp_path / "runs")
