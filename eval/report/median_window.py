"""Median window: the rollout that represents a clip, and the artefacts over time of the median clip."""

from typing import NamedTuple

import numpy as np

from datasets.motion.clip import FPS, BodyMotion
from envs.physics.engine_interface import FRAMES_PER_STEP
from eval.metrics.artefact_tracks import compute_artefact_tracks
from eval.metrics.rollout_motion import MIN_POSES, RolloutMotion, compared_motions
from eval.pages.artefact_plots import plot_artefacts
from eval.pages.figures import Figure
from eval.report.evaluate import ClipResults


class WindowPlots(NamedTuple):
    """Artefacts over time of one rollout.

    Attributes:
        caption: Description of the rollout.
        plots: Plots as (title, figure).
    """

    caption: str
    plots: list[tuple[str, Figure]]


def median_window(results: ClipResults, clip: int) -> RolloutMotion:
    """Return the rollout of a clip whose length ratio is nearest to the clip's mean."""
    ratio = float(results.tracking[clip].policy["episode_length_ratio"].mean())
    return min((one for one in results.rollouts if one.clip == clip), key=lambda one: abs(_ratio(one) - ratio))


def plot_median_window(results: ClipResults, truths: list[BodyMotion] | None) -> WindowPlots | None:
    """Return the artefacts over time of the clip with the median length ratio; None without clips or if the agent lost it at once.

    Args:
        results: Results on clips.
        truths: Clean clip behind each clip, None if none is known.
    """
    if not results.rollouts:
        return None
    ratios = [one.policy["episode_length_ratio"].mean() for one in results.tracking]
    clip = int(np.argsort(ratios)[len(ratios) // 2])
    one = median_window(results, clip)
    if one.survived < MIN_POSES:
        return None
    sides = compared_motions(one, results.clips[clip], truths[clip] if truths else None)
    begin, seconds = one.frame / FPS, (one.survived - 1) * FRAMES_PER_STEP / FPS
    caption = f"{results.clips[clip].name}, {seconds:.2f} s from {begin:.2f} s on: median by episode_length_ratio, {ratios[clip]:.3f}"
    return WindowPlots(
        caption, plot_artefacts({side: compute_artefact_tracks(motion, sides.get("truth")) for side, motion in sides.items()})
    )


def _ratio(rollout: RolloutMotion) -> float:
    """Return the length ratio of a rollout."""
    steps = len(rollout.poses) - 1
    return min(rollout.survived, steps) / steps
