"""Walks against gravity: their tempo, what changes it, and what shows none."""

from dataclasses import replace

import pytest

from datasets.motion.clip import BodyMotion
from datasets.performer.performer_clip import performer_clip_from_bvh
from datasets.performer.reading_options import ReadingOptions
from datasets.retarget.gait_tempo import measure_gait_tempo
from datasets.retarget.plausibility import find_implausible
from datasets.retarget.retarget import retarget
from datasets.synthetic.clips import synthetic_clips
from tests.builders import as_bvh, lively, posed


@pytest.fixture(scope="module")
def clips() -> dict[str, BodyMotion]:
    """Return clips of a synthetic performer, who walks as an inverted pendulum does, by the word after the numbers of their names."""
    return {
        clip.name.split("_", 3)[3]: clip for clip in synthetic_clips(seed=0, performer_count=2) if clip.name.startswith("synthetic_0_1")
    }


def told(clip: BodyMotion, fps: float, said: float | None = None) -> tuple[str, ...]:
    bvh = as_bvh(replace(clip, fps=fps))
    return find_implausible(retarget(performer_clip_from_bvh(bvh, "clip", ReadingOptions(fps=said))))


def test_a_walk_falls_as_quickly_as_gravity_wants(clips: dict[str, BodyMotion]) -> None:
    """The least acceleration is that of a load on the foot's edge: the centre of pressure is farther back, the recorded one larger."""
    tempo = measure_gait_tempo(clips["walk_1.08"])
    assert tempo is not None
    assert 1.0 < tempo.ratio < 3.0
    assert tempo.correlation > 0.9


def test_accelerations_grow_with_the_square_of_the_rate(clips: dict[str, BodyMotion]) -> None:
    full, half = (measure_gait_tempo(replace(clips["walk_0.70"], fps=fps)) for fps in (60.0, 30.0))
    assert full is not None
    assert half is not None
    assert full.ratio / half.ratio == pytest.approx(4.0, rel=0.15)  # smoothing takes a little of the quicker one
    assert half.stance_s / full.stance_s == pytest.approx(2.0)


def test_who_does_not_walk_has_no_tempo(clips: dict[str, BodyMotion]) -> None:
    for clip in (clips["stand"], clips["squat"], clips["stairs_up"], posed({}), lively()):
        assert measure_gait_tempo(clip) is None


def test_a_walk_at_a_fifth_of_its_rate_is_told(clips: dict[str, BodyMotion]) -> None:
    (line,) = told(clips["walk_1.08"], 12.0)
    assert line.startswith("At 12 fps somebody walks about ")
    assert line.endswith("60 fps are likely: --fps 60.")
    assert told(clips["walk_1.08"], 12.0, said=60.0) == ()
    assert told(clips["walk_1.08"], 60.0) == ()
