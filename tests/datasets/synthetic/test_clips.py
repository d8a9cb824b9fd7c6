"""Synthetic motion: planted feet, human joints, requested speeds, flight, balance, seeds."""

import numpy as np
import pytest

from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import (
    BODIES,
    BODY_COM_OFFSETS,
    BODY_MASSES_KG,
    BODY_NAMES,
    FOOT_AND_TOE_BODIES,
    hinge_angles,
    hinge_slice,
    rotations_from_hinges,
)
from datasets.motion.kinematics import body_poses, centre_of_mass, lowest_point_heights
from datasets.motion.rotation import conjugate, heading, multiply, rotate, rotation_angle
from datasets.synthetic.clips import MIN_CLIP_S, synthetic_clips, walk
from datasets.synthetic.movement_style import draw_movement_style

FLAT = ("stand", "walk", "turn", "run", "sit", "squat")
TOE_TIP = 0.20  # m before the ankle: toe joint 0.13, toes 0.07


@pytest.fixture(scope="module")
def clips() -> list[BodyMotion]:
    return synthetic_clips(seed=5, performer_count=2, seconds=8.0)


def of_kind(clips: list[BodyMotion], *kinds: str) -> list[BodyMotion]:
    found = [clip for clip in clips if clip.kind in kinds]
    assert {clip.kind for clip in found} == set(kinds)
    return found


def sole(clip: BodyMotion, body: int) -> np.ndarray:
    """Return the corners (T, 4, 3) under a foot or under toes."""
    positions, rotations = body_poses(clip)
    corners = np.array(BODIES[body].shape.points)
    corners = corners[corners[:, 2] == corners[:, 2].min()]
    shape = (len(clip), len(corners))
    turned = rotate(np.broadcast_to(rotations[:, body, None], (*shape, 4)), np.broadcast_to(corners, (*shape, 3)))
    return positions[:, body, None] + turned


def foot_heights(clip: BodyMotion) -> np.ndarray:
    """Return the height (T, 2) of each foot's lowest point."""
    low = lowest_point_heights(*body_poses(clip))
    return np.stack([low[:, list(side)].min(axis=1) for side in FOOT_AND_TOE_BODIES], axis=1)


def test_every_person_does_everything(clips: list[BodyMotion]) -> None:
    assert len({clip.name for clip in clips}) == len(clips) == 22
    for performer in {clip.performer for clip in clips}:
        kinds = [clip.kind for clip in clips if clip.performer == performer]
        assert sorted(kinds) == ["run", "sit", "squat", "stairs", "stairs", "stand", "turn", "turn", "walk", "walk", "walk"]
    assert {(clip.system, clip.fps, len(clip)) for clip in clips} == {("synthetic", 60.0, 480)}


def test_planted_soles_do_not_slip(clips: list[BodyMotion]) -> None:
    for clip in of_kind(clips, *FLAT):
        for body in sum(FOOT_AND_TOE_BODIES, ()):
            corners = sole(clip, body)
            flat = np.all(np.abs(corners[..., 2]) < 1e-6, axis=1)
            stays = flat[1:] & flat[:-1]
            moved = np.linalg.norm(np.diff(corners, axis=0), axis=-1).max(axis=1)
            assert stays.mean() > 0.2  # so that there is something to test: in a run a foot is flat a quarter of the time
            assert moved[stays].max() < 1e-4


def test_nothing_is_under_the_ground(clips: list[BodyMotion]) -> None:
    for clip in clips:
        assert lowest_point_heights(*body_poses(clip)).min() > -0.005


def test_someone_always_stands_but_runners_fly(clips: list[BodyMotion]) -> None:
    for clip in of_kind(clips, "stand", "walk", "turn", "sit", "squat"):
        assert foot_heights(clip).min(axis=1).max() < 1e-3
    for clip in of_kind(clips, "run"):
        positions, rotations = body_poses(clip)
        airborne = foot_heights(clip).min(axis=1) > 0.005
        assert 0.02 < airborne.mean() < 0.4
        # The middle of a flight, where nothing carries the body: it falls with g.
        fall = np.diff(centre_of_mass(positions, rotations)[:, 2], 2) * 60.0**2
        free = airborne[:-2] & airborne[1:-1] & airborne[2:]
        assert np.median(fall[free]) == pytest.approx(-9.81, abs=1.5)


def test_the_hinges_reproduce_every_clip(clips: list[BodyMotion]) -> None:
    for clip in clips:
        again = rotations_from_hinges(clip.local_rotations[:, 0], hinge_angles(clip.local_rotations))
        assert rotation_angle(multiply(conjugate(clip.local_rotations), again)).max() < 1e-7  # an angle is the root of a rounded square
        assert np.abs(np.abs(np.sum(clip.local_rotations * again, axis=-1)) - 1.0).max() < 1e-9


def test_knees_and_elbows_bend_as_human_ones(clips: list[BodyMotion]) -> None:
    for clip in clips:
        angles = np.degrees(hinge_angles(clip.local_rotations))
        for name, forward in (("shin_l", 1), ("shin_r", 1), ("forearm_l", -1), ("forearm_r", 1)):
            bent = forward * angles[:, hinge_slice(BODY_NAMES.index(name))]
            assert bent.min() >= 0.0 and bent.max() <= 150.0


def test_joints_are_no_faster_than_human_ones(clips: list[BodyMotion]) -> None:
    for clip in clips:
        turn = rotation_angle(multiply(conjugate(clip.local_rotations[:-1]), clip.local_rotations[1:]))[:, 1:] * 60.0
        assert turn.max() < 20.0  # rad/s; a sprinter's knee reaches about that
        assert np.abs(np.diff(turn, axis=0)).max() * 60.0 < 900.0  # rad/s^2
        push = np.diff(centre_of_mass(*body_poses(clip)), 2, axis=0) * 60.0**2
        assert np.linalg.norm(push, axis=-1).max() < 2.5 * 9.81


def test_clips_begin_and_end_standing(clips: list[BodyMotion]) -> None:
    for clip in clips:
        speed = np.linalg.norm(np.diff(clip.root_position, axis=0), axis=-1) * 60.0
        assert speed[[0, -1]].max() < 0.1
        heights = clip.root_position[[0, -1], 2] - foot_heights(clip)[[0, -1]].min(axis=1)
        assert np.all((heights > 0.88) & (heights < 0.95))


def test_walking_speed_and_distance_are_those_asked_for() -> None:
    t = np.arange(720) / 60.0
    for speed in (0.7, 1.2):
        clip = walk(t, speed, draw_movement_style("somebody", np.random.default_rng(1)), np.random.default_rng(2))
        x = clip.root_position[:, 0]
        # Steady after 1 s of standing and 0.6 + 0.8 v (at most 1.56 s) of setting off, until 0.6 + 1.2 v and 1 s before the end.
        assert (x[530] - x[170]) / 6.0 == pytest.approx(speed, rel=0.03)
        # Both ramps are symmetric, so each covers half of what full speed would: v (11.983 - 2 - (1.2 + 2 v) / 2).
        assert x[-1] - x[0] == pytest.approx(speed * (9.983 - 0.6 - speed), abs=0.05)
        assert np.abs(clip.root_position[:, 1]).max() < 0.15


def test_the_ground_pushes_from_under_the_feet() -> None:
    """The point where the moments of weight and acceleration of the 20 bodies vanish lies between heels and toes."""
    t = np.arange(600) / 60.0
    clip = walk(t, 1.3, draw_movement_style("somebody", np.random.default_rng(3)), np.random.default_rng(4))
    positions, rotations = body_poses(clip)
    # By finite differences of the whole body: M (z'' + g) p = M (z'' + g) x - M z x'' - L', with L about the centre of mass.
    centres = positions + rotate(rotations, np.broadcast_to(BODY_COM_OFFSETS, positions.shape))
    pull = np.diff(centres, 2, axis=0) * 60.0**2 + np.array([0.0, 0.0, 9.81])
    x, z = centres[1:-1, :, 0], centres[1:-1, :, 2]
    pressure = np.sum(BODY_MASSES_KG * (pull[..., 2] * x - pull[..., 0] * z), axis=1) / np.sum(BODY_MASSES_KG * pull[..., 2], axis=1)
    down = foot_heights(clip)[1:-1] < 1e-3
    ankles = positions[1:-1, [foot for foot, _ in FOOT_AND_TOE_BODIES], 0]
    front = np.where(down, ankles + TOE_TIP, -np.inf).max(axis=1)
    back = np.where(down, ankles - 0.06, np.inf).min(axis=1)
    assert np.mean((pressure > back - 0.02) & (pressure < front + 0.02)) > 0.98


def test_slow_bends_keep_the_weight_over_the_soles(clips: list[BodyMotion]) -> None:
    for clip in of_kind(clips, "stand", "sit", "squat"):
        positions, rotations = body_poses(clip)
        ankles = positions[:, [foot for foot, _ in FOOT_AND_TOE_BODIES]]
        ahead = centre_of_mass(positions, rotations)[:, 0] - ankles[..., 0].mean(axis=1)
        assert ahead.min() > -0.06 and ahead.max() < 0.13  # the foot's box, without the toes
    for clip in of_kind(clips, "sit"):
        # The buttocks, 0.07 m under the pelvis' origin while it is level, come down to a chair of 0.45 m and stay.
        assert clip.root_position[:, 2].min() == pytest.approx(0.52, abs=0.01)
        assert np.mean(clip.root_position[:, 2] < 0.53) > 0.2
    for clip in of_kind(clips, "squat"):
        lows = clip.root_position[:, 2] < 0.70
        assert np.sum(lows[1:] & ~lows[:-1]) >= 2  # times that it goes down


def test_turns_turn(clips: list[BodyMotion]) -> None:
    for clip in of_kind(clips, "turn"):
        yaw = np.unwrap(heading(clip.local_rotations[:, 0]))
        if clip.name.endswith("spot"):
            assert abs(yaw[-1]) > np.pi and np.ptp(clip.root_position[:, :2], axis=0).max() < 0.2
        else:  # around one bend and back around another
            assert np.ptp(yaw) > 1.0 and abs(yaw[-1]) < 0.5 * np.ptp(yaw)


def test_stairs_gain_their_steps(clips: list[BodyMotion]) -> None:
    for clip in of_kind(clips, "stairs"):
        way = clip.root_position[-1] - clip.root_position[0]
        steps = round(way[0] / 0.29)
        assert steps >= 5
        assert abs(way[2]) == pytest.approx(0.17 * steps, abs=0.01)
        assert foot_heights(clip)[[0, -1]].min() == pytest.approx(0.0, abs=1e-6)  # at the foot of the stairs
        assert (way[2] > 0) == clip.name.endswith("up")


def test_a_seed_makes_one_set_of_people() -> None:
    first, again, other = (synthetic_clips(seed, 1, MIN_CLIP_S) for seed in (1, 1, 2))
    for a, b, c in zip(first, again, other, strict=True):
        assert np.array_equal(a.root_position, b.root_position) and np.array_equal(a.local_rotations, b.local_rotations)
        assert rotation_angle(multiply(conjugate(a.local_rotations), c.local_rotations)).max() > 0.05
    assert first[0].performer != other[0].performer


@pytest.mark.parametrize(("people", "seconds"), [(0, 8.0), (1, 5.9), (1, float("nan"))])
def test_nobody_and_no_time_are_refused(people: int, seconds: float) -> None:
    with pytest.raises(ValueError, match="at least 1 and at least 6"):
        synthetic_clips(0, people, seconds)
