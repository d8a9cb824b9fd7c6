"""Stages of cleaning on the 20 bodies: kinematic repair (low-pass, level ground, self-penetration), and simulation of grounded spans."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np

from datasets.cleanup.foot_contacts import detect_foot_contacts
from datasets.cleanup.ground_levelling import level_to_ground
from datasets.cleanup.off_feet_spans import OffFeetSpan
from datasets.cleanup.plant_feet import plant_feet
from datasets.motion.clip import BodyMotion
from datasets.motion.frame_spans import true_spans
from datasets.motion.smoothing import smooth_motion
from envs.physics.overlap_memory import OverlapMemory
from envs.physics.self_collision import remove_self_penetration
from eval.clean.planted_edits import plant_edited_feet
from eval.clean.quality import Simulator
from eval.clean.result import SIMULATED_CONFIDENCE
from eval.clean.simulate_clip import SimulatedClip, simulate_clip, without_simulation

MIN_SIMULATED_FRAMES = 60  # of a span that is worth simulating
# Simulates a part of a clip, from the simulator, its first frame, the part, whether frames without simulation come before and after, and
# whom to tell of frames that were simulated; None leaves the part as it is.
PartSimulation = Callable[[Simulator, int, BodyMotion, tuple[bool, bool], Callable[[int], None]], SimulatedClip | None]


def repair_kinematically(
    clip: BodyMotion,
    off_feet: list[OffFeetSpan],
    contacts: np.ndarray | None = None,
    said: np.ndarray | None = None,
    memory: OverlapMemory | None = None,
) -> BodyMotion:
    """Return the clip low-passed, on level ground and without self-penetration: the repairs that need no physics.

    Args:
        clip: Clip with a root, at 60 fps.
        off_feet: Spans off level ground, whose heights are carried along as they are.
        contacts: Whether the left and the right foot stand, of a clip whose feet are to be planted, shape (T, 2).
        said: What a person said of both feet, from ``said_contacts``, shape (T, 2); None if nothing.
        memory: Overlaps that were found in other versions of the clip.
    """
    smooth, grounded = smooth_motion(clip), ~frame_mask(off_feet, len(clip))
    if said is not None:
        placed = plant_edited_feet(smooth, grounded, contacts, said)
    else:
        placed = level_to_ground(smooth, grounded=grounded) if contacts is None else plant_feet(smooth, contacts, grounded)
    return remove_self_penetration(placed, memory)


def simulate_grounded_spans(
    simulator: Simulator | None,
    clip: BodyMotion,
    off_feet: list[OffFeetSpan],
    contacts: np.ndarray | None = None,
    progress: Callable[[float], None] = lambda _: None,
    simulate_part: PartSimulation | None = None,
    memory: OverlapMemory | None = None,
) -> SimulatedClip:
    """Return the clip simulated wherever it is on level ground.

    Contacts are those given: these feet keep still in the clip that is simulated. Without any they are the simulation's loads where it is
    trusted, and elsewhere detected by speed and height.

    Args:
        simulator: Policy and settings of the search; None leaves physics out.
        clip: Repaired clip at 60 fps.
        off_feet: Spans off level ground.
        contacts: Whether the left and the right foot stand, shape (T, 2); None where nothing knows it.
        progress: Called with the share of the frames that were simulated, again and again.
        simulate_part: Simulates each part in another way than ``simulate_clip``, or leaves it as it is.
        memory: Overlaps that were found in other versions of the clip.
    """
    num_done, simulate_part = 0, simulate_part or _simulate_whole

    def after_frames(number: int) -> None:
        nonlocal num_done
        num_done += number
        progress(num_done / len(clip))

    excluded = frame_mask(off_feet, len(clip))

    def simulated_parts(simulator: Simulator) -> Iterator[tuple[int, SimulatedClip]]:
        for start, stop in true_spans(~excluded).tolist():
            if stop - start >= MIN_SIMULATED_FRAMES:
                simulated = simulate_part(simulator, start, clip.cut(start, stop), (start > 0, stop < len(clip)), after_frames)
                if simulated:
                    yield start, simulated

    simulated = _splice(clip, simulated_parts(simulator)) if simulator else without_simulation(clip)
    if contacts is None:
        trusted = simulated.confidence >= SIMULATED_CONFIDENCE
        contacts = np.where(trusted[:, None], simulated.contacts, detect_foot_contacts(simulated.motion) & ~excluded[:, None])
    else:
        contacts = contacts & ~excluded[:, None]
    return simulated._replace(motion=remove_self_penetration(simulated.motion, memory), contacts=contacts)


def _simulate_whole(
    simulator: Simulator, _: int, part: BodyMotion, fade_ends: tuple[bool, bool], after_frames: Callable[[int], None]
) -> SimulatedClip:
    return simulate_clip(simulator, part, fade_ends, after_frames)


def frame_mask(spans: list[OffFeetSpan], frames: int) -> np.ndarray:
    """Return which frames lie in a span, shape (frames,)."""
    return np.isin(np.arange(frames), np.concat([np.arange(0), *(np.arange(span.start, span.stop) for span in spans)]))


def _splice(clip: BodyMotion, parts: Iterable[tuple[int, SimulatedClip]]) -> SimulatedClip:
    """Return a clip with simulated parts in its frames; frames after a part are moved along by where that ends.

    Args:
        clip: Clip of T frames.
        parts: First frame and simulation of each part, in order.
    """
    whole = without_simulation(clip)
    root, local, level = clip.root_position.copy(), clip.local_rotations.copy(), np.array([1.0, 1.0, 0.0])
    for start, part in parts:
        stop = start + len(part.motion)
        path = part.motion.root_position + level * (root[start] - part.motion.root_position[0])
        root[stop:] += level * (path[-1] - root[stop - 1])
        root[start:stop], local[start:stop] = path, part.motion.local_rotations
        whole.contacts[start:stop], whole.confidence[start:stop], whole.assist[start:stop] = part.contacts, part.confidence, part.assist
        whole.segment_starts.extend(start + frame for frame in part.segment_starts)
    return whole._replace(motion=replace(clip, root_position=root, local_rotations=local)) if whole.segment_starts else whole
