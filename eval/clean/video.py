"""Pictures of a cleaning: a film of the faulty clip beside the clean one, and the frames that were changed most."""

from dataclasses import dataclass

import mediapy
import numpy as np

from datasets.motion.generalised_positions import motion_to_qpos
from eval.clean.result import CleaningResult
from eval.metrics.artefact_tracks import distances_local
from eval.pages.render import can_render, encode_mp4, pair_frames, render_strip

MAX_VIDEO_S = 10.0  # of a film: of longer clips the part in which most was changed; drawing takes longer than cleaning
_MOMENT_SIZE_PX = (360, 440)  # pixels, of the picture of a moment


@dataclass(frozen=True)
class Pictures:
    """A film of the clip before and after, and pictures of single frames.

    Attributes:
        mp4: The film, the input on the left and the output on the right.
        begin: Start of the film in the file [s].
        end: End of the film in the clip [s].
        moments: Pictures of single frames as PNG, the output with the input as a ghost behind it.
    """

    mp4: bytes
    begin: float
    end: float
    moments: list[bytes]


def render_cleaning(cleaned: CleaningResult, frames: list[int]) -> Pictures | None:
    """Return film and pictures, None where nothing renders.

    Args:
        cleaned: The clip.
        frames: Indices of the frames to picture.
    """
    if not can_render():
        return None
    before, after = motion_to_qpos(cleaned.before), motion_to_qpos(cleaned.after)
    fps = cleaned.before.fps
    part = _most_changed_part(distances_local(cleaned.after, cleaned.before).mean(axis=1), round(MAX_VIDEO_S * fps))
    mp4 = encode_mp4(pair_frames(before[part], after[part], fps, cleaned.kept[part]))
    moments = [mediapy.compress_image(_render_moment(before[frame], after[frame])) for frame in frames]
    return Pictures(mp4, cleaned.start_s + part.start / fps, cleaned.start_s + part.stop / fps, moments)


def _most_changed_part(changes: np.ndarray, length: int) -> slice:
    """Return which frames of so many hold the greatest sum of ``changes`` (T,)."""
    if len(changes) <= length:
        return slice(0, len(changes))
    sums = np.concat([[0.0], np.cumsum(changes)])
    begin = int((sums[length:] - sums[:-length]).argmax())
    return slice(begin, begin + length)


def _render_moment(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return a picture of two poses (50,) in one place: what a clip has drifted over the ground does not show, its height does."""
    here = after.copy()
    here[:2] = before[:2]
    return render_strip(before[None], here[None], moments=1, size=_MOMENT_SIZE_PX)
