"""Windows of a clip for root models: features, and the true path as targets, all facing forward.

B windows, W frames each, F features. Every window is rotated about the vertical so that its first frame faces x
(thesis 2.4.3 and 3.4.1).
"""

import torch
from torch.nn import functional

from agents.root.spec import RootSpec
from datasets.imu.root_features import RootFrames, to_heading_frame


def window_features(spec: RootSpec, frames: RootFrames, starts: torch.Tensor) -> torch.Tensor:
    """Return the features (B, W, F) of windows.

    Args:
        spec: Spec of the model.
        frames: Frames of the clip, torch.
        starts: First frame of each window, shape (B,).
    """
    rows = starts[:, None] + torch.arange(spec.window)
    joints = frames.joints[rows]
    if not spec.predicts_steps_ahead:
        turned = to_heading_frame(joints[:, :, 1:], frames.heading[starts]).flatten(2)
        return functional.pad(turned, (0, spec.features - turned.shape[-1]))
    vectors = torch.cat([joints, frames.accelerations[rows]], 2) if spec.accelerations else joints
    return to_heading_frame(vectors, frames.heading[starts]).flatten(2)


def window_targets(spec: RootSpec, frames: RootFrames, starts: torch.Tensor) -> torch.Tensor:
    """Return the target paths of windows [m], shape (B, W, 3).

    For "root3d" s_k = T_(n+k+1) - T_n for k = 0..7 (thesis eq. 3.4, docs/errata.md); for the planar networks the path along the
    window from its start, with absolute heights if ``spec.vertical`` is "height" (thesis 2.4.4). The arguments are those of
    ``window_features``; a window of "root3d" needs one frame after its last.
    """
    path = frames.com if spec.target == "com" else frames.root
    rows = starts[:, None] + torch.arange(spec.window) + int(spec.predicts_steps_ahead)
    steps = path[rows] - path[starts][:, None]
    turned = to_heading_frame(steps, frames.heading[starts])
    if spec.vertical == "height":
        turned[..., 2] = path[rows][..., 2]
    return turned
