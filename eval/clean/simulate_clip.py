"""Simulates a whole clip: segments of simulation one after the other, blended into the clip by how near they stay to it."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from datasets.motion.clip import BodyMotion
from datasets.motion.curves import smooth_step
from datasets.motion.frame_blocks import frame_blocks
from datasets.motion.humanoid import rotations_from_hinges
from datasets.motion.rotation import normalise
from datasets.motion.smoothing import smooth_motion
from envs.physics.engine_interface import FRAMES_PER_STEP
from envs.physics.segment import Segment
from eval.clean.apply_edits import share_beside
from eval.clean.optimisation.receding_horizon import TrajectoryOptimiser
from eval.clean.quality import OptimisationSettings, Simulator
from eval.clean.result import SIMULATED_CONFIDENCE
from eval.clean.samcon import SamconSearch
from eval.metrics.artefact_tracks import distances_local
from eval.metrics.ground_reaction import contacts_from_loads, foot_loads

# Mean distance of the bodies from the clip's, roots aligned: confidence is 1 up to the first and 0 from the second on.
FULL_CONFIDENCE_ERROR_M, ZERO_CONFIDENCE_ERROR_M = 0.02, 0.05
DRIFT_CORRECTION_STD_S = 1.0  # of the Gaussian mean by which the simulated path is led back to the clip's
CONFIDENCE_SMOOTHING_STD_S = 0.1  # of the Gaussian mean of the confidence
RESTART_FADE_S = 0.15  # before and after each restart, where the simulation jumps or ends, and where it needed more help than is allowed
_ROUNDING_BW = 1e-6  # of forces in single precision


class SimulatedClip(NamedTuple):
    """A clip of T frames with its simulation blended in.

    Attributes:
        motion: The simulation where confidence is 1, the clip where it is 0, blended in between.
        contacts: Whether the left and the right foot carried weight in simulated frames, shape (T, 2).
        confidence: Share of the simulation in each frame, shape (T,).
        segment_starts: Frames at which the simulation began, or began again.
        assist: Force that helped on the pelvis in simulated frames [body weights], shape (T,).
    """

    motion: BodyMotion
    contacts: np.ndarray
    confidence: np.ndarray
    segment_starts: list[int]
    assist: np.ndarray


def without_simulation(clip: BodyMotion) -> SimulatedClip:
    """Return a clip without simulation: confidence 0 throughout."""
    return SimulatedClip(clip, np.zeros((len(clip), 2), dtype=bool), np.zeros(len(clip)), [], np.zeros(len(clip)))


def simulate_clip(
    simulator: Simulator,
    clip: BodyMotion,
    fade_ends: tuple[bool, bool] = (False, False),
    after_frames: Callable[[int], None] = lambda _: None,
) -> SimulatedClip:
    """Simulate a clip and blend the result into it.

    Args:
        simulator: Policy and settings of the simulation.
        clip: Clip on level ground, at 60 fps.
        fade_ends: Whether frames without simulation come before the clip, and after it.
        after_frames: Called with the number of frames that were simulated, again and again.
    """
    return blend_segments(clip, search_segments(simulator, clip, after_frames), simulator.search.assist_force_bw, fade_ends)


def search_segments(simulator: Simulator, clip: BodyMotion, after_frames: Callable[[int], None] = lambda _: None) -> list[Segment]:
    """Return the simulation of a clip, which may go on for a frame after its end; arguments are those of ``simulate_clip``."""
    clip, settings = _padded(clip), simulator.search
    if isinstance(settings, OptimisationSettings):
        return list(TrajectoryOptimiser(clip, settings.max_passes, simulator.threads, after_frames).segments())
    return list(SamconSearch(simulator, settings, clip, after_frames=after_frames).segments())


def blend_segments(
    clip: BodyMotion,
    segments: Sequence[Segment],
    max_assist_bw: float,
    fade_ends: tuple[bool, bool] = (False, False),
    limit: np.ndarray | None = None,
) -> SimulatedClip:
    """Return a clip with its simulation blended in.

    Args:
        clip: Clip on level ground, at 60 fps, T frames.
        segments: Its simulation, from ``search_segments``.
        max_assist_bw: Largest force on the pelvis [body weights] with which a frame counts as physics.
        fade_ends: Whether frames without simulation come before the clip, and after it.
        limit: Largest share of the simulation in each frame, shape (T,); 1 if None.
    """
    padded = _padded(clip)
    simulated, contacts, assist = write_segments(padded, segments), np.zeros((len(padded), 2), dtype=bool), np.zeros(len(padded))
    for segment in segments:
        part = slice(segment.start, segment.start + len(segment.poses))
        contacts[part] = contacts_from_loads(foot_loads(segment.poses, segment.velocities, segment.targets))
        assist[part] = segment.assist
    segment_starts = [segment.start for segment in segments]
    ends = [*([-1] if fade_ends[0] else []), *([len(clip)] if fade_ends[1] else [])]
    confidence = _confidence(simulated, padded, [*segment_starts[1:], *ends])
    confidence *= 1.0 - share_beside(assist > max_assist_bw + _ROUNDING_BW, RESTART_FADE_S * padded.fps)
    if limit is not None:
        confidence *= np.append(limit, limit[-1:])[: len(padded)]
    blended = smooth_motion(_blend(padded, simulated, confidence, segment_starts))  # the search's noise shakes the joints
    frames = slice(len(clip))
    trusted = confidence >= SIMULATED_CONFIDENCE
    contacts &= trusted[:, None]
    return SimulatedClip(blended.cut(0, len(clip)), contacts[frames], confidence[frames], segment_starts, (assist * trusted)[frames])


def cut_segments(segments: Sequence[Segment], start: int, stop: int) -> list[Segment]:
    """Return the simulation from a frame up to another; of pieces shorter than a control step, none."""
    pieces = []
    for one in segments:
        part = slice(max(start - one.start, 0), max(stop - one.start, 0))
        if len(one.poses[part]) > FRAMES_PER_STEP:
            pieces.append(Segment(one.start + part.start, *(track[part] for track in one[1:])))
    return pieces


def _padded(clip: BodyMotion) -> BodyMotion:
    """Return the clip with so many frames that the last control step ends in the last one."""
    return clip if len(clip) % FRAMES_PER_STEP else _repeat_last_frame(clip)


def _repeat_last_frame(clip: BodyMotion) -> BodyMotion:
    """Return the clip with its last frame once more."""
    frames = np.append(np.arange(len(clip)), len(clip) - 1)
    return replace(clip, root_position=clip.root_position[frames], local_rotations=clip.local_rotations[frames])


def write_segments(clip: BodyMotion, segments: Sequence[Segment]) -> BodyMotion:
    """Return the clip with the poses of segments in their frames; each may begin in the last frame of the one before, and counts there."""
    root, local = clip.root_position.copy(), clip.local_rotations.copy()
    for segment in segments:
        for block in frame_blocks(len(segment.poses)):
            poses, part = segment.poses[block], slice(segment.start + block.start, segment.start + block.stop)
            root[part], local[part] = poses[:, :3], rotations_from_hinges(normalise(poses[:, 3:7]), poses[:, 7:])
    return replace(clip, root_position=root, local_rotations=local)


def _confidence(simulated: BodyMotion, clip: BodyMotion, restarts: list[int]) -> np.ndarray:
    """Return the confidence of a simulation, shape (T,): 1 near the clip and far from restarts, 0 where it left the clip."""
    pose_errors = distances_local(simulated, clip).mean(axis=1)
    confidence = gaussian_filter1d(
        smooth_step((ZERO_CONFIDENCE_ERROR_M - pose_errors) / (ZERO_CONFIDENCE_ERROR_M - FULL_CONFIDENCE_ERROR_M)),
        CONFIDENCE_SMOOTHING_STD_S * clip.fps,
        mode="nearest",
    )
    reach = int(np.ceil(RESTART_FADE_S * clip.fps))
    for frame in restarts:
        near = np.arange(max(0, frame - reach), min(len(clip), frame + reach + 1))
        confidence[near] *= smooth_step(np.abs(near - frame) / (RESTART_FADE_S * clip.fps))
    return confidence


def _blend(clip: BodyMotion, simulated: BodyMotion, confidence: np.ndarray, segment_starts: list[int]) -> BodyMotion:
    """Return the clip with its simulation blended in by confidence.

    Over the ground displacements from frame to frame are blended, not positions: what follows a drift goes on from where it led, and
    the whole path is led back to the clip's so slowly that no foot slides.
    """
    steps, own = (np.diff(motion.root_position, axis=0, prepend=motion.root_position[:1]) for motion in (simulated, clip))
    for start in segment_starts:  # from the end of a segment to the start of the next is no displacement
        steps[start] = own[start]
    root = clip.root_position[0] + np.cumsum(own + confidence[:, None] * (steps - own), axis=0)
    root += gaussian_filter1d(clip.root_position - root, DRIFT_CORRECTION_STD_S * clip.fps, axis=0, mode="nearest")
    root[:, 2] = clip.root_position[:, 2] + confidence * (simulated.root_position - clip.root_position)[:, 2]
    one, two, share = clip.local_rotations, simulated.local_rotations, confidence[:, None, None]
    two = np.where(np.sum(one * two, axis=-1, keepdims=True) < 0.0, -two, two)
    return replace(clip, root_position=root, local_rotations=normalise(one + share * (two - one)))
