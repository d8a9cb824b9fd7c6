"""Jumps of the root from one frame to the next: closed while a clip is worked on, so that none is smoothed into a slide, and opened again.

What is before and after a jump goes on as if there were none: from frame to frame as far as the steps beside the jump.
"""

from dataclasses import dataclass

import numpy as np

from datasets.damage.spikes import steps_beside
from datasets.joints.joint_tree import JointMap, ancestors
from datasets.motion.clip import Motion
from datasets.motion.humanoid import LEG_LENGTH
from datasets.motion.skeleton import joint_tracks

MIN_JUMP_M, MIN_JUMP_RATIO = 0.2, 5.0  # m, in the humanoid's size, and over the two steps before and after
MAX_PELVIS_ACCELERATION_M_S2 = 100.0  # m/s^2, from frame to frame; a landing's is half of it
MAX_TOLD = 4  # jumps in a line


@dataclass(frozen=True)
class RootJumps:
    """Jumps of a clip's root, N of them.

    Attributes:
        joint: Joint whose position jumps.
        frames: First frame after each jump, ascending, shape (N,).
        shifts: Displacement of the joint in its parent's frame by each jump, beyond the motion there [m], shape (N, 3).
    """

    joint: int
    frames: np.ndarray
    shifts: np.ndarray

    def opened(self, local_positions: np.ndarray) -> np.ndarray:
        """Return local positions (T, J, 3) [m] of a clip without jumps with the jumps in it."""
        return self._displaced(local_positions, 1.0)

    def closed(self, local_positions: np.ndarray) -> np.ndarray:
        """Return local positions (T, J, 3) [m] of a clip with jumps without them: what comes later is moved along."""
        return self._displaced(local_positions, -1.0)

    def _displaced(self, local_positions: np.ndarray, sign: float) -> np.ndarray:
        if not len(self.frames):
            return local_positions
        displaced = local_positions.copy()
        for frame, shift in zip(self.frames, self.shifts, strict=True):
            displaced[frame:, self.joint] += sign * shift
        return displaced


NO_JUMPS = RootJumps(0, np.zeros(0, dtype=int), np.zeros((0, 3)))


def find_root_jumps(motion: Motion, joint_map: JointMap, leg: float) -> RootJumps:
    """Return the jumps of a clip's pelvis.

    Args:
        motion: Clip on its own skeleton.
        joint_map: Joint of each body.
        leg: Length of its legs [m].
    """
    if len(motion) < 3:
        return NO_JUMPS
    pelvis = joint_map["pelvis"]
    positions, _ = joint_tracks(motion.skeleton.parents, motion.local_positions, motion.local_rotations, [pelvis])
    moved = np.diff(positions[:, 0], axis=0) * LEG_LENGTH / leg
    steps = steps_beside(np.linalg.norm(moved, axis=-1)[:, None])
    floor = max(MIN_JUMP_M, MAX_PELVIS_ACCELERATION_M_S2 / motion.fps**2)
    jumps = np.flatnonzero(steps.size > np.maximum(floor, MIN_JUMP_RATIO * np.maximum(steps.before, steps.after)))
    if not len(jumps):
        return NO_JUMPS
    above = ancestors(pelvis, motion.skeleton.parents)
    own = np.diff(motion.local_positions[:, above], axis=0)
    joint = above[int(np.linalg.norm(own[jumps], axis=-1).max(axis=0).argmax())]
    local = np.diff(motion.local_positions[:, joint], axis=0)
    beside = np.stack([local[np.maximum(jumps - 1, 0)], local[np.minimum(jumps + 1, len(local) - 1)]])
    beside[0][jumps == 0] = beside[1][jumps == 0]
    beside[1][jumps == len(local) - 1] = beside[0][jumps == len(local) - 1]
    return RootJumps(joint, jumps + 1, local[jumps] - beside.mean(axis=0))


def jump_notice(jumps: RootJumps, dropped: int, closed: bool) -> str:
    """Return what a person should know of the jumps of a clip, one at least.

    Args:
        jumps: Jumps of the clip.
        dropped: Number of the file's frames before the clip's first.
        closed: Whether they are left out of what is written.
    """
    sizes = np.linalg.norm(jumps.shifts, axis=-1)
    told = [f"{size:.2f} m at frame {frame + dropped + 1}" for frame, size in zip(jumps.frames, sizes, strict=True)][:MAX_TOLD]
    more = f" and {len(sizes) - MAX_TOLD} more" if len(sizes) > MAX_TOLD else ""
    done = "closed; --jumps keep keeps them" if closed else "kept, with nothing smoothed across; --jumps close joins the parts"
    return f"The root jumps from one frame to the next, by {', '.join(told)}{more}: {done}."
