"""The window of a clip that stands for all of them, and its artefacts over time."""

from typing import NamedTuple

import numpy as np

from datasets.motion.clip import FPS, BodyMotion
from envs.physics.protocol import FRAMES_PER_STEP
from eval.metrics.artefact_tracks import track_artefacts
from eval.metrics.rollout_motion import SHORTEST_POSES, Performance, sides_of
from eval.pages.artefact_plots import over_time
from eval.pages.figures import Figure
from eval.report.evaluate import Track


class Course(NamedTuple):
    """Artefacts over time of one performance."""

    caption: str
    plots: list[tuple[str, Figure]]  # title, figure


def typical_window(track: Track, clip: int) -> Performance:
    """Return the performance of a clip's window whose length ratio is most like the clip's mean."""
    ratio = float(track.tracking[clip].policy["episode_length_ratio"].mean())
    return min((one for one in track.performances if one.clip == clip), key=lambda one: abs(_ratio(one) - ratio))


def typical_course(track: Track, truths: list[BodyMotion] | None) -> Course | None:
    """Return the artefacts over time of the clip with the median length ratio; None without clips or if the agent lost it at once.

    Args:
        track: What was found on clips.
        truths: For each clip the clean one behind it, None where none is known.
    """
    if not track.performances:
        return None
    ratios = [one.policy["episode_length_ratio"].mean() for one in track.tracking]
    clip = int(np.argsort(ratios)[len(ratios) // 2])
    one = typical_window(track, clip)
    if one.survived < SHORTEST_POSES:
        return None
    sides = sides_of(one, track.clips[clip], truths[clip] if truths else None)
    begin, seconds = one.frame / FPS, (one.survived - 1) * FRAMES_PER_STEP / FPS
    caption = f"{track.clips[clip].name}, {seconds:.2f} s from {begin:.2f} s on: median by episode_length_ratio, {ratios[clip]:.3f}"
    return Course(caption, over_time({side: track_artefacts(motion, sides.get("truth")) for side, motion in sides.items()}))


def _ratio(performance: Performance) -> float:
    steps = len(performance.poses) - 1
    return min(performance.survived, steps) / steps
