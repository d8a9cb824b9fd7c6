"""Films of what the agent did: the clips that it followed best, worst, and in the middle."""

from typing import NamedTuple

import numpy as np
from rich.console import Console

from envs.mimic_spec import FPS, FRAMES_PER_STEP
from eval.examine import Track
from eval.performance import Performance
from eval.render import INSTALL_HINT, can_render, encode_mp4, poses, render_pair


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


def _film_clip(recorded: Track, clip: int, title: str, ratio: float) -> Video:
    """Return the film of the window that is most like the clip's mean."""
    windows = [one for one in recorded.performances if one.clip == clip]
    one = min(windows, key=lambda w: abs(_ratio(w) - ratio))
    reference = poses(recorded.clips[clip])[one.frame :: FRAMES_PER_STEP][: len(one.poses)]
    lost = one.survived if one.survived < len(one.poses) else None
    mp4 = encode_mp4(render_pair(reference, one.poses, FPS / FRAMES_PER_STEP, lost))
    seconds = one.survived * FRAMES_PER_STEP / FPS
    ending = "the agent lasts to the end" if lost is None else f"the episode ends after {seconds:.2f} s; from there the agent is red"
    name = recorded.clips[clip].name
    return Video(f"{title}: {name}", f"From {one.frame / FPS:.2f} s; {ending}. Mean episode_length_ratio {ratio:.3f}.", mp4)


def _ratio(performance: Performance) -> float:
    steps = len(performance.poses) - 1
    return min(performance.survived, steps) / steps
