"""Stages of cleaning on the 20 bodies: kinematic repair (low-pass, level ground, self-penetration), and simulation of grounded spans."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from datasets.cleanup.foot_contacts import detect_foot_contacts, true_spans
from datasets.cleanup.ground_levelling import level_to_ground
from datasets.cleanup.off_feet_spans import OffFeetSpan
from datasets.cleanup.plant_feet import plant_feet
from datasets.motion.clip import BodyMotion
from datasets.motion.smoothing import smooth_motion
from envs.physics.self_collision import remove_self_penetration
from eval.clean.result import SIMULATED_CONFIDENCE
from eval.clean.samcon import Simulator
from eval.clean.simulate_clip import SimulatedClip, simulate_clip, without_simulation

MIN_SIMULATED_FRAMES = 60  # of a span that is worth simulating


def repair_kinematically(clip: BodyMotion, off_feet: list[OffFeetSpan], contacts: np.ndarray | None = None) -> BodyMotion:
    """Return the clip low-passed, on level ground and without self-penetration: the repairs that need no physics.

    Args:
        clip: Clip with a root, at 60 fps.
        off_feet: Spans off level ground, whose heights are carried along as they are.
        contacts: Whether the left and the right foot stand, of a clip whose feet are to be planted, shape (T, 2).
    """
    smooth, grounded = smooth_motion(clip), ~frame_mask(off_feet, len(clip))
    placed = level_to_ground(smooth, grounded=grounded) if contacts is None else plant_feet(smooth, contacts, grounded)
    return remove_self_penetration(placed)


def simulate_grounded_spans(
    simulator: Simulator | None,
    clip: BodyMotion,
    off_feet: list[OffFeetSpan],
    contacts: np.ndarray | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> SimulatedClip:
    """Return the clip simulated wherever it is on level ground.

    Contacts are the simulation's loads where it is trusted, and elsewhere those given.

    Args:
        simulator: Policy and settings of the search; None leaves physics out.
        clip: Repaired clip at 60 fps.
        off_feet: Spans off level ground.
        contacts: Whether the left and the right foot stand, shape (T, 2); detected by speed and height if None.
        progress: Called with the share of the frames that were simulated, again and again.
    """
    num_done = 0

    def after_frames(number: int) -> None:
        nonlocal num_done
        num_done += number
        progress(num_done / len(clip))

    excluded = frame_mask(off_feet, len(clip))
    simulated = without_simulation(clip)
    for start, stop in true_spans(~excluded):
        if simulator is not None and stop - start >= MIN_SIMULATED_FRAMES:
            part = simulate_clip(simulator, clip.cut(start, stop), (start > 0, stop < len(clip)), after_frames)
            simulated = _splice(simulated, part, start, stop)
    kinematic = (detect_foot_contacts(simulated.motion) if contacts is None else contacts) & ~excluded[:, None]
    found = np.where((simulated.confidence >= SIMULATED_CONFIDENCE)[:, None], simulated.contacts, kinematic)
    return simulated._replace(motion=remove_self_penetration(simulated.motion), contacts=found)


def frame_mask(spans: list[OffFeetSpan], frames: int) -> np.ndarray:
    """Return which frames lie in a span, shape (frames,)."""
    return np.isin(np.arange(frames), np.concat([np.arange(0), *(np.arange(span.start, span.stop) for span in spans)]))


def _splice(whole: SimulatedClip, part: SimulatedClip, start: int, stop: int) -> SimulatedClip:
    """Return a clip with the frames from ``start`` to ``stop`` as simulated; later frames are moved along by where those end."""
    motion, contacts, confidence, assist = whole.motion, whole.contacts.copy(), whole.confidence.copy(), whole.assist.copy()
    root, local = motion.root_position.copy(), motion.local_rotations.copy()
    level = np.array([1.0, 1.0, 0.0])
    path = part.motion.root_position + level * (root[start] - part.motion.root_position[0])
    root[stop:] += level * (path[-1] - root[stop - 1])
    root[start:stop], local[start:stop] = path, part.motion.local_rotations
    contacts[start:stop], confidence[start:stop], assist[start:stop] = part.contacts, part.confidence, part.assist
    segment_starts = [*whole.segment_starts, *(start + frame for frame in part.segment_starts)]
    return SimulatedClip(replace(motion, root_position=root, local_rotations=local), contacts, confidence, segment_starts, assist)
