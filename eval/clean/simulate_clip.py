"""A whole clip under physics: takes one after the other, trusted where they stay near the clip, and blended into it."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from agents.policy.policy import Policy
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import local_rotations
from datasets.motion.rotation import normalise
from datasets.motion.smoothing import steady
from envs.mimic.spec import MimicSpec
from envs.physics.protocol import FRAMES_PER_STEP
from eval.clean.samcon import Crowd, Take
from eval.metrics.artefact_tracks import distances_local
from eval.metrics.ground_reaction import carried, foot_loads

# m, mean distance of the bodies from the clip's, roots aligned: trusted wholly up to the one, not at all from the other on.
NEAR, FAR = 0.02, 0.05
ANCHOR = 1.0  # s, standard deviation of the average by which the performance is led back to the clip's path
BLEND = 0.1  # s, standard deviation of the average over which trust comes and goes
SEAM = 0.15  # s, before and after each seam, in which it goes and comes: there the performance jumps, or ends


class Performed(NamedTuple):
    """What became of a clip of T frames under physics.

    Attributes:
        motion: The performance where it is trusted, the clip where it is not, blended in between.
        contacts: Whether the left and the right foot carried weight; none where physics was not trusted, shape (T, 2).
        trust: Share of the performance in each frame, shape (T,).
        starts: Frames at which the agent began, or began again.
    """

    motion: BodyMotion
    contacts: np.ndarray
    trust: np.ndarray
    starts: list[int]


def untouched(clip: BodyMotion) -> Performed:
    """Return a clip that physics left alone."""
    return Performed(clip, np.zeros((len(clip), 2), dtype=bool), np.zeros(len(clip)), [])


def perform_clip(policy: Policy, spec: MimicSpec, clip: BodyMotion, threads: int, joins: tuple[bool, bool] = (False, False)) -> Performed:
    """Let a crowd of humanoids perform a clip, and blend the best performance into it.

    Args:
        policy: Whose actions are searched along.
        spec: Variant of the task that it was trained for.
        clip: At 60 fps, on level ground.
        threads: Native threads.
        joins: Whether frames that are not performed come before the clip and after it.
    """
    whole = clip if len(clip) % FRAMES_PER_STEP else _lasting(clip)  # so that the last control step ends in the last frame
    takes = list(Crowd(policy, spec, whole, threads).takes())
    performance, contacts = whole, np.zeros((len(whole), 2), dtype=bool)
    for take in takes:  # a take begins with the last frame of the one before, as the reference has it
        performance = insert_take(performance, take)
        part = slice(take.start, take.start + len(take.poses))
        contacts[part] = carried(foot_loads(take.poses, take.velocities, take.targets))
    starts = [take.start for take in takes]
    trust = _trust(performance, whole, [*starts[1:], *([-1] if joins[0] else []), *([len(clip)] if joins[1] else [])])
    blended = steady(_blend(whole, performance, trust, starts))  # the search's noise trembles in the motors
    frames = slice(len(clip))
    return Performed(blended.cut(0, len(clip)), (contacts & (trust >= 0.5)[:, None])[frames], trust[frames], starts)


def _lasting(clip: BodyMotion) -> BodyMotion:
    """Return a clip whose last frame lasts for another one."""
    frames = np.append(np.arange(len(clip)), len(clip) - 1)
    return replace(clip, root_position=clip.root_position[frames], local_rotations=clip.local_rotations[frames])


def insert_take(clip: BodyMotion, take: Take) -> BodyMotion:
    """Return the clip with the poses of a take in their place."""
    root, local = clip.root_position.copy(), clip.local_rotations.copy()
    part = slice(take.start, take.start + len(take.poses))
    root[part], local[part] = take.poses[:, :3], local_rotations(normalise(take.poses[:, 3:7]), take.poses[:, 7:])
    return replace(clip, root_position=root, local_rotations=local)


def _trust(performance: BodyMotion, clip: BodyMotion, seams: list[int]) -> np.ndarray:
    """Return how far a performance is trusted, by how near it stays to the clip and how far it is from a seam, shape (T,)."""
    away = distances_local(performance, clip).mean(axis=1)
    trust = gaussian_filter1d(_smooth_step((FAR - away) / (FAR - NEAR)), BLEND * clip.fps, mode="nearest")
    for seam in seams:
        trust *= _smooth_step(np.abs(np.arange(len(clip)) - seam) / (SEAM * clip.fps))
    return trust


def _smooth_step(x: np.ndarray) -> np.ndarray:
    """Return a curve that rises from 0 at zero to 1 at one, and is level beyond them."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def _blend(clip: BodyMotion, performance: BodyMotion, trust: np.ndarray, starts: list[int]) -> BodyMotion:
    """Return the performance where it is trusted and the clip where it is not.

    Over the ground it is steps that are blended, not places: where the performance drifted, what comes after goes on from there, and
    all of it is led back to the clip's own path so slowly that no foot slides.
    """
    steps, own = (np.diff(motion.root_position, axis=0, prepend=motion.root_position[:1]) for motion in (performance, clip))
    for start in starts:  # from one take's end to the next one's beginning is no step
        steps[start] = own[start]
    root = clip.root_position[0] + np.cumsum(own + trust[:, None] * (steps - own), axis=0)
    root += gaussian_filter1d(clip.root_position - root, ANCHOR * clip.fps, axis=0, mode="nearest")
    root[:, 2] = clip.root_position[:, 2] + trust * (performance.root_position - clip.root_position)[:, 2]
    one, two, share = clip.local_rotations, performance.local_rotations, trust[:, None, None]
    two = np.where(np.sum(one * two, axis=-1, keepdims=True) < 0.0, -two, two)
    return replace(clip, root_position=root, local_rotations=normalise(one + share * (two - one)))
