"""Sitting, lying, climbing and being carried, by figures whose feet and pelvis are put where a person can check them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.cleanup.off_feet_spans import find_off_feet_spans
from datasets.ik.leg_ik import leg_ik
from datasets.imu.suit_simulation import simulate_suit
from datasets.library.sources import load_clips
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES, SKELETON
from datasets.motion.rotation import conjugate, from_axis_angle, multiply
from datasets.synthetic.clips import synthetic_clips
from tests.builders import STANDING, posed

FPS = 60.0
UP, Y = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
ANKLE = 0.08  # m above its sole


def track(*knots: tuple[float, ...]) -> np.ndarray:
    """Return straight lines through knots (time [s], values ...), one row a frame."""
    times, values = np.array(knots)[:, 0], np.array(knots)[:, 1:]
    frames = np.arange(round(times[-1] * FPS)) / FPS
    return np.stack([np.interp(frames, times, column) for column in values.T], axis=1)


def figure(pelvis: np.ndarray, left: np.ndarray | None = None, right: np.ndarray | None = None, lean: float = 0.0) -> BodyMotion:
    """Return an upright figure with arms to the side.

    Args:
        pelvis: x and height [m], shape (T, 2).
        left: x and height of the left sole [m], shape (T, 2); at the origin if there is none.
        right: The same of the right one.
        lean: Forward lean of the trunk where the pelvis is lowest, in proportion elsewhere [degrees].
    """
    frames = len(pelvis)
    root = np.stack([pelvis[:, 0], np.zeros(frames), pelvis[:, 1]], axis=1)
    local = np.zeros((frames, BODY_COUNT, 4))
    local[..., 0] = 1.0
    depth = (STANDING - pelvis[:, 1]) / max(STANDING - pelvis[:, 1].min(), 1e-9)
    local[:, BODY_NAMES.index("spine")] = from_axis_angle(Y, np.radians(lean) * depth)
    for side, sole in (("l", left), ("r", right)):
        thigh, shin, foot = (BODY_NAMES.index(f"{part}_{side}") for part in ("thigh", "shin", "foot"))
        hip = root + SKELETON.offsets[thigh]
        at = np.zeros((frames, 2)) if sole is None else sole
        ankle = np.stack([at[:, 0], hip[:, 1], at[:, 1] + ANKLE], axis=1)
        thigh_w, flexion = leg_ik(hip, ankle, np.tile([1.0, 0.0, 0.0], (frames, 1)))
        local[:, thigh], local[:, shin] = thigh_w, from_axis_angle(Y, flexion)
        local[:, foot] = conjugate(multiply(thigh_w, local[:, shin]))
    return BodyMotion(root, local, FPS, "figure")


def on_a_chair() -> BodyMotion:
    """Return a figure that stands for 2 s, sits down within 1.5 s, sits for 3 s, gets up within 1.5 s and stands for 2 s."""
    return figure(track((0, 0, 0.93), (2, 0, 0.93), (3.5, -0.42, 0.52), (6.5, -0.42, 0.52), (8, 0, 0.93), (10, 0, 0.93)))


def tilted(angles: dict[str, float], pitch: float, height: float) -> BodyMotion:
    """Return 3 s of a pose whose pelvis is tilted forward by ``pitch`` [degrees]."""
    clip = posed(angles, frames=180, height=height)
    local = clip.local_rotations.copy()
    local[:, 0] = from_axis_angle(Y, np.radians(pitch))
    return replace(clip, local_rotations=local)


def moved(clip: BodyMotion, velocity: np.ndarray, lift: float = 0.0) -> BodyMotion:
    return replace(clip, root_position=clip.root_position + np.arange(len(clip))[:, None] / FPS * velocity + lift * UP)


@pytest.mark.parametrize(("velocity", "lift"), [((0.0, 0.0, 0.0), 0.0), ((0.3, 0.1, 0.03), 0.4)], ids=["as it is", "faulty"])
def test_who_sits_on_a_chair_sits_from_going_down_to_having_got_up(velocity: tuple[float, float, float], lift: float) -> None:
    # A seat at 0.45 m: the pelvis' shape ends 0.07 m under its origin. Of the mass about 0.62 is above the pelvis at x = -0.42 m, 0.25
    # are the thighs from there to the knees above the ankles, the rest at 0: the centre is near -0.31 m, the heels are at -0.06 m.
    # The pelvis falls by 0.41 m in 1.5 s: it passes 0.90 m at 2.11 s, and 7.89 s on its way up; margins of 0.25 s. The faulty clip
    # floats 0.4 m and more high, skates at 0.3 m/s and rises at 3 cm/s.
    (span,) = find_off_feet_spans(moved(on_a_chair(), np.array(velocity), lift))
    assert span.reason == "sits or is held"
    assert abs(span.start / FPS - 1.86) < 0.03
    assert abs(span.stop / FPS - 8.14) < 0.03


def test_a_suit_s_errors_do_not_hide_who_sits() -> None:
    (span,) = find_off_feet_spans(simulate_suit(on_a_chair(), seed=0).faulty)
    assert span.reason == "sits or is held"
    assert span.start < 2.5 * FPS
    assert span.stop > 7.5 * FPS


def test_a_chair_that_is_left_at_once_is_none() -> None:  # 0.2 s of sitting, within 0.75 s of a low pelvis
    clip = figure(track((0, 0, 0.93), (2, 0, 0.93), (2.4, -0.42, 0.52), (2.6, -0.42, 0.52), (3, 0, 0.93), (5, 0, 0.93)))
    assert find_off_feet_spans(clip) == []


def test_squats_and_lunges_stand_on_their_feet() -> None:
    # Squat: hips 0.20 m behind the ankles, trunk 45 degrees forward: its middle, 0.3 m up, is at -0.2 + 0.3 sin 45 = 0.01 m, the thighs'
    # near 0: all between heels at -0.06 m and toes at 0.2 m. Lunge: the pelvis is half way between feet 1 m apart.
    squat = figure(track((0, 0, 0.93), (1, 0, 0.93), (2, -0.2, 0.4), (5, -0.2, 0.4), (6, 0, 0.93)), lean=45.0)
    lunge = figure(track((0, 0, 0.5), (4, 0, 0.5)), track((0, 0.5, 0), (4, 0.5, 0)), track((0, -0.5, 0), (4, -0.5, 0)))
    assert find_off_feet_spans(squat) == []
    assert find_off_feet_spans(lunge) == []


def test_who_sits_on_the_ground_sits() -> None:  # legs straight ahead, so that the feet are where no weight is
    legs = {"thigh_l_y": -90.0, "thigh_r_y": -90.0}
    assert find_off_feet_spans(tilted(legs, 0.0, 0.08)) == [(0, 180, "sits or is held")]


def test_who_lies_or_crawls_is_on_more_than_feet() -> None:
    # On the back, the pelvis 0.1 m over the ground. On hands and knees: the thighs hang down from hips 0.51 m high, so the knees are at
    # 0.09 m, the feet 0.41 m behind them; the trunk rises forward by 20 degrees to shoulders 0.52 + 0.47 sin 20 = 0.68 m high, and the
    # arms, 0.66 m long, reach the ground. What is ahead of the pelvis weighs more than the legs, so the centre of mass is far from feet.
    assert find_off_feet_spans(tilted({}, -90.0, 0.1)) == [(0, 180, "lies")]
    arms = {"upper_arm_l_z": -90.0, "upper_arm_r_z": 90.0}
    legs = {f"{part}_{side}_y": angle for side in "lr" for part, angle in (("thigh", -70.0), ("shin", 90.0), ("foot", 90.0))}
    assert find_off_feet_spans(tilted(arms | legs, 70.0, 0.52)) == [(0, 180, "kneels or crawls")]


def test_who_lies_on_the_side_lies() -> None:
    # Rolled by 90 degrees onto the right arm, which lies along the body: the shoulder, 0.2 m from the middle, and the arm are under it.
    clip = posed({"upper_arm_l_x": -80.0, "upper_arm_r_x": 80.0, "thigh_l_y": -40.0, "shin_l_y": 60.0}, frames=180, height=0.3)
    local = clip.local_rotations.copy()
    local[:, 0] = from_axis_angle(np.array([1.0, 0.0, 0.0]), np.radians(90.0))
    assert find_off_feet_spans(replace(clip, local_rotations=local)) == [(0, 180, "lies")]


def onto_a_step(rise: float) -> BodyMotion:
    """Return a figure that puts the left foot on a step at 1 s and the right one at 1.8 s, and goes on up there from 3 s to 4.3 s."""
    places = ((0, 0.0, 0.0), (0.25, 0.15, rise + 0.05), (0.5, 0.3, rise), (2, 0.3, rise), (2.25, 0.45, rise + 0.05), (2.5, 0.6, rise))
    left, right = (track((0, 0, 0), *((start + t, x, z) for t, x, z in places), (5, 0.6, rise)) for start in (1.0, 1.8))
    over = track((0, 0, 0), (1, 0, 0), (1.5, 0.2, 0), (1.8, 0.2, 0), (2.3, 0.3, rise), (3, 0.3, rise), (4.3, 0.6, rise), (5, 0.6, rise))
    return figure(over + np.array([0.0, 0.9]), left, right)


@pytest.mark.parametrize("rooted", [True, False])
def test_who_stands_on_a_step_has_climbed_until_the_end(rooted: bool) -> None:
    # A foot's speeds are averaged over 5 frames, so that it stands up to 2 frames longer: 1.0 s + 0.03 s - 0.25 s of margin.
    (span,) = find_off_feet_spans(replace(onto_a_step(0.2), rooted=rooted))
    assert span.reason == "climbs"
    assert abs(span.start / FPS - 0.77) < 0.05
    assert span.stop == 300


def test_what_a_suit_gets_wrong_is_no_step() -> None:
    assert find_off_feet_spans(onto_a_step(0.1)) == []
    assert find_off_feet_spans(moved(posed({}, frames=300), np.array([0.0, 0.0, 0.1]), 0.46)) == []


def test_who_comes_down_again_is_back_on_the_ground() -> None:
    up = onto_a_step(0.2)
    there_and_back = replace(
        up,
        root_position=np.concat([up.root_position, up.root_position[::-1]]),
        local_rotations=np.concat([up.local_rotations, up.local_rotations[::-1]]),
    )
    (span,) = find_off_feet_spans(there_and_back)
    assert abs(span.start + span.stop - 600) <= 2  # the same forwards as backwards
    assert span.stop < 600 - 0.6 * FPS


def test_a_jump_onto_a_box_counts_where_heights_were_recorded() -> None:
    # Both feet leave the ground together and land 0.4 m higher within 0.5 s: no frame shows both levels.
    rise = track((0, 0, 0), (2, 0, 0), (2.3, 0, 0.6), (2.5, 0, 0.4), (5, 0, 0.4))
    clip = figure(rise + np.array([0.0, 0.9]), rise, rise)
    (span,) = find_off_feet_spans(clip)
    assert span.reason == "climbs"
    assert span.stop == 300
    assert find_off_feet_spans(replace(clip, rooted=False)) == []


@pytest.mark.parametrize(("rise", "climbs"), [(-0.32, False), (1.5, True)])
def test_a_root_that_drifts_while_no_foot_stands_is_no_step(rise: float, climbs: bool) -> None:
    # Gliding at 2.5 m/s for 3 s, as a runner in whose recording no foot ever stands: a suit's root may drift by 0.6 m in that time, which
    # a step of 0.25 m has to exceed.
    over = track((0, 0, 0), (1, 0, 0), (4, 7.5, rise), (5, 7.5, rise))
    spans = find_off_feet_spans(figure(over + np.array([0.0, 0.9]), over, over))
    assert ["climbs" in span.reason for span in spans] == [True] * climbs


@pytest.mark.parametrize(("seconds", "found"), [(0.6, []), (3.0, ["hangs or is carried"])])
def test_nobody_jumps_for_seconds(seconds: float, found: list[str]) -> None:
    # Lifted to 0.6 m at 2 m/s, carried along at 1 m/s, set down: in the air 0.3 s longer than carried. A jump of 0.6 s is a good one.
    carried = seconds - 0.6
    height = track((0, 0), (1, 0), (1.3, 0.6), (1.3 + carried, 0.6), (1.6 + carried, 0), (3 + carried, 0))[:, 0]
    still = posed({}, frames=len(height))
    along = np.where(height > 0, 1.0, 0.0).cumsum() / FPS
    clip = replace(still, root_position=still.root_position + np.stack([along, 0 * along, height], axis=1))
    assert [span.reason for span in find_off_feet_spans(clip)] == found


def test_of_synthetic_motion_only_stairs_need_more_than_level_ground() -> None:
    for clip in synthetic_clips(seed=5, performer_count=1, seconds=6.0):
        assert {span.reason for span in find_off_feet_spans(clip)} == ({"climbs"} if clip.kind == "stairs" else set()), clip.name


@pytest.mark.shared_data
@pytest.mark.parametrize(
    "file",
    [
        "cmu/train/cmu_salsa_10.bvh",  # lunges with a partner to lean on
        "cmu/train/cmu_indian_07.bvh",  # deep squats
        "cmu/train/cmu_martial_10.bvh",
        "cmu/train/cmu_131_01.bvh",  # a knee on the ground
        "cmu/train/cmu_14_14.bvh",
        "cmu/test/cmu_01_01.bvh",  # jumps
        "mit/imu/rokoko_jesse_dance.bvh",  # floats
        "gpl/imu/xsens_neura_S02_walk1.bvh",
    ],
)
def test_real_dancers_fighters_and_jumpers_are_on_the_ground(shared_data: Path, file: str) -> None:
    (clip,) = load_clips(shared_data / file)
    assert find_off_feet_spans(clip) == []


@pytest.mark.shared_data
def test_a_real_dancer_who_is_let_down_by_her_partner_is_found_there(shared_data: Path) -> None:
    # By the recording: from 12.3 to 13.2 s and from 13.7 to 14.7 s her pelvis is 0.3 to 0.4 m above her soles and her centre of mass up to
    # 0.15 m beyond them; she begins to go down at 10.0 s and is up at 18.0 s. Elsewhere she dances on her feet.
    (clip,) = load_clips(shared_data / "cmu/train/cmu_salsa_01.bvh")
    (span,) = find_off_feet_spans(clip)
    assert span.reason == "sits or is held"
    assert 9.5 * FPS < span.start < 10.7 * FPS
    assert 14.7 * FPS < span.stop < 18.3 * FPS


@pytest.mark.shared_data
def test_a_real_climber_is_found_on_his_boxes(shared_data: Path) -> None:
    (clip,) = load_clips(shared_data / "noncommercial/pfnn/train/pfnn_NewCaptures10_000.bvh")
    spans = find_off_feet_spans(clip)
    assert {span.reason for span in spans} == {"climbs"}
    high = clip.root_position[:, 2] > 1.2  # nobody's pelvis is there who stands on the ground
    assert high.sum() > 2 * FPS
    assert all(any(span.start <= frame < span.stop for span in spans) for frame in np.flatnonzero(high))
    assert sum(span.stop - span.start for span in spans) < 0.65 * len(clip)
