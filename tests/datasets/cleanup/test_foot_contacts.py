"""Foot contacts: clean-up worked out by hand, figures that stand, slide, jump and lift a foot, and plants that are known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.cleanup.foot_contacts import debounce_labels, detect_foot_contacts, drop_missed_steps
from datasets.motion.clip import BodyMotion
from datasets.motion.frame_spans import true_spans
from datasets.motion.kinematics import resample
from datasets.performer.performer_clip import load_performer_clip
from datasets.retarget.retarget import retarget
from datasets.synthetic import clips as synthetic
from datasets.synthetic.footsteps import FeetTrack
from datasets.synthetic.movement_style import draw_movement_style
from tests.builders import posed

BOTH = np.ones((60, 2), dtype=bool)


def labels(text: str) -> np.ndarray:
    return np.array([letter == "#" for letter in text])


def moving(velocity: np.ndarray, fps: float = 60.0) -> BodyMotion:
    """Return a rigid standing figure that moves with ``velocity`` (T, 3) [m/s]."""
    still = posed({}, frames=len(velocity))
    return replace(still, root_position=still.root_position + np.cumsum(velocity, axis=0) / fps, fps=fps)


def test_short_contacts_go_before_short_gaps_are_filled() -> None:
    # Contacts of fewer than 3 frames go: the two in the middle of the first line; then gaps of fewer than 4 frames are filled: the
    # one of 3, but not that of 4, nor the one of 9 that the removed contact would have cut into 4 and 3.
    assert (debounce_labels(labels("####...####....###....##...###"), 3, 4) == labels("###########....###.........###")).all()


def test_what_a_clip_begins_or_ends_in_may_be_longer_than_it_shows() -> None:
    assert (debounce_labels(labels("#........#"), 3, 4) == labels("#........#")).all()
    assert (debounce_labels(labels("..#####..."), 3, 4) == labels("..#####...")).all()
    assert not debounce_labels(labels("..##......"), 3, 4).any()


def test_spans_of_labels() -> None:
    assert true_spans(labels("##..#")).tolist() == [[0, 2], [4, 5]]
    assert true_spans(labels("...")).shape == (0, 2)


def test_whoever_stands_stands_at_any_level() -> None:
    still = posed({}, frames=60)
    upstairs = replace(still, root_position=still.root_position + np.array([0.0, 0.0, 1.7]))
    assert detect_foot_contacts(still).all()
    assert detect_foot_contacts(upstairs).all()


@pytest.mark.parametrize(("speed", "stands"), [(0.35, True), (0.45, False)])
def test_a_foot_that_slides_fast_does_not_stand(speed: float, stands: bool) -> None:  # the threshold is 0.4 m/s
    sliding = moving(np.tile([speed, 0.0, 0.0], (60, 1)))
    assert (detect_foot_contacts(sliding) == stands).all()


def test_the_top_of_a_jump_is_no_contact() -> None:
    # Off at 2 m/s, free fall for 0.4 s: at the top the feet are slower than 0.4 m/s for 2 * 0.4 / 9.81 = 0.08 s, 8 frames of 100.
    flight = 2.0 - 9.81 * (np.arange(41) / 100.0)
    speed = np.concatenate([np.zeros(50), flight, np.zeros(50)])
    contacts = detect_foot_contacts(moving(np.stack([0.0 * speed, 0.0 * speed, speed], axis=1), fps=100.0))
    assert contacts[:45].all()
    assert not contacts[55:86].any()
    assert contacts[96:].all()


@pytest.mark.parametrize(("depth", "stands"), [(0.012, True), (0.06, False)])
def test_a_foot_that_sinks_a_little_at_both_ends_stands(depth: float, stands: bool) -> None:
    # Slow for half a second, ahead at 1 m/s before and after; lowered by the depth around the moments between: by millimetres, as a foot
    # that rolls, or by centimetres, as a foot around the top of a hop.
    speed = np.repeat([1.0, 0.0, 1.0], [60, 30, 60])
    height = np.interp(np.arange(150), [50, 58, 66, 84, 92, 100], [0.0, -depth, 0.0, 0.0, -depth, 0.0])
    contacts = detect_foot_contacts(moving(np.stack([speed, 0.0 * speed, np.gradient(height, 1.0 / 60.0)], axis=1)))
    assert (contacts[68:82] == stands).all()


def test_a_foot_held_up_does_not_stand() -> None:
    lifted = posed({"thigh_l_y": -60.0, "shin_l_y": 80.0})
    assert not detect_foot_contacts(lifted)[:, 0].any()
    assert detect_foot_contacts(lifted)[:, 1].all()


def test_durations_are_seconds_whatever_the_rate() -> None:
    # Thrown aside at 3 m/s for 0.12 s: velocities are averaged over up to 0.07 s (+- 0.04 s with the difference of neighbours),
    # so the feet are fast for about 0.2 s, no short gap. For 0.03 s: about 0.1 s, a gap that is filled.
    for fps in (60.0, 100.0, 240.0):
        for seconds, stands in ((0.12, False), (0.03, True)):
            speed = np.zeros(round(2.0 * fps))
            speed[round(fps) : round((1.0 + seconds) * fps)] = 3.0
            contacts = detect_foot_contacts(moving(np.stack([0.0 * speed, speed, 0.0 * speed], axis=1), fps))
            assert contacts.all() == stands


@pytest.fixture
def feet(monkeypatch: pytest.MonkeyPatch) -> list[FeetTrack]:
    """Return the list into which every synthetic clip that is made puts the exact track of its feet."""
    tracks: list[FeetTrack] = []
    perform = synthetic.solve_whole_body
    monkeypatch.setattr(synthetic, "solve_whole_body", lambda feet, carriage: (tracks.append(feet), perform(feet, carriage))[1])
    return tracks


def test_known_plants_are_found(feet: list[FeetTrack]) -> None:
    rng, t = np.random.default_rng(3), np.arange(480) / 60.0
    style = draw_movement_style("somebody", rng)
    clips = [
        synthetic.walk(t, 1.3, style, rng),
        synthetic.turn_on_the_spot(t, style, rng),
        synthetic.stairs(t, 0.17, style, rng),
        synthetic.stairs(t, -0.17, style, rng),
        synthetic.run(t, 2.4, style, rng),
    ]
    for clip, track in zip(clips, feet, strict=True):
        found = detect_foot_contacts(clip)
        for side in (0, 1):
            # Feet leave and meet the ground with no speed, so contacts are found to last a little longer than the plants.
            assert found[:, side][track.planted[:, side]].mean() > 0.97
            assert len(true_spans(found[:, side])) == len(true_spans(track.planted[:, side]))
            assert (found & ~track.planted)[:, side].sum() <= 10 * len(true_spans(~track.planted[:, side]))  # 5 frames at either end


def test_another_rate_finds_the_same_plants(feet: list[FeetTrack]) -> None:
    rng = np.random.default_rng(4)
    clip = synthetic.walk(np.arange(480) / 60.0, 1.2, draw_movement_style("somebody", rng), rng)
    coarse, fine = detect_foot_contacts(resample(clip, 30.0)), detect_foot_contacts(resample(clip, 120.0))
    assert (fine[::4][: len(coarse)] == coarse[: len(fine[::4])]).mean() > 0.95


@pytest.mark.shared_data
def test_a_real_walker_nearly_always_stands_on_a_foot(shared_data: Path) -> None:
    walk = retarget(load_performer_clip(shared_data / "cmu" / "train" / "cmu_12_01.bvh")).motion
    contacts = detect_foot_contacts(walk)
    assert contacts.any(axis=1).mean() > 0.95
    assert 0.05 < contacts.all(axis=1).mean() < 0.45  # people who walk have both feet on the ground for about a quarter of the time


def stepping(degrees: float, frames: int = 60) -> BodyMotion:
    """Return a figure whose straight right leg swings ahead by an angle, evenly within 0.2 s from frame 24 to 36, and stays there."""
    turns = degrees * np.clip((np.arange(frames) - 24) / 12, 0.0, 1.0)
    return replace(posed({}, frames), local_rotations=np.concat([posed({"thigh_r_y": -turn}, 1).local_rotations for turn in turns]))


def test_a_foot_that_steps_while_both_are_said_to_stand_does_not_stand() -> None:
    # A leg of 0.83 m and a foot that swing by 20 degrees within 0.2 s: their sole goes ahead by 30 cm at 1.5 m/s, a mean over five frames.
    found = drop_missed_steps(stepping(20.0), BOTH)
    assert found[:, 0].all()
    assert not found[25:35, 1].any()
    assert found[:22, 1].all()
    assert found[39:, 1].all()


def test_which_foot_steps_is_told_by_the_root() -> None:
    # The root goes back by as much as the right foot ahead: it is the left one that moves.
    steps = stepping(20.0)
    ahead = 0.83 * np.sin(np.radians(20.0 * np.clip((np.arange(60) - 24) / 12, 0.0, 1.0)))
    found = drop_missed_steps(replace(steps, root_position=steps.root_position - ahead[:, None] * np.array([1.0, 0.0, 0.0])), BOTH)
    assert found[:, 1].all()
    assert not found[26:34, 0].any()


def test_feet_that_shift_by_centimetres_or_go_with_the_root_keep_standing() -> None:
    assert drop_missed_steps(stepping(4.0), BOTH).all()  # 6 cm
    slides = moving(np.tile([2.0, 0.0, 0.0], (60, 1)))
    assert drop_missed_steps(slides, BOTH).all()


def test_a_step_that_nobody_calls_a_contact_is_none_afterwards() -> None:
    contacts = BOTH.copy()
    contacts[20:40, 1] = False
    assert np.array_equal(drop_missed_steps(stepping(20.0), contacts), contacts)
