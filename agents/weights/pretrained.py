"""Pretrained models in the package; ``agents/weights/README.md`` lists their training data."""

from functools import cache

import numpy as np

from agents.restore.model import RestoreModel
from agents.restore.restore import Restoration, restore_poses
from agents.root.model import RootModel
from agents.root.reconstruct import reconstruct_root
from configs.source_code import PROJECT_ROOT
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import place_on_ground

WEIGHTS_FOLDER = PROJECT_ROOT / "agents" / "weights"
PRETRAINED_POLICY = WEIGHTS_FOLDER / "mimic.safetensors"
PRETRAINED_LOWER_BODY = WEIGHTS_FOLDER / "lower_body.safetensors"
PRETRAINED_RESTORE = WEIGHTS_FOLDER / "restore.safetensors"
IMU_ROOT_MODEL = "root3d"  # for clips with a suit's accelerations
POSE_ROOT_MODEL = "root3d_pose"  # for clips without


@cache
def load_pretrained_root(name: str) -> RootModel:
    """Return a pretrained root model of the package.

    Args:
        name: Name of the model: "root3d", "root3d_pose" or "planar".

    Raises:
        InputError: If the package has no such model.
    """
    return RootModel.load(WEIGHTS_FOLDER / f"{name}.safetensors")[0]


def reconstruct_root_on_ground(name: str, clip: BodyMotion, accelerations: np.ndarray | None = None, *, level: bool) -> BodyMotion:
    """Return a clip with the root that a pretrained model predicts for it, placed on the ground.

    Args:
        name: Name of the model, as in ``load_pretrained_root``.
        clip: Clip of any rate; its own root is not used.
        accelerations: Free accelerations of a suit at 100 Hz [m/s^2], shape (N, 19, 3).
        level: Whether height drift is corrected wherever feet stand. Trainings do so; ``eval.clean`` levels in a
            stage of its own, recorded and reconstructed roots alike.
    """
    return place_on_ground(reconstruct_root(load_pretrained_root(name), clip, accelerations, level=level))


@cache
def load_pretrained_restore() -> RestoreModel:
    """Return the pretrained restoring network of the package."""
    return RestoreModel.load(PRETRAINED_RESTORE)[0]


def restore_suit_poses(clip: BodyMotion) -> Restoration:
    """Return a suit's clip with the faults taken out of its poses by the package's restoring network; its root path is not touched.

    Args:
        clip: Clip of any rate and length.
    """
    return restore_poses(load_pretrained_restore(), clip)
