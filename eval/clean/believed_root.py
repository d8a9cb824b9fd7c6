"""The choice of a clip's root in cleaning: the recording's own where it can be believed, else Root3D's."""

from dataclasses import replace

import numpy as np

from agents.weights.pretrained import IMU_ROOT_MODEL, POSE_ROOT_MODEL, load_pretrained_root, reconstruct_root_on_ground
from datasets.cleanup.ground_levelling import falls_freely, is_floating, level_to_landings
from datasets.cleanup.off_feet_spans import OffFeetSpan, find_off_feet_spans
from datasets.imu.root_features import ROOT_RATE_HZ
from datasets.motion.clip import BodyMotion


def locate_root(recorded: BodyMotion, accelerations: np.ndarray | None = None) -> tuple[BodyMotion, list[OffFeetSpan]]:
    """Return the clip with a root, and the spans in which somebody sits, lies, climbs or is carried.

    The root is the recording's own, and the clip the same object, if the file has a root that does not float for longer than a jump:
    somebody in the air who neither climbs nor is carried is there by the recording's fault. If only the heights drifted, as jumps tell
    that fall freely once their landings are on the ground, the root is the recording's own on these. Else Root3D reconstructs it from the
    poses.

    Args:
        recorded: Retargeted clip at 60 fps.
        accelerations: Free accelerations that the recording holds, at 100 Hz [m/s^2], shape (N, 19, 3).
    """
    off_feet = find_off_feet_spans(recorded)
    if recorded.rooted and (off_feet or not is_floating(recorded)):
        return recorded, off_feet
    landed = level_to_landings(recorded)
    if recorded.rooted and falls_freely(landed):
        return landed, find_off_feet_spans(landed)
    rooted = reconstruct_missing_root(recorded, accelerations)
    return rooted, find_off_feet_spans(rooted)


def reconstruct_missing_root(clip: BodyMotion, accelerations: np.ndarray | None = None) -> BodyMotion:
    """Return the clip with the root that Root3D reads from its poses and accelerations, on the ground.

    Args:
        clip: Clip at 60 fps; it is returned itself if it is shorter than the model's window.
        accelerations: Free accelerations at 100 Hz [m/s^2], shape (N, 19, 3); None if there are none.
    """
    name = POSE_ROOT_MODEL if accelerations is None else IMU_ROOT_MODEL
    model = load_pretrained_root(name)
    too_short = (len(clip) - 1) / clip.fps < (model.spec.window - 1) / ROOT_RATE_HZ
    # Not rooted: its heights drift, and whoever believed them would see stairs.
    return clip if too_short else replace(reconstruct_root_on_ground(name, clip, accelerations, level=False), rooted=False)
