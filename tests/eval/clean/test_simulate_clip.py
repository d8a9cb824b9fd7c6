"""Simulations blended into a clip, by hand: segments are given, or made by a small search."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, hinge_angles
from datasets.motion.kinematics import body_poses
from envs.physics.segment import Segment
from eval.clean import simulate_clip as module
from eval.clean.simulate_clip import SimulatedClip, simulate_clip, without_simulation
from tests.builders import STANDING, posed
from tests.eval.clean.clean_parts import simulator, standing

FRAMES = 601  # 10 s
TIME = np.arange(FRAMES) / 60.0
INNER = slice(240, -240)  # averages of 1 s standard deviation are cut off at 4 of them
X, Y, Z = np.eye(3)
ELBOWS = [BODY_NAMES.index("forearm_l"), BODY_NAMES.index("forearm_r")]


def taken(motion: BodyMotion, start: int, stop: int) -> Segment:
    """Return the frames of a clip from ``start`` up to ``stop`` as a take of somebody who moves just so, loosely."""
    part = motion.cut(start, stop)
    poses = np.concat([part.root_position, part.local_rotations[:, 0], hinge_angles(part.local_rotations)], axis=1)
    return Segment(start, poses, np.zeros((len(part), 49)), poses[:, 7:], np.zeros(len(part)))


def perform_as(
    monkeypatch: pytest.MonkeyPatch, clip: BodyMotion, takes: list[Segment], joins: tuple[bool, bool] = (False, False)
) -> SimulatedClip:
    """Return what becomes of a clip whose search returns the given segments."""

    class Actors:
        def __init__(self, *_: object, **__: object) -> None:
            pass

        def segments(self) -> Iterator[Segment]:
            return iter(takes)

    monkeypatch.setattr(module, "SamconSearch", Actors)
    return simulate_clip(simulator(), clip, joins)


def still(angles: dict[str, float], root: np.ndarray | None = None) -> BodyMotion:
    """Return a pose that is held for 10 s while the pelvis moves by ``root`` (T, 3) [m]."""
    motion = posed(angles, FRAMES)
    return motion if root is None else replace(motion, root_position=motion.root_position + root)


def test_what_is_far_from_the_clip_is_not_trusted(monkeypatch: pytest.MonkeyPatch) -> None:
    # Arms that hang instead of being spread: elbows 0.28 sqrt 2 off, hands 0.53 sqrt 2: (0.396 + 0.750) x 2 / 20 = 0.115 m on average,
    # more than the 0.05 from which on nothing is trusted.
    clip = still({})
    hangs = still({"upper_arm_l_x": -90.0, "upper_arm_r_x": 90.0}, 0.3 * TIME[:, None] * X)
    found = perform_as(monkeypatch, clip, [taken(hangs, 0, FRAMES)])
    assert not found.confidence.any()
    assert not found.contacts.any()
    assert found.motion.root_position == pytest.approx(clip.root_position, abs=1e-9)
    assert found.motion.local_rotations == pytest.approx(clip.local_rotations, abs=1e-9)


def test_more_help_than_is_allowed_is_no_physics(monkeypatch: pytest.MonkeyPatch) -> None:
    # The search allows a tenth of the body's weight. In frames 200 to 209 a fifth carried the body: nothing of these is trusted, half of
    # the frames beside them within 0.15 s, 9 frames, and all beyond.
    clip = still({})
    performance = taken(clip, 0, FRAMES)
    performance.assist[:] = 0.1
    performance.assist[200:210] = 0.2
    found = perform_as(monkeypatch, clip, [performance])
    assert not found.confidence[200:210].any()
    assert found.confidence[[195, 214]] == pytest.approx(0.5)
    assert found.confidence[[190, 219]] == pytest.approx(1.0)
    assert found.assist.max() == pytest.approx(0.1)


def test_what_is_near_is_the_performance(monkeypatch: pytest.MonkeyPatch) -> None:
    # Elbows bent by 40 degrees: hands 2 x 0.25 sin 20 = 0.171 m off, 0.0171 on average: under 0.02. And 2 cm lower.
    performance = still({"forearm_l_z": 40.0, "forearm_r_z": -40.0}, -0.02 * np.ones((FRAMES, 1)) * Z)
    found = perform_as(monkeypatch, still({}), [taken(performance, 0, FRAMES)])
    assert found.confidence == pytest.approx(1.0)
    assert found.segment_starts == [0]
    assert found.motion.root_position == pytest.approx(performance.root_position, abs=1e-9)
    assert np.abs(np.sum(found.motion.local_rotations * performance.local_rotations, axis=-1)) == pytest.approx(1.0)


def test_what_is_between_is_blended(monkeypatch: pytest.MonkeyPatch) -> None:
    # Elbows bent by 80 degrees: hands 2 x 0.25 sin 40 = 0.3214 m off, 0.03214 on average. (0.05 - 0.03214) / 0.03 = 0.5954, and smoothed
    # 3 x 0.5954^2 - 2 x 0.5954^3 = 0.6413. Of (1, 0, 0, 0) and (cos 40, 0, 0, sin 40): (0.3587 + 0.6413 x 0.7660, 0, 0, 0.6413 x 0.6428) =
    # (0.8500, 0, 0, 0.4122): 2 atan(0.4122 / 0.8500) = 51.75 degrees. 4 cm lower: 0.6413 x 4 = 2.565 cm.
    performance = still({"forearm_l_z": 80.0, "forearm_r_z": -80.0}, -0.04 * np.ones((FRAMES, 1)) * Z)
    found = perform_as(monkeypatch, still({}), [taken(performance, 0, FRAMES)])
    assert found.confidence == pytest.approx(0.6413, abs=1e-4)
    elbows = found.motion.local_rotations[:, ELBOWS]
    assert np.degrees(2.0 * np.arctan2(elbows[..., 3], elbows[..., 0])) == pytest.approx(np.tile([51.75, -51.75], (FRAMES, 1)), abs=0.05)
    assert found.motion.root_position[:, 2] == pytest.approx(STANDING - 0.02565, abs=1e-5)


def test_feet_that_slide_in_the_clip_stand_in_the_performance(monkeypatch: pytest.MonkeyPatch) -> None:
    # The clip slides 4 cm to and fro at 2 Hz, the performance stands: its steps are taken, and of the sliding, which leads it back to
    # the clip's path, an average of 1 s leaves nothing.
    slides = still({}, 0.04 * np.sin(4.0 * np.pi * TIME)[:, None] * Y)
    found = perform_as(monkeypatch, slides, [taken(still({}), 0, FRAMES)])
    assert found.motion.root_position[INNER] == pytest.approx(np.tile([0.0, 0.0, STANDING], (FRAMES, 1))[INNER], abs=1e-3)


def test_a_performance_that_drifts_is_led_back_slowly(monkeypatch: pytest.MonkeyPatch) -> None:
    # The clip goes at 1.2 m/s, the performance at 1 m/s from 0.5 m beside: its steps alone would fall behind by 0.2 t, and a symmetric
    # average gives that back. The half metre is no step.
    clip = still({}, 1.2 * TIME[:, None] * X)
    found = perform_as(monkeypatch, clip, [taken(still({}, TIME[:, None] * X + 0.5 * Y), 0, FRAMES)])
    assert found.motion.root_position[INNER] == pytest.approx(clip.root_position[INNER], abs=1e-6)
    assert np.abs(found.motion.root_position[:, 1]).max() < 1e-9


def test_seams_are_blended(monkeypatch: pytest.MonkeyPatch) -> None:
    # The first take ends 2 m away with bent elbows; the second begins with the clip. Nobody trusts the moment between, no frame jumps,
    # and 0.15 s away, 9 frames, the seam is forgotten.
    clip = still({})
    first = still({"forearm_l_z": 40.0, "forearm_r_z": -40.0}, 0.4 * TIME[:, None] * X)
    found = perform_as(monkeypatch, clip, [taken(first, 0, 301), taken(clip, 300, FRAMES)])
    assert found.segment_starts == [0, 300]
    assert found.confidence[300] == 0.0
    assert found.confidence[291] == found.confidence[309] == pytest.approx(1.0)
    # About half-way, 5 and 4 of 9 frames away: 3 x 0.3086 - 2 x 0.1715 = 0.5830 and 3 x 0.1975 - 2 x 0.0878 = 0.4170.
    assert found.confidence[[295, 296]] == pytest.approx([0.5830, 0.4170], abs=1e-4)
    # The elbows open by 40 degrees within 9 frames: steepest in the middle, by 1.5 times 40 / 9 = 6.7 degrees a frame.
    opened = np.degrees(2.0 * np.arctan2(found.motion.local_rotations[:, ELBOWS[0], 3], found.motion.local_rotations[:, ELBOWS[0], 0]))
    assert opened[270] == pytest.approx(40.0, abs=0.5)
    assert opened[330] == pytest.approx(0.0, abs=0.5)
    assert np.abs(np.diff(opened)).max() < 7.0
    # 0.4 m/s are 0.0067 m a frame; the way back to the clip's path adds what it subtracts elsewhere.
    assert np.abs(np.diff(found.motion.root_position[:, 0])).max() < 0.02


def test_what_could_not_be_performed_is_not_trusted(monkeypatch: pytest.MonkeyPatch) -> None:
    # Takes of a single frame, the reference's own, and nothing between them: near to the clip, but no performance.
    clip = still({})
    found = perform_as(monkeypatch, clip, [taken(clip, start, start + 1) for start in range(0, 599, 2)])
    assert found.confidence[30:].max() < 0.05


@pytest.mark.parametrize(
    ("joins", "first", "last"), [((False, False), 1.0, 1.0), ((True, False), 0.0343, 1.0), ((False, True), 1.0, 0.0343)]
)
def test_performances_fit_what_comes_before_and_after(
    monkeypatch: pytest.MonkeyPatch, joins: tuple[bool, bool], first: float, last: float
) -> None:
    # One frame of 9 away from what is not performed: 3 / 81 - 2 / 729 = 0.0343.
    performance = still({"forearm_l_z": 40.0})
    found = perform_as(monkeypatch, still({}), [taken(performance, 0, FRAMES)], joins)
    assert found.confidence[[0, -1]] == pytest.approx([first, last], abs=1e-4)
    assert found.confidence[20:-20] == pytest.approx(1.0)


@pytest.mark.parametrize("frames", [60, 61])
def test_a_search_covers_all_of_a_clip(frames: int) -> None:
    clip = standing(frames)
    found, again = (simulate_clip(simulator(), clip) for _ in range(2))
    assert (len(found.motion), found.contacts.shape, found.confidence.shape, found.segment_starts) == (frames, (frames, 2), (frames,), [0])
    assert (found.motion.fps, found.motion.name) == (60.0, clip.name)
    # It stands with both feet on the ground from the first to the last frame, and near the clip.
    assert found.confidence == pytest.approx(1.0, abs=0.01)
    assert found.contacts.mean() > 0.9
    error = body_poses(found.motion)[0] - body_poses(clip)[0]
    assert np.linalg.norm(error - error[:, :1], axis=-1).mean() < 0.03
    # The same clip is performed in the same way.
    assert np.array_equal(found.motion.root_position, again.motion.root_position)
    assert np.array_equal(found.motion.local_rotations, again.motion.local_rotations)
    assert np.array_equal(found.contacts, again.contacts)


def test_confidence_is_a_share_wherever_a_search_fails() -> None:
    # A T-pose that takes off: there is nothing to stand on, so takes end soon, and are trusted little.
    rest = posed({}, 90)
    time = np.arange(90) / 60.0
    clip = replace(rest, root_position=rest.root_position + 10.0 * np.clip(time - 0.5, 0.0, None)[:, None] ** 2 * Z)
    found = simulate_clip(simulator(), clip)
    assert len(found.segment_starts) > 1
    assert found.confidence.min() >= 0.0
    assert found.confidence.max() <= 1.0 + 1e-9
    assert found.confidence[found.segment_starts[1:]] == pytest.approx(0.0)


def test_untouched() -> None:
    clip = posed({}, 7)
    found = without_simulation(clip)
    assert found.motion is clip
    assert not found.confidence.any()
    assert (found.contacts.shape, found.contacts.any(), found.segment_starts) == ((7, 2), False, [])
