"""Playback: time that runs, stops, loops and is stepped."""

import pytest

from eval.studio.state.playback import Playback


def clip(**values: float | bool) -> Playback:
    """Return the playback of a clip of 11 frames at 10 fps, from 2 s to 3 s in its file."""
    made = Playback()
    made.show(2.0, 11, 10.0)
    for name, value in values.items():
        setattr(made, name, value)
    return made


def test_time_runs_by_its_speed_only_while_it_plays() -> None:
    playback = clip(speed=0.5)
    playback.advance(0.4)
    assert playback.time_s == 2.0
    playback.play(True)
    playback.advance(0.4)
    assert playback.time_s == pytest.approx(2.2)
    assert (playback.frame, playback.num_frames) == (2, 11)


def test_it_loops_or_stops_at_the_end() -> None:
    looped = clip(is_playing=True, time_s=2.9)
    looped.advance(0.3)
    assert (looped.time_s, looped.is_playing) == (pytest.approx(2.2), True)
    once = clip(is_playing=True, time_s=2.9, is_looped=False)
    once.advance(0.3)
    assert (once.time_s, once.is_playing) == (3.0, False)
    once.play(True)
    assert once.time_s == 2.0


def test_steps_are_of_frames_and_end_with_the_clip() -> None:
    playback = clip(is_playing=True)
    playback.step(3)
    assert (playback.time_s, playback.is_playing) == (pytest.approx(2.3), False)
    playback.step(-9)
    assert playback.time_s == 2.0


def test_another_clip_keeps_the_time_that_it_has() -> None:
    playback = clip(time_s=2.8)
    playback.show(2.0, 5, 10.0)
    assert playback.time_s == pytest.approx(2.4)


def test_a_clip_of_one_frame_plays_and_ends() -> None:
    playback = Playback()
    playback.show(0.0, 1, 60.0)
    playback.play(True)
    playback.advance(0.1)
    assert (playback.time_s, playback.frame, playback.is_playing) == (0.0, 0, False)
