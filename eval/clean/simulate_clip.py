"""A whole clip under physics: takes one after the other, trusted where they stay near the clip, and blended into it."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from agents.policy.policy import Policy
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import rotations_from_hinges
from datasets.motion.rotation import normalise
from datasets.motion.smoothing import smooth_motion
from envs.mimic.spec import MimicSpec
from envs.physics.protocol import FRAMES_PER_STEP
from eval.clean.samcon import SamconSearch, Segment
from eval.metrics.artefact_tracks import distances_local
from eval.metrics.ground_reaction import contacts_from_loads, foot_loads

# m, mean distance of the bodies from the clip's, roots aligned: trusted wholly up to the one, not at all from the other on.
FULL_CONFIDENCE_ERROR_M, ZERO_CONFIDENCE_ERROR_M = 0.02, 0.05
DRIFT_CORRECTION_STD_S = 1.0  # s, standard deviation of the average by which the performance is led back to the clip's path
CONFIDENCE_SMOOTHING_STD_S = 0.1  # s, standard deviation of the average over which trust comes and goes
RESTART_FADE_S = 0.15  # s, before and after each seam, in which it goes and comes: there the performance jumps, or ends


class SimulatedClip(NamedTuple):
    """What became of a clip of T frames under physics.

    Attributes:
        motion: The performance where it is trusted, the clip where it is not, blended in between.
        contacts: Whether the left and the right foot carried weight; none where physics was not trusted, shape (T, 2).
        confidence: Share of the performance in each frame, shape (T,).
        segment_starts: Frames at which the agent began, or began again.
    """

    motion: BodyMotion
    contacts: np.ndarray
    confidence: np.ndarray
    segment_starts: list[int]


def without_simulation(clip: BodyMotion) -> SimulatedClip:
    """Return a clip that physics left alone."""
    return SimulatedClip(clip, np.zeros((len(clip), 2), dtype=bool), np.zeros(len(clip)), [])


def simulate_clip(
    policy: Policy, spec: MimicSpec, clip: BodyMotion, threads: int, fade_ends: tuple[bool, bool] = (False, False)
) -> SimulatedClip:
    """Let a crowd of humanoids perform a clip, and blend the best performance into it.

    Args:
        policy: Whose actions are searched along.
        spec: Variant of the task that it was trained for.
        clip: At 60 fps, on level ground.
        threads: Native threads.
        fade_ends: Whether frames that are not performed come before the clip and after it.
    """
    padded = clip if len(clip) % FRAMES_PER_STEP else _repeat_last_frame(clip)  # so that the last control step ends in the last frame
    segments = list(SamconSearch(policy, spec, padded, threads).segments())
    simulated, contacts = padded, np.zeros((len(padded), 2), dtype=bool)
    for take in segments:  # a take begins with the last frame of the one before, as the reference has it
        simulated = write_segment(simulated, take)
        part = slice(take.start, take.start + len(take.poses))
        contacts[part] = contacts_from_loads(foot_loads(take.poses, take.velocities, take.targets))
    segment_starts = [take.start for take in segments]
    confidence = _confidence(
        simulated, padded, [*segment_starts[1:], *([-1] if fade_ends[0] else []), *([len(clip)] if fade_ends[1] else [])]
    )
    blended = smooth_motion(_blend(padded, simulated, confidence, segment_starts))  # the search's noise trembles in the motors
    frames = slice(len(clip))
    return SimulatedClip(blended.cut(0, len(clip)), (contacts & (confidence >= 0.5)[:, None])[frames], confidence[frames], segment_starts)


def _repeat_last_frame(clip: BodyMotion) -> BodyMotion:
    """Return a clip whose last frame lasts for another one."""
    frames = np.append(np.arange(len(clip)), len(clip) - 1)
    return replace(clip, root_position=clip.root_position[frames], local_rotations=clip.local_rotations[frames])


def write_segment(clip: BodyMotion, segment: Segment) -> BodyMotion:
    """Return the clip with the poses of a take in their place."""
    root, local = clip.root_position.copy(), clip.local_rotations.copy()
    part = slice(segment.start, segment.start + len(segment.poses))
    root[part], local[part] = segment.poses[:, :3], rotations_from_hinges(normalise(segment.poses[:, 3:7]), segment.poses[:, 7:])
    return replace(clip, root_position=root, local_rotations=local)


def _confidence(simulated: BodyMotion, clip: BodyMotion, restarts: list[int]) -> np.ndarray:
    """Return how far a performance is trusted, by how near it stays to the clip and how far it is from a seam, shape (T,)."""
    pose_errors = distances_local(simulated, clip).mean(axis=1)
    confidence = gaussian_filter1d(
        _smooth_step((ZERO_CONFIDENCE_ERROR_M - pose_errors) / (ZERO_CONFIDENCE_ERROR_M - FULL_CONFIDENCE_ERROR_M)),
        CONFIDENCE_SMOOTHING_STD_S * clip.fps,
        mode="nearest",
    )
    for seam in restarts:
        confidence *= _smooth_step(np.abs(np.arange(len(clip)) - seam) / (RESTART_FADE_S * clip.fps))
    return confidence


def _smooth_step(x: np.ndarray) -> np.ndarray:
    """Return a curve that rises from 0 at zero to 1 at one, and is level beyond them."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def _blend(clip: BodyMotion, simulated: BodyMotion, confidence: np.ndarray, segment_starts: list[int]) -> BodyMotion:
    """Return the performance where it is trusted and the clip where it is not.

    Over the ground it is steps that are blended, not places: where the performance drifted, what comes after goes on from there, and
    all of it is led back to the clip's own path so slowly that no foot slides.
    """
    steps, own = (np.diff(motion.root_position, axis=0, prepend=motion.root_position[:1]) for motion in (simulated, clip))
    for start in segment_starts:  # from one take's end to the next one's beginning is no step
        steps[start] = own[start]
    root = clip.root_position[0] + np.cumsum(own + confidence[:, None] * (steps - own), axis=0)
    root += gaussian_filter1d(clip.root_position - root, DRIFT_CORRECTION_STD_S * clip.fps, axis=0, mode="nearest")
    root[:, 2] = clip.root_position[:, 2] + confidence * (simulated.root_position - clip.root_position)[:, 2]
    one, two, share = clip.local_rotations, simulated.local_rotations, confidence[:, None, None]
    two = np.where(np.sum(one * two, axis=-1, keepdims=True) < 0.0, -two, two)
    return replace(clip, root_position=root, local_rotations=normalise(one + share * (two - one)))
