"""A clip on the 20 bodies as it is read again from a file: through the calibration that reading makes of any performer."""

from dataclasses import replace

from datasets.motion.clip import BodyMotion
from datasets.performer.performer_clip import performer_clip_from_bvh
from datasets.retarget.humanoid_bvh import to_humanoid_bvh
from datasets.retarget.retarget import retarget


def read_from_bvh(clip: BodyMotion) -> BodyMotion:
    """Return a clip as it is read from the BVH that it would be written to, without leading frames of a T-pose.

    Args:
        clip: Clip, at a rate that is kept.

    Raises:
        InputError: If nobody can be made of it, as of a clip of too few frames.
    """
    read = retarget(performer_clip_from_bvh(to_humanoid_bvh(clip), clip.name)).motion
    return replace(clip, root_position=read.root_position, local_rotations=read.local_rotations)
