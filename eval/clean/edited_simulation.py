"""Simulation of a clip's parts as its edits ask, with a memory of searches: what was simulated once is not simulated again."""

from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import replace
from hashlib import blake2b

import numpy as np

from datasets.motion.clip import BodyMotion
from datasets.motion.frame_spans import true_spans
from envs.physics.segment import Segment
from eval.clean.apply_edits import share_beside
from eval.clean.quality import QUALITIES, SimulationSettings, Simulator
from eval.clean.simulate_clip import RESTART_FADE_S, SimulatedClip, blend_segments, cut_segments, search_segments


class SearchMemory:
    """Searches of one session, by the clip and the settings that they were of; the oldest are forgotten."""

    def __init__(self, frames: int) -> None:
        """Begin with none.

        Args:
            frames: Frames of simulation that are remembered at most.
        """
        self._frames = frames
        self._searches: OrderedDict[bytes, list[Segment]] = OrderedDict()

    def find(self, simulator: Simulator, clip: BodyMotion) -> list[Segment] | None:
        """Return the search of a clip, None if it was not made or is forgotten."""
        key = _key(simulator.search, clip)
        if key in self._searches:
            self._searches.move_to_end(key)
        return self._searches.get(key)

    def keep(self, simulator: Simulator, clip: BodyMotion, segments: list[Segment]) -> None:
        """Remember a search."""
        self._searches[_key(simulator.search, clip)] = segments
        while len(self._searches) > 1 and sum(len(one.poses) for search in self._searches.values() for one in search) > self._frames:
            self._searches.popitem(last=False)


def _key(settings: SimulationSettings, clip: BodyMotion) -> bytes:
    digest = blake2b(repr((settings, clip.fps)).encode())
    for track in (clip.root_position, clip.local_rotations):
        digest.update(np.ascontiguousarray(track).tobytes())
    return digest.digest()


class EditedSimulation:
    """Simulates parts of one clip as its edits ask; given to ``simulate_grounded_spans``.

    Attributes:
        stale: Frames that would be simulated, but were not, shape (T,).
    """

    def __init__(self, memory: SearchMemory, without: np.ndarray, qualities: Mapping[str, np.ndarray], anew: bool) -> None:
        """Take the edits.

        Args:
            memory: Searches that were made.
            without: Frames without physics, shape (T,).
            qualities: Frames that are simulated by another quality than the others, shape (T,), by its name.
            anew: Whether what is not in memory is simulated.
        """
        self._memory, self._without, self._qualities, self._anew = memory, without, qualities, anew
        self.stale = np.zeros(len(without), dtype=bool)

    def __call__(
        self, simulator: Simulator, start: int, part: BodyMotion, fade_ends: tuple[bool, bool], after_frames: Callable[[int], None]
    ) -> SimulatedClip | None:
        """Return the simulation of a part of the clip that begins at a frame; None where nothing of it is simulated."""
        frames = slice(start, start + len(part))
        segments, missing = self._segments(simulator, frames, part, after_frames)
        self.stale[frames] = missing
        left = missing | self._without[frames]
        if not segments or left.all():
            return None
        limit = 1.0 - share_beside(left, RESTART_FADE_S * part.fps) if left.any() else None
        return blend_segments(part, segments, simulator.search.assist_force_bw, fade_ends, limit)

    def _segments(
        self, simulator: Simulator, frames: slice, part: BodyMotion, after_frames: Callable[[int], None]
    ) -> tuple[list[Segment], np.ndarray]:
        """Return the segments of a part, and which of its frames lack a simulation that they should have, shape (n,)."""
        missing = np.zeros(len(part), dtype=bool)
        wanted = ~self._without[frames]
        spans = {quality: labels[frames] & wanted for quality, labels in self._qualities.items()}
        main = wanted & ~np.any([*spans.values(), np.zeros_like(wanted)], axis=0)
        found = self._search(simulator, part, after_frames) if main.any() else []
        segments = found or []
        if found is None:
            missing |= main
        for quality, labels in spans.items():
            other = replace(simulator, search=replace(QUALITIES[quality], assist_force_bw=simulator.search.assist_force_bw))
            for begin, end in true_spans(labels).tolist():
                found = self._search(other, part.cut(begin, end), after_frames)
                if found is None:
                    missing[begin:end] = True
                else:
                    own = [one._replace(start=one.start + begin) for one in cut_segments(found, 0, end - begin)]
                    segments = [*cut_segments(segments, 0, begin), *own, *cut_segments(segments, end, len(part) + 1)]
        return segments, missing

    def _search(self, simulator: Simulator, clip: BodyMotion, after_frames: Callable[[int], None]) -> list[Segment] | None:
        """Return the search of a clip from memory, or made now; None if it is not to be made."""
        segments = self._memory.find(simulator, clip)
        if segments is None and self._anew:
            segments = search_segments(simulator, clip, after_frames)
            self._memory.keep(simulator, clip, segments)
        return segments
