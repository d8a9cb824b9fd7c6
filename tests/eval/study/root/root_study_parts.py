"""Clips and finished trainings for the tests of the root study."""

from dataclasses import asdict, replace

import numpy as np

from agents.root.model import RootModel
from configs.load import save_config
from datasets.imu.sensor_model import SENSOR_BODIES
from datasets.motion.clip import BodyMotion
from eval.runs.training_spec import Training
from eval.study.root.evaluation_takes import EvaluationTake
from tests.builders import STANDING, posed
from trainers.runs.checkpoint import save_checkpoint
from trainers.runs.progress import RunClock
from trainers.supervised.root_config import RootConfig


def gliding(name: str, kind: str, velocity: tuple[float, float, float], seconds: float = 3.0, system: str = "optical") -> BodyMotion:
    """Return a clip at 100 Hz of somebody who stands upright and glides at a velocity [m/s] in the world."""
    clip = posed({"upper_arm_l_x": -70.0, "upper_arm_r_x": 70.0}, frames=round(100.0 * seconds) + 1)
    t = np.arange(len(clip))[:, None] / 100.0
    root = np.array([0.0, 0.0, STANDING]) + t * np.array(velocity)
    return replace(clip, root_position=root, fps=100.0, name=name, performer=name.split("_")[0], kind=kind, system=system)


def take(clip: BodyMotion) -> EvaluationTake:
    """Return a clip as an optical system has it, without accelerations."""
    return EvaluationTake(clip, clip, np.zeros((len(clip), len(SENSOR_BODIES), 3)))


def leave(training: Training[RootConfig], samples: int) -> None:
    """Leave what a run leaves after so many windows."""
    (training.folder / "best").mkdir(parents=True, exist_ok=True)
    save_config(training.resolve_config(), training.folder / "config.yaml")
    save_checkpoint(training.folder / "checkpoints", samples, {"clock": asdict(RunClock(samples=samples, seconds=30.0))})
    RootModel(training.resolve_config().model).save(training.weights_path, {})
