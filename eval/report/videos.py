"""Films of what the agent did: the clips that it followed best, worst, and in the middle."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console

from datasets.motion.clip import FPS
from envs.physics.protocol import FRAMES_PER_STEP
from eval.metrics.rollout_motion import Performance
from eval.pages.render import INSTALL_HINT, can_render, encode_mp4, poses, render_pair, save_picture
from eval.report.evaluate import Track
from eval.report.median_window import typical_window


class Video(NamedTuple):
    """One pair on film."""

    title: str
    caption: str
    mp4: bytes


def film(recorded: Track, console: Console) -> list[Video]:
    """Return films of the best, the median and the worst clip by how long the agent lasts; none where nothing renders."""
    if not can_render():
        console.print(INSTALL_HINT)
        return []
    ratios = [one.policy["episode_length_ratio"].mean() for one in recorded.tracking]
    order = np.argsort(ratios)[::-1]
    chosen = {int(order[-1]): "worst", int(order[len(order) // 2]): "median", int(order[0]): "best"}  # the better title stays
    videos = []
    for clip, title in reversed(chosen.items()):
        with console.status(f"filming the {title} clip"):
            videos.append(_film_clip(recorded, clip, title, float(ratios[clip])))
    return videos


def picture(recorded: Track, path: Path) -> None:
    """Write a strip of moments of the best clip, the agent before its reference's ghost; nothing where nothing renders."""
    if not can_render():
        return
    ratios = [float(one.policy["episode_length_ratio"].mean()) for one in recorded.tracking]
    best = int(np.argmax(ratios))
    one, reference = _typical(recorded, best)
    shown = min(one.survived + 1, len(one.poses))
    save_picture(path, reference[:shown], one.poses[:shown])


def _typical(recorded: Track, clip: int) -> tuple[Performance, np.ndarray]:
    """Return the performance of a clip's window that is most like the clip's mean, and the reference's poses beside it."""
    one = typical_window(recorded, clip)
    return one, poses(recorded.clips[clip])[one.frame :: FRAMES_PER_STEP][: len(one.poses)]


def _film_clip(recorded: Track, clip: int, title: str, ratio: float) -> Video:
    """Return the film of a clip's typical window."""
    one, reference = _typical(recorded, clip)
    lost = np.arange(len(one.poses)) >= one.survived
    mp4 = encode_mp4(render_pair(reference, one.poses, FPS / FRAMES_PER_STEP, lost))
    seconds = one.survived * FRAMES_PER_STEP / FPS
    ending = "the agent lasts to the end" if not lost.any() else f"the episode ends after {seconds:.2f} s; from there the agent is red"
    name = recorded.clips[clip].name
    return Video(f"{title}: {name}", f"From {one.frame / FPS:.2f} s; {ending}. Mean episode_length_ratio {ratio:.3f}.", mp4)
