"""Root path of a whole clip from the recurrent network: patch after patch, the same as a stream gives.

N frames, P patches. A patch begins every four frames as long as the clip has all that it sees; the last one's outputs serve for the rest.
"""

import numpy as np
import torch

from agents.root.model import RootModel
from agents.root.recurrent.patches import PATCH_FRAMES, WINDOW_FRAMES, patch_features
from agents.root.recurrent.velocity_filter import PatchMotion, patch_displacements, patch_steps, patch_velocities
from agents.root.spec import RootSpec
from datasets.cleanup.ballistic_flight import com_acceleration
from datasets.imu.root_features import RootFrames


@torch.inference_mode()
def predict_recurrent_path(model: RootModel, frames: RootFrames) -> np.ndarray:
    """Return the path of the pelvis from the clip's first frame on [m], shape (N, 3).

    Args:
        model: Trained recurrent model.
        frames: Frames of a clip, at least as many as a patch sees; ``root`` and ``com`` are not used.
    """
    count = len(frames.heading)
    outputs = model.predict_outputs(torch.from_numpy(clip_features(model.spec, frames))[None])[0].numpy()
    firsts = np.arange(0, count - 1, PATCH_FRAMES)
    outputs = outputs[np.minimum(np.arange(len(firsts)), len(outputs) - 1)]
    steps = patch_steps(outputs.astype(float), patch_motion(frames, firsts, model.spec.accelerations))
    moved = patch_displacements(steps, patch_velocities(steps))
    origins = np.concat([np.zeros((1, 3)), np.cumsum(moved[:-1, -1], axis=0)])
    return np.concat([np.zeros((1, 3)), (origins[:, None] + moved).reshape(-1, 3)])[:count]


def clip_features(spec: RootSpec, frames: RootFrames) -> np.ndarray:
    """Return the raw features of all patches of a clip, shape (P, F).

    Args:
        spec: Spec of a recurrent model.
        frames: Frames of a clip.
    """
    starts = np.arange(0, len(frames.heading) - WINDOW_FRAMES + 1, PATCH_FRAMES)
    windows = starts[:, None] + np.arange(WINDOW_FRAMES)
    return patch_features(frames.joints[windows], frames.heading[starts], frames.accelerations[windows] if spec.accelerations else None)


def patch_motion(frames: RootFrames, firsts: np.ndarray, accelerations: bool) -> PatchMotion:
    """Return what the frames of a clip tell of patches; beyond its end it stays as it is.

    Args:
        frames: Frames of a clip.
        firsts: First frame of each patch, shape (P,).
        accelerations: Whether accelerations are used.
    """
    rows = np.minimum(firsts[:, None] + np.arange(PATCH_FRAMES + 1), len(frames.heading) - 1)
    points, centre = (part.astype(float) for part in (frames.stance_points, frames.centre))
    felt = com_acceleration(frames.accelerations[rows].astype(float)).mean(1) if accelerations else np.zeros((len(firsts), 3))
    return PatchMotion(points[rows], centre[rows], felt, frames.heading[firsts].astype(float))
