"""Videos of the agent beside its reference: the best, the median and the worst clip."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console

from datasets.motion.clip import FPS
from datasets.motion.generalised_positions import motion_to_qpos
from envs.physics.engine_interface import FRAMES_PER_STEP
from eval.metrics.rollout_motion import RolloutMotion
from eval.pages.render import INSTALL_HINT, can_render, encode_mp4, render_pair, save_strip
from eval.report.evaluate import ClipResults
from eval.report.median_window import median_window


class Video(NamedTuple):
    """Video of a rollout beside its reference.

    Attributes:
        title: Title.
        caption: Description.
        mp4: H.264 video.
    """

    title: str
    caption: str
    mp4: bytes


def render_videos(recorded: ClipResults, console: Console) -> list[Video]:
    """Return videos of the best, the median and the worst clip by episode length ratio; none if rendering is not possible."""
    if not can_render():
        console.print(INSTALL_HINT)
        return []
    ratios = [one.policy["episode_length_ratio"].mean() for one in recorded.tracking]
    order = np.argsort(ratios)[::-1]
    chosen = {int(order[-1]): "worst", int(order[len(order) // 2]): "median", int(order[0]): "best"}  # the better title stays
    videos = []
    for clip, title in reversed(chosen.items()):
        with console.status(f"filming the {title} clip"):
            videos.append(_render_clip_video(recorded, clip, title, float(ratios[clip])))
    return videos


def save_best_strip(recorded: ClipResults, path: Path) -> None:
    """Write a strip of moments of the best clip, the agent before its reference's ghost; nothing if rendering is not possible."""
    if not can_render():
        return
    ratios = [float(one.policy["episode_length_ratio"].mean()) for one in recorded.tracking]
    best = int(np.argmax(ratios))
    one, reference = _median_rollout(recorded, best)
    shown = min(one.survived + 1, len(one.poses))
    save_strip(path, reference[:shown], one.poses[:shown])


def _median_rollout(recorded: ClipResults, clip: int) -> tuple[RolloutMotion, np.ndarray]:
    """Return the rollout of a clip's median window, and the reference's poses at its control steps."""
    one = median_window(recorded, clip)
    return one, motion_to_qpos(recorded.clips[clip])[one.frame :: FRAMES_PER_STEP][: len(one.poses)]


def _render_clip_video(recorded: ClipResults, clip: int, title: str, ratio: float) -> Video:
    """Return the video of a clip's median window."""
    one, reference = _median_rollout(recorded, clip)
    lost = np.arange(len(one.poses)) >= one.survived
    mp4 = encode_mp4(render_pair(reference, one.poses, FPS / FRAMES_PER_STEP, lost))
    seconds = one.survived * FRAMES_PER_STEP / FPS
    ending = "the agent lasts to the end" if not lost.any() else f"the episode ends after {seconds:.2f} s; from there the agent is red"
    name = recorded.clips[clip].name
    return Video(f"{title}: {name}", f"From {one.frame / FPS:.2f} s; {ending}. Mean episode_length_ratio {ratio:.3f}.", mp4)
