"""The stages of cleaning, on the 20 bodies: a root, steadiness, level ground, limbs apart, physics."""

from dataclasses import replace

import numpy as np

from agents.policy.policy import Policy
from agents.root.reconstruct import reconstruct_root
from agents.weights.pretrained import shipped_root_model
from datasets.cleanup.foot_contacts import foot_contacts
from datasets.cleanup.ground_levelling import level_ground
from datasets.cleanup.off_feet_segments import Span
from datasets.imu.root_features import RATE
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import on_ground
from datasets.motion.smoothing import steady
from envs.mimic.spec import MimicSpec
from envs.physics.self_collision import separate
from eval.clean.simulate_clip import Performed, perform_clip, untouched

SHORTEST = 60  # frames, of what is worth performing


def give_root(clip: BodyMotion) -> BodyMotion:
    """Return a clip whose recording did not say where the pelvis went with the root that a model gives it; itself if it is too short."""
    model = shipped_root_model("root3d_pose")
    too_short = (len(clip) - 1) / clip.fps < (model.spec.window - 1) / RATE
    # Its heights drift: who believes them sees stairs.
    return clip if too_short else replace(on_ground(reconstruct_root(model, clip)), rooted=False)


def repair(clip: BodyMotion, elsewhere: list[Span]) -> BodyMotion:
    """Return the clip without jitter, on level ground and with limbs that do not pass through the body: what needs no physics.

    Args:
        clip: At 60 fps.
        elsewhere: Where it is not on level ground: heights there go on as they are.
    """
    smooth = steady(clip)
    frames = np.arange(len(clip))
    ground = frames[~inside(elsewhere, len(clip))]
    if len(ground):
        lower = (level_ground(smooth).root_position - smooth.root_position)[:, 2]
        offset = np.interp(frames, ground, lower[ground])
        smooth = replace(smooth, root_position=smooth.root_position + offset[:, None] * (0.0, 0.0, 1.0))
    return separate(smooth)


def perform(policy: Policy | None, spec: MimicSpec, clip: BodyMotion, elsewhere: list[Span], threads: int) -> Performed:
    """Return what physics makes of a repaired clip wherever that is on level ground.

    Where physics is not trusted feet stand by their looks.

    Args:
        policy: Trained for ``spec``; none to leave physics out.
        spec: Variant of the task.
        clip: At 60 fps, repaired.
        elsewhere: Where it is not on level ground.
        threads: Native threads.
    """
    edges = np.flatnonzero(np.diff(np.concat([[True], inside(elsewhere, len(clip)), [True]]).astype(int)))
    performed = untouched(clip)
    for start, stop in edges.reshape(-1, 2):
        if policy is not None and stop - start >= SHORTEST:
            part = perform_clip(policy, spec, clip.cut(start, stop), threads, (start > 0, stop < len(clip)))
            performed = _join(performed, part, start, stop)
    looks = foot_contacts(performed.motion) & ~inside(elsewhere, len(clip))[:, None]
    contacts = np.where((performed.trust >= 0.5)[:, None], performed.contacts, looks)
    return performed._replace(motion=separate(performed.motion), contacts=contacts)


def inside(spans: list[Span], frames: int) -> np.ndarray:
    """Return which of so many frames lie in a span, shape (frames,)."""
    return np.isin(np.arange(frames), np.concat([np.arange(0), *(np.arange(span.start, span.stop) for span in spans)]))


def _join(whole: Performed, part: Performed, start: int, stop: int) -> Performed:
    """Return a clip with the frames from ``start`` to ``stop`` as they were performed, and all after them carried along."""
    motion, contacts, trust = whole.motion, whole.contacts.copy(), whole.trust.copy()
    root, local = motion.root_position.copy(), motion.local_rotations.copy()
    level = np.array([1.0, 1.0, 0.0])
    path = part.motion.root_position + level * (root[start] - part.motion.root_position[0])
    root[stop:] += level * (path[-1] - root[stop - 1])
    root[start:stop], local[start:stop] = path, part.motion.local_rotations
    contacts[start:stop], trust[start:stop] = part.contacts, part.trust
    starts = [*whole.starts, *(start + frame for frame in part.starts)]
    return Performed(replace(motion, root_position=root, local_rotations=local), contacts, trust, starts)
