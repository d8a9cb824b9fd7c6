"""The stages of cleaning, on the 20 bodies: a root, steadiness, level ground, limbs apart, physics."""

from dataclasses import replace

import numpy as np

from agents.policy.policy import Policy
from agents.root.reconstruct import reconstruct_root
from agents.weights.pretrained import load_pretrained_root
from datasets.cleanup.foot_contacts import detect_foot_contacts
from datasets.cleanup.ground_levelling import level_to_ground
from datasets.cleanup.off_feet_segments import OffFeetSpan
from datasets.imu.root_features import ROOT_RATE_HZ
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import place_on_ground
from datasets.motion.smoothing import smooth_motion
from envs.mimic.spec import MimicSpec
from envs.physics.self_collision import remove_self_penetration
from eval.clean.simulate_clip import SimulatedClip, simulate_clip, without_simulation

MIN_SIMULATED_FRAMES = 60  # frames, of what is worth performing


def reconstruct_missing_root(clip: BodyMotion) -> BodyMotion:
    """Return a clip whose recording did not say where the pelvis went with the root that a model gives it; itself if it is too short."""
    model = load_pretrained_root("root3d_pose")
    too_short = (len(clip) - 1) / clip.fps < (model.spec.window - 1) / ROOT_RATE_HZ
    # Its heights drift: who believes them sees stairs.
    return clip if too_short else replace(place_on_ground(reconstruct_root(model, clip)), rooted=False)


def repair_kinematically(clip: BodyMotion, off_feet: list[OffFeetSpan]) -> BodyMotion:
    """Return the clip without jitter, on level ground and with limbs that do not pass through the body: what needs no physics.

    Args:
        clip: At 60 fps.
        off_feet: Where it is not on level ground: heights there go on as they are.
    """
    smooth = smooth_motion(clip)
    frames = np.arange(len(clip))
    ground = frames[~frame_mask(off_feet, len(clip))]
    if len(ground):
        lower = (level_to_ground(smooth).root_position - smooth.root_position)[:, 2]
        offset = np.interp(frames, ground, lower[ground])
        smooth = replace(smooth, root_position=smooth.root_position + offset[:, None] * (0.0, 0.0, 1.0))
    return remove_self_penetration(smooth)


def simulate_grounded_spans(
    policy: Policy | None, spec: MimicSpec, clip: BodyMotion, off_feet: list[OffFeetSpan], threads: int
) -> SimulatedClip:
    """Return what physics makes of a repaired clip wherever that is on level ground.

    Where physics is not trusted feet stand by their looks.

    Args:
        policy: Trained for ``spec``; none to leave physics out.
        spec: Variant of the task.
        clip: At 60 fps, repaired.
        off_feet: Where it is not on level ground.
        threads: Native threads.
    """
    edges = np.flatnonzero(np.diff(np.concat([[True], frame_mask(off_feet, len(clip)), [True]]).astype(int)))
    simulated = without_simulation(clip)
    for start, stop in edges.reshape(-1, 2):
        if policy is not None and stop - start >= MIN_SIMULATED_FRAMES:
            part = simulate_clip(policy, spec, clip.cut(start, stop), threads, (start > 0, stop < len(clip)))
            simulated = _splice(simulated, part, start, stop)
    kinematic_contacts = detect_foot_contacts(simulated.motion) & ~frame_mask(off_feet, len(clip))[:, None]
    contacts = np.where((simulated.confidence >= 0.5)[:, None], simulated.contacts, kinematic_contacts)
    return simulated._replace(motion=remove_self_penetration(simulated.motion), contacts=contacts)


def frame_mask(spans: list[OffFeetSpan], frames: int) -> np.ndarray:
    """Return which of so many frames lie in a span, shape (frames,)."""
    return np.isin(np.arange(frames), np.concat([np.arange(0), *(np.arange(span.start, span.stop) for span in spans)]))


def _splice(whole: SimulatedClip, part: SimulatedClip, start: int, stop: int) -> SimulatedClip:
    """Return a clip with the frames from ``start`` to ``stop`` as they were performed, and all after them carried along."""
    motion, contacts, confidence = whole.motion, whole.contacts.copy(), whole.confidence.copy()
    root, local = motion.root_position.copy(), motion.local_rotations.copy()
    level = np.array([1.0, 1.0, 0.0])
    path = part.motion.root_position + level * (root[start] - part.motion.root_position[0])
    root[stop:] += level * (path[-1] - root[stop - 1])
    root[start:stop], local[start:stop] = path, part.motion.local_rotations
    contacts[start:stop], confidence[start:stop] = part.contacts, part.confidence
    segment_starts = [*whole.segment_starts, *(start + frame for frame in part.segment_starts)]
    return SimulatedClip(replace(motion, root_position=root, local_rotations=local), contacts, confidence, segment_starts)
