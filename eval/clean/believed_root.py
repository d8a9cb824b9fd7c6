"""The choice of a clip's root in cleaning: the recording's own where it can be believed, else Root3D's."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from agents.weights.pretrained import IMU_ROOT_MODEL, POSE_ROOT_MODEL, load_pretrained_root, reconstruct_root_on_ground
from datasets.cleanup.ground_levelling import free_flights, is_floating, level_to_landings
from datasets.cleanup.off_feet_spans import OffFeetSpan, find_off_feet_spans
from datasets.imu.root_features import ROOT_RATE_HZ
from datasets.motion.clip import BodyMotion


class LocatedRoot(NamedTuple):
    """A clip of T frames with a root.

    Attributes:
        motion: Clip; the recorded object itself if its root is believed.
        off_feet: Spans in which somebody sits, lies, climbs or is carried.
        flies: Frames in which a believed root falls freely, so that no foot stands, shape (T,).
    """

    motion: BodyMotion
    off_feet: list[OffFeetSpan]
    flies: np.ndarray


def locate_root(recorded: BodyMotion, accelerations: np.ndarray | None = None) -> LocatedRoot:
    """Return a clip with the recording's own root where that can be believed, else with what Root3D reconstructs from the poses.

    It is believed if the file has a root that does not float for longer than a jump: somebody in the air who neither climbs nor is
    carried is there by the recording's fault. If jumps fall freely once their landings are on the ground, only the heights have drifted,
    and the root is the recording's own on these landings.

    Args:
        recorded: Retargeted clip at 60 fps.
        accelerations: Free accelerations that the recording holds, at 100 Hz [m/s^2], shape (N, 19, 3).
    """
    off_feet, flies = find_off_feet_spans(recorded), np.zeros(len(recorded), dtype=bool)
    if recorded.rooted and off_feet:
        return LocatedRoot(recorded, off_feet, flies)
    if recorded.rooted:
        landed = level_to_landings(recorded)
        flies = free_flights(landed)
        if not is_floating(recorded):
            return LocatedRoot(recorded, off_feet, flies)
        if flies.any():
            return LocatedRoot(landed, find_off_feet_spans(landed), flies)
    rooted = reconstruct_missing_root(recorded, accelerations)
    return LocatedRoot(rooted, find_off_feet_spans(rooted), flies)


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
