"""Which parts of an edited clip are simulated, which are remembered, and which are stale; searches are stand-ins."""

from collections.abc import Callable

import numpy as np
import pytest

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import HINGE_COUNT
from envs.physics.segment import Segment
from eval.clean import edited_simulation as module
from eval.clean.edited_simulation import EditedSimulation, SearchMemory
from eval.clean.quality import QUALITIES, SearchSettings, Simulator
from tests.builders import posed
from tests.eval.clean.clean_parts import simulator

FRAMES = 240
NONE = np.zeros(FRAMES, dtype=bool)


def frames(start: int, stop: int) -> np.ndarray:
    labels = NONE.copy()
    labels[start:stop] = True
    return labels


@pytest.fixture
def searched(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int]]:
    """Let searches perform exactly their clip, in one segment; return what was asked for: samples and frames."""
    asked = []

    def stand_in(by: Simulator, clip: BodyMotion, after_frames: Callable[[int], None]) -> list[Segment]:
        assert isinstance(by.search, SearchSettings)
        asked.append((by.search.num_samples, len(clip)))
        after_frames(len(clip))
        poses = np.concat([clip.root_position, clip.local_rotations[:, 0], np.zeros((len(clip), HINGE_COUNT))], axis=1)
        still = np.zeros((len(clip), 6 + HINGE_COUNT)), np.zeros((len(clip), HINGE_COUNT))
        return [Segment(0, poses, *still, np.full(len(clip), 0.001 * by.search.num_samples))]

    monkeypatch.setattr(module, "search_segments", stand_in)
    return asked


def solve(parts: EditedSimulation, start: int = 0, stop: int = FRAMES) -> np.ndarray | None:
    """Return the confidence of a part of a T-pose that keeps still, None where it is not simulated."""
    found = parts(simulator(), start, posed({}, FRAMES).cut(start, stop), (start > 0, stop < FRAMES), lambda _: None)
    return None if found is None else found.confidence


def test_what_was_simulated_once_is_not_simulated_again(searched: list[tuple[int, int]]) -> None:
    memory = SearchMemory(1000)
    one, two = (solve(EditedSimulation(memory, NONE, {}, True)) for _ in range(2))
    assert searched == [(8, FRAMES)]
    assert one is not None
    assert two is not None
    assert one == pytest.approx(two)
    assert one == pytest.approx(np.ones(FRAMES))


def test_what_is_not_to_be_simulated_now_is_stale(searched: list[tuple[int, int]]) -> None:
    memory = SearchMemory(1000)
    later = EditedSimulation(memory, NONE, {}, False)
    assert solve(later, 0, 120) is None
    assert np.flatnonzero(later.stale).tolist() == list(range(120))
    solve(EditedSimulation(memory, NONE, {}, True), 0, 120)
    again = EditedSimulation(memory, NONE, {}, False)
    assert solve(again, 0, 120) is not None
    assert not again.stale.any()
    assert searched == [(8, 120)]


def test_the_oldest_searches_are_forgotten(searched: list[tuple[int, int]]) -> None:
    memory = SearchMemory(250)  # of 240 and 120 frames only one has room
    for start, stop in ((0, 240), (0, 120), (0, 120), (0, 240)):
        solve(EditedSimulation(memory, NONE, {}, True), start, stop)
    assert [length for _, length in searched] == [240, 120, 240]


def test_physics_that_a_span_leaves_out_fades_beside_it(searched: list[tuple[int, int]]) -> None:
    # 0.15 s are 9 frames, so that the tenth before the span is whole; the middle of the ten steps is a half.
    confidence = solve(EditedSimulation(SearchMemory(1000), frames(100, 130), {}, True))
    assert confidence is not None
    assert not confidence[100:130].any()
    assert confidence[[95, 134]] == pytest.approx(0.5)
    assert confidence[[80, 90, 140, 200]] == pytest.approx(1.0)
    assert searched == [(8, FRAMES)]


def test_a_part_without_physics_is_not_simulated(searched: list[tuple[int, int]]) -> None:
    parts = EditedSimulation(SearchMemory(1000), frames(60, 180), {}, True)
    assert solve(parts, 60, 180) is None
    assert not parts.stale.any()
    assert searched == []


def test_a_span_of_another_quality_is_simulated_apart(searched: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(QUALITIES, "best", SearchSettings(num_samples=20, num_survivors=5))
    parts = EditedSimulation(SearchMemory(2000), NONE, {"best": frames(100, 160)}, True)
    found = parts(simulator(), 0, posed({}, FRAMES), (False, False), lambda _: None)
    assert searched == [(8, FRAMES), (20, 60)]
    assert found is not None
    assert found.segment_starts == [0, 100, 160]
    assert found.assist[[50, 130, 200]] == pytest.approx([0.008, 0.02, 0.008])
    assert found.confidence[[100, 160]] == pytest.approx(0.0)  # as at every restart
    assert found.confidence[[50, 130, 200]] == pytest.approx(1.0)
    # The whole of a part in that quality needs no other search.
    searched.clear()
    solve(EditedSimulation(SearchMemory(2000), NONE, {"best": frames(0, FRAMES)}, True))
    assert searched == [(20, FRAMES)]


def test_a_span_whose_quality_was_not_simulated_yet_is_stale_alone(searched: list[tuple[int, int]]) -> None:
    memory = SearchMemory(2000)
    solve(EditedSimulation(memory, NONE, {}, True))
    later = EditedSimulation(memory, NONE, {"best": frames(100, 160)}, False)
    confidence = solve(later)
    assert np.array_equal(later.stale, frames(100, 160))
    assert confidence is not None
    assert not confidence[100:160].any()
    assert confidence[[50, 200]] == pytest.approx(1.0)
    assert searched == [(8, FRAMES)]
