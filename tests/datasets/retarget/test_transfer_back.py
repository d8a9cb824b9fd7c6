"""Transfer back: changes on the 20 bodies become changes of the performer's own skeleton, and nothing else changes."""

from dataclasses import replace
from pathlib import Path
from warnings import catch_warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from configs.errors import InputError
from datasets.formats.bvh import Bvh, local_pose, read_bvh, write_bvh
from datasets.ik.leg_ik import leg_ik
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, FOOT_AND_TOE_BODIES
from datasets.motion.kinematics import body_poses, joint_poses
from datasets.motion.rotation import conjugate, cross, from_axis_angle, multiply, rotate, rotation_angle
from datasets.motion.skeleton import forward_kinematics
from datasets.performer.performer_clip import PerformerClip, performer_clip_from_bvh
from datasets.performer.reading_options import ReadingOptions
from datasets.retarget.retarget import Retargeted, retarget, retarget_with
from datasets.retarget.transfer_back import from_performer_bvh, to_performer_bvh, to_zero_ground, transfer_back
from tests.builders import STANDING, as_bvh, in_axes, lively, posed

HEADING = 130.0  # degrees
LARGER = 1.4  # the performer's size over ours
FAMILIES = [
    "cmu/train/cmu_12_01", "cmu/train/cmu_16_12_60fps", "cmu/test/cmu_05_01_mh165", "noncommercial/pfnn/train/pfnn_NewCaptures10_000",
    "noncommercial/bandai/test/bnr_dataset-2_run_youthful_001", "mit/imu/rokoko_jesse_dance", "apache/imu/pn_milad",
    "gpl/imu/xsens_neura_S02_walk1", "gpl/imu/xsens_andres_test_mocap",
]  # fmt: skip


def opened(bvh: Bvh) -> tuple[PerformerClip, Retargeted]:
    found = performer_clip_from_bvh(bvh, "clip")
    return found, retarget(found)


def large_and_turned() -> Bvh:
    """Return a lively clip of a performer 1.4 times as large as we are, who faces 130 degrees in the first frame."""
    clip, turn = lively(), Rotation.from_euler("z", HEADING, degrees=True)
    local = clip.local_rotations.copy()
    local[:, 0] = (turn * Rotation.from_quat(local[:, 0], scalar_first=True)).as_quat(scalar_first=True)
    bvh = as_bvh(replace(clip, root_position=LARGER * turn.apply(clip.root_position.copy()), local_rotations=local))
    return replace(bvh, offsets=LARGER * bvh.offsets)


def with_joint_above(bvh: Bvh, moving: bool) -> Bvh:
    """Return the clip under one more root with channels of its own; with ``moving`` the hips' places are that root's."""
    joints, frames = len(bvh.names), len(bvh.values)
    above = np.tile([3.0, 0.0, -7.0, 0.0, 20.0, 0.0], (frames, 1))  # [cm, degrees about Z, X, Y]
    values = bvh.values.copy()
    if moving:
        above[:, :3], values[:, :3] = values[:, :3], 0.0
    return Bvh(
        ("joint_Root", *bvh.names),
        (-1, *(parent + 1 for parent in bvh.parents)),
        np.concat([np.zeros((1, 3)), bvh.offsets]),
        (bvh.channels[0], *bvh.channels),
        ((), *bvh.end_sites[:joints]),
        bvh.frame_time,
        np.concat([above, values], axis=1),
    )


def file_world(bvh: Bvh) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and rotations of all joints in the file's own axes and unit."""
    return forward_kinematics(bvh.parents, *local_pose(bvh))


def turned(motion: BodyMotion, body: str, axis: tuple[float, float, float], degrees: float) -> BodyMotion:
    """Return the clip with one leaf of the 20 bodies turned about an axis of the world."""
    index, rotations = BODY_NAMES.index(body), body_poses(motion)[1]
    turn = np.broadcast_to(from_axis_angle(np.array(axis), np.array(np.radians(degrees))), (len(motion), 4))
    local = motion.local_rotations.copy()
    here, parent = rotations[:, index], multiply(rotations[:, index], conjugate(local[:, index]))
    local[:, index] = multiply(conjugate(parent), multiply(turn, here))
    return replace(motion, local_rotations=local)


def lowered(motion: BodyMotion) -> BodyMotion:
    """Return the clip with a root 5 cm lower and knees bent so that ankles and feet stay as they are."""
    low, local = replace(motion, root_position=motion.root_position - np.array([0.0, 0.0, 0.05])), motion.local_rotations.copy()
    (places, rotations), hips = body_poses(motion), body_poses(low)[0]
    for side in "lr":
        thigh, shin, foot = (BODY_NAMES.index(f"{part}_{side}") for part in ("thigh", "shin", "foot"))
        across = rotate(rotations[:, thigh], np.broadcast_to((0.0, 1.0, 0.0), hips[:, thigh].shape))
        thighs, flexion = leg_ik(hips[:, thigh], places[:, foot], cross(across, hips[:, thigh] - places[:, foot]))
        local[:, thigh] = multiply(conjugate(rotations[:, 0]), thighs)
        local[:, shin] = from_axis_angle(np.array([0.0, 1.0, 0.0]), flexion)
        local[:, foot] = multiply(conjugate(multiply(thighs, local[:, shin])), rotations[:, foot])
    return replace(low, local_rotations=local)


@pytest.mark.parametrize("bvh", [large_and_turned(), with_joint_above(large_and_turned(), moving=False)], ids=["hips", "root-above"])
def test_what_did_not_change_comes_back_number_by_number(bvh: Bvh) -> None:
    found, result = opened(bvh)
    motion = transfer_back(result, result.motion)
    assert rotation_angle(multiply(conjugate(found.motion.local_rotations), motion.local_rotations)).max() < 1e-6
    assert np.array_equal(to_performer_bvh(bvh, found, motion).values, bvh.values)


def test_a_body_that_turns_by_30_degrees_turns_its_joint_by_30_degrees_in_the_files_axes() -> None:
    bvh = large_and_turned()
    found, result = opened(bvh)
    out = to_performer_bvh(bvh, found, transfer_back(result, turned(result.motion, "head", (1.0, 0.0, 0.0), 30.0)))
    # Our x is the performer's heading: (cos 130, sin 130) on the ground. Our (x, y, z) are (z, x, y) in a file whose y is up.
    axis = np.array([np.sin(np.radians(HEADING)), 0.0, np.cos(np.radians(HEADING))])
    (places, before), (new_places, after) = file_world(bvh), file_world(out)
    head = bvh.names.index("Head")
    change = multiply(after, conjugate(before))
    expected = Rotation.from_rotvec(np.radians(30.0) * axis).as_quat(scalar_first=True)
    assert np.abs(np.sum(change[:, head] * expected, axis=-1)) == pytest.approx(1.0, abs=1e-12)
    assert rotation_angle(np.delete(change, head, axis=1)).max() < 1e-6
    assert new_places == pytest.approx(places, abs=1e-6)
    columns = np.flatnonzero(np.any(out.values != bvh.values, axis=0))
    assert list(columns) == [3 + 3 * head, 4 + 3 * head, 5 + 3 * head]  # the root has three position channels more


def test_a_way_is_carried_over_in_the_performers_size_and_heading() -> None:
    bvh = large_and_turned()
    found, result = opened(bvh)
    way = np.linspace(0.0, 0.1, len(result.motion))
    after = replace(result.motion, root_position=result.motion.root_position + way[:, None] * np.array([1.0, 0.0, 0.5]))
    out = to_performer_bvh(bvh, found, transfer_back(result, after))
    # 10 cm forward and 5 cm up at last: 14 cm along (cos 130, sin 130), which are the file's (z, x), and 7 cm along y
    expected = 14.0 * np.array([np.sin(np.radians(HEADING)), 0.5, np.cos(np.radians(HEADING))])
    assert (out.values - bvh.values)[-1, :3] == pytest.approx(expected, abs=1e-5)
    assert np.array_equal(out.values[:, 3:], bvh.values[:, 3:])
    assert np.array_equal(out.values[0], bvh.values[0])


def test_a_clip_that_begins_elsewhere_is_put_where_it_began() -> None:
    bvh = large_and_turned()
    found, result = opened(bvh)
    after = replace(result.motion, root_position=result.motion.root_position + np.array([0.5, -0.3, 0.1]))
    out = to_performer_bvh(bvh, found, transfer_back(result, after))
    assert (out.values - bvh.values)[:, :3] == pytest.approx(np.tile([0.0, 14.0, 0.0], (len(bvh.values), 1)), abs=1e-5)


@pytest.mark.parametrize("moving", [False, True])
def test_of_two_joints_with_places_the_one_that_moves_is_moved(moving: bool) -> None:
    bvh = with_joint_above(large_and_turned(), moving)
    found, result = opened(bvh)
    way = np.linspace(0.0, 0.1, len(result.motion))[:, None] * np.array([0.0, 0.0, 1.0])
    out = to_performer_bvh(bvh, found, transfer_back(result, replace(result.motion, root_position=result.motion.root_position + way)))
    columns = set(np.flatnonzero(np.any(out.values != bvh.values, axis=0)))
    assert columns <= ({0, 1, 2} if moving else {6, 7, 8})
    lifted = (file_world(out)[0] - file_world(bvh)[0])[-1, 1:]  # [cm], 1.4 times ours
    assert lifted == pytest.approx(np.tile([0.0, 14.0, 0.0], (len(lifted), 1)), abs=1e-5)


@pytest.mark.parametrize("above", [None, False, True], ids=["hips", "root-above", "moving-root-above"])
def test_the_ground_is_put_on_zero(above: bool | None) -> None:
    bvh = as_bvh(posed({}, height=STANDING + 2.5))
    bvh = bvh if above is None else with_joint_above(bvh, above)
    _, result = opened(bvh)
    assert result.ground == pytest.approx(2.5, abs=1e-6 if above is None else 0.2)  # under a root that leans by 20 degrees
    moved = file_world(to_zero_ground(bvh, result))[0] - file_world(bvh)[0]
    assert moved == pytest.approx(np.tile([0.0, -100.0 * result.ground, 0.0], (*moved.shape[:2], 1)), abs=1e-5)


def test_the_ground_is_put_on_zero_below_a_turned_root_without_places_and_before_the_motion() -> None:
    """The root above the hips is turned by 90 degrees about Z, so that the world's Y is the hips' X."""
    whole = with_joint_above(as_bvh(posed({}, frames=60, height=STANDING - 0.4)), moving=False)
    values = whole.values[:, 3:].copy()
    values[:, :3] = (90.0, 0.0, 0.0)
    values[:, 3:6] = np.stack([values[:, 4], -values[:, 3], values[:, 5]], axis=1)
    values[:, 6:9] = (-90.0, 0.0, 0.0)
    values[0, 9 + 3 * whole.names.index("LeftArm") - 6] += 90.0  # jumps into the motion
    bvh = replace(whole, channels=(whole.channels[0][3:], *whole.channels[1:]), values=values)
    _, result = opened(bvh)
    assert result.ground == pytest.approx(-0.4)
    moved = file_world(to_zero_ground(bvh, result))[0] - file_world(bvh)[0]
    assert moved[:, 1:] == pytest.approx(np.tile([0.0, 40.0, 0.0], (60, moved.shape[1] - 1, 1)), abs=1e-5)


def test_on_zero_ground_places_below_the_root_keep_their_very_numbers() -> None:
    """Only the root's height changes, not the eight decimals of a bone that the file places in its parent's frame."""
    bvh = as_bvh(posed({}, height=STANDING + 2.5))
    joint = bvh.names.index("LeftHand")
    channels = tuple((*bvh.channels[0][:3], *own) if one == joint else own for one, own in enumerate(bvh.channels))
    column = sum(map(len, channels[:joint]))
    placed = np.insert(bvh.values, [column] * 3, bvh.offsets[joint] + 1.23e-6, axis=1)
    bvh = replace(bvh, channels=channels, values=placed)
    _, result = opened(bvh)
    out = to_zero_ground(bvh, result)
    assert set(np.flatnonzero(np.any(out.values != bvh.values, axis=0))) == {1}
    assert out.values[:, 1] == pytest.approx(bvh.values[:, 1] - 250.0, abs=1e-3)


@pytest.mark.parametrize("axes", [np.diag([1.0, -1.0, -1.0]), np.diag([-1.0, 1.0, 1.0])], ids=["y-down", "mirrored"])
def test_a_file_with_other_axes_keeps_them(axes: np.ndarray) -> None:
    """10 cm more height are 10 cm along the file's own up axis, and a hand that rises to the left does so in the file's own way."""
    mirrored = bool(np.linalg.det(axes) < 0.0)
    straight, other = as_bvh(lively()), in_axes(as_bvh(lively()), axes)
    written = []
    for bvh, reading in ((straight, ReadingOptions()), (other, ReadingOptions(mirror=mirrored))):
        clip = performer_clip_from_bvh(bvh, "clip", reading)
        result = retarget(clip)
        rising = turned(result.motion, "hand_l", (1.0, 0.0, 0.0), 30.0)
        rising = replace(rising, root_position=rising.root_position + np.linspace(0.0, 0.1, len(rising))[:, None] * (0.0, 0.0, 1.0))
        out = to_performer_bvh(bvh, clip, transfer_back(result, rising))
        assert (out.names, out.frame_time) == (bvh.names, bvh.frame_time)
        written.append(file_world(out)[0])
        np.testing.assert_allclose(from_performer_bvh(out, clip).local_rotations.shape, clip.motion.local_rotations.shape)
    np.testing.assert_allclose(written[1], written[0] @ axes.T, atol=1e-3)  # [cm]
    assert np.abs(written[0] - file_world(straight)[0]).max() > 9.0


def test_a_rate_that_was_said_is_written() -> None:
    bvh = as_bvh(posed({}))
    clip = performer_clip_from_bvh(bvh, "clip", ReadingOptions(fps=24.0))
    assert to_performer_bvh(bvh, clip, clip.motion).frame_time == pytest.approx(1.0 / 24.0)


def test_a_file_that_cannot_hold_a_place_is_refused() -> None:
    bvh = as_bvh(lively())
    pinned = replace(bvh, channels=(bvh.channels[0][3:], *bvh.channels[1:]), values=bvh.values[:, 3:])
    _, result = opened(pinned)
    with pytest.raises(InputError, match="neither 'Hips' nor a joint above it has position channels"):
        transfer_back(result, result.motion)


def test_knees_of_other_proportions_bend_as_far_as_the_ankles_need() -> None:
    """Hips come down by 5 cm with the feet where they were.

    The performer's thigh is 0.8 and his shin 1.2 times ours: a = 0.336 and b = 0.492 m, and the scale 0.83 / 0.828. With his thigh 15
    degrees ahead of the vertical and his shin 15 degrees behind, his ankle is at ((a - b) sin 15, -(a + b) cos 15) from his hip.
    """
    pose = {f"{limb}_{side}_y": degrees for side in "lr" for limb, degrees in (("thigh", -15.0), ("shin", 30.0), ("foot", -15.0))}
    bvh = as_bvh(posed(pose))
    offsets = bvh.offsets.copy()
    for joint, factor in {"LeftLeg": 0.8, "LeftFoot": 1.2, "RightLeg": 0.8, "RightFoot": 1.2}.items():
        offsets[bvh.names.index(joint)] *= factor
    found, result = opened(replace(bvh, offsets=offsets))
    motion = transfer_back(result, lowered(result.motion))
    (old, rotations), (new, turned_to) = joint_poses(found.motion), joint_poses(motion)
    a, b, scale, lean = 0.336, 0.492, 0.83 / 0.828, np.radians(15.0)
    x, z = (a - b) * np.sin(lean), -(a + b) * np.cos(lean) + 0.05 / scale
    cosine = (x**2 + z**2 - a**2 - b**2) / (2 * a * b)  # of the knee's bend, by the law of cosines
    for side in ("Left", "Right"):
        hip, knee, ankle = (found.motion.skeleton.index(side + joint) for joint in ("UpLeg", "Leg", "Foot"))
        assert new[:, ankle] == pytest.approx(old[:, ankle], abs=1e-9)
        assert turned_to[:, ankle] == pytest.approx(rotations[:, ankle], abs=1e-9)
        assert new[:, hip] == pytest.approx(old[:, hip] - np.array([0.0, 0.0, 0.05 / scale]), abs=1e-9)
        upper, lower = (new[:, knee] - new[:, hip]) / a, (new[:, ankle] - new[:, knee]) / b
        assert np.sum(upper * lower, axis=-1) == pytest.approx(cosine, abs=1e-9)
        assert np.all(upper[:, 0] > np.sin(lean))  # the knee points forward


def test_frames_before_the_motion_stay_and_the_file_keeps_its_form() -> None:
    arms_down = posed({"upper_arm_l_x": -70.0, "upper_arm_r_x": 70.0, "shin_l_y": 20.0}, frames=60)
    bvh = as_bvh(arms_down)
    values = bvh.values.copy()
    values[0] = as_bvh(posed({})).values[0]
    bvh = replace(bvh, values=values)
    found, result = opened(bvh)
    assert found.dropped_frames == 1
    out = to_performer_bvh(bvh, found, transfer_back(result, turned(result.motion, "head", (0.0, 0.0, 1.0), 30.0)))
    head = 3 + 3 * bvh.names.index("Head")
    assert np.array_equal(out.values[0], bvh.values[0])
    assert np.all(np.any(out.values[1:, head : head + 3] != bvh.values[1:, head : head + 3], axis=1))
    same = ("names", "parents", "channels", "end_sites", "frame_time")
    assert [getattr(out, field) for field in same] == [getattr(bvh, field) for field in same]
    assert np.array_equal(out.offsets, bvh.offsets)
    with pytest.raises(ValueError, match=r"frames and joints are \(58, .* should be \(59"):
        shorter = {field: getattr(found.motion, field)[1:] for field in ("local_positions", "local_rotations")}
        to_performer_bvh(bvh, found, replace(found.motion, **shorter))


def test_the_file_says_what_was_written_and_a_hinge_only_what_it_can() -> None:
    # A head that only turns about the file's Z, our x: of 30 degrees about that everything comes through, of 30 about our z nothing.
    bvh = as_bvh(posed({}))
    head = bvh.names.index("Head")
    channels = tuple(("Zrotation",) if joint == head else own for joint, own in enumerate(bvh.channels))
    hinged = replace(bvh, channels=channels, values=np.delete(bvh.values, [4 + 3 * head, 5 + 3 * head], axis=1))
    found, result = opened(hinged)
    for axis, degrees in (((1.0, 0.0, 0.0), 30.0), ((0.0, 0.0, 1.0), 0.0)):
        said = from_performer_bvh(to_performer_bvh(hinged, found, transfer_back(result, turned(result.motion, "head", axis, 30.0))), found)
        assert np.degrees(rotation_angle(said.local_rotations[:, head])) == pytest.approx(degrees, abs=1e-5)
        assert said.local_positions == pytest.approx(found.motion.local_positions, abs=1e-12)


def test_other_frames_or_another_rate_are_refused() -> None:
    _, result = opened(large_and_turned())
    with pytest.raises(ValueError, match=r"119 frames at 60 fps, should be 120"):
        transfer_back(result, result.motion.cut(1, 120))
    with pytest.raises(ValueError, match="at 30 fps"):
        transfer_back(result, replace(result.motion, fps=30.0))


def check_in_another_reader(path: Path, bvh: Bvh) -> None:
    """Check that a program that is not ours finds in a file what it shall say."""
    with catch_warnings(action="ignore", category=PendingDeprecationWarning):  # of PyGLM, at bvhio's way to import it
        import bvhio

    clip = bvhio.readAsBvh(str(path))
    joints = [joint for joint, _, _ in clip.Root.layout()]
    assert (clip.FrameCount, clip.FrameTime) == (len(bvh.values), bvh.frame_time)
    assert tuple(joint.Name for joint in joints) == bvh.names
    assert tuple(tuple(joint.Channels) for joint in joints) == bvh.channels
    last = [joint.Keyframes[-1] for joint in joints]
    assert np.array([frame.Position.to_tuple() for frame in last])[0] == pytest.approx(bvh.values[-1, :3], rel=1e-5)
    turns = np.array([frame.Rotation.to_tuple() for frame in last])
    assert np.abs(np.sum(turns * local_pose(bvh)[1][-1], axis=-1)) == pytest.approx(1.0, abs=1e-5)


def crouched_and_twisted(motion: BodyMotion) -> BodyMotion:
    """Return the clip with a root 5 cm lower, knees bent so that ankles stay, chest turned by 10 degrees, right upper arm by 15."""
    low = lowered(motion)
    local = low.local_rotations.copy()
    for body, axis, degrees in (("chest", (0.0, 0.0, 1.0), 10.0), ("upper_arm_r", (1.0, 0.0, 0.0), 15.0)):
        index = BODY_NAMES.index(body)
        turn = from_axis_angle(np.array(axis), np.array(np.radians(degrees)))
        local[:, index] = multiply(local[:, index], np.broadcast_to(turn, (len(low), 4)))
    return replace(low, local_rotations=local)


@pytest.mark.shared_data
@pytest.mark.parametrize("file", FAMILIES)
def test_real_skeletons_there_and_back(shared_data: Path, file: str, tmp_path: Path) -> None:
    """Measured: nothing moves by itself; a change comes through within 4.3 mm at the feet, 0.1 to 1.5 mm and 1.1 degrees on average.

    The rest is performers' legs that bend to the side: there the plane in which ours bend is a compromise, and changes with the bend.
    """
    bvh = read_bvh(shared_data / f"{file}.bvh")
    found, result = opened(bvh)
    kept = np.ones(len(bvh.values), dtype=bool)
    for one in found.damage:  # an arm that flips in five frames of one of the clips
        kept[one.start : one.stop] = False
    assert kept.mean() > 0.99
    assert np.array_equal(to_performer_bvh(bvh, found, transfer_back(result, result.motion)).values[kept], bvh.values[kept])
    after = crouched_and_twisted(result.motion)
    motion = transfer_back(result, after)
    out = to_performer_bvh(bvh, found, motion)
    write_bvh(tmp_path / "out.bvh", out)
    check_in_another_reader(tmp_path / "out.bvh", out)
    (wanted, turns), (places, came) = body_poses(after), body_poses(retarget_with(result, from_performer_bvh(out, found)))
    off, turn = 1e3 * np.linalg.norm(places - wanted, axis=-1), np.degrees(rotation_angle(multiply(conjugate(turns), came)))
    print(f"{file}: {off.mean():.2f} mm, {off.max():.1f} at most, {turn.mean():.2f} degrees, {turn.max():.1f} at most")
    assert off[:, [foot for foot, _ in FOOT_AND_TOE_BODIES]].max() < 5.0
    assert off.mean() < 2.0
    assert turn.mean() < 1.5
    torso = [BODY_NAMES.index(body) for body in ("pelvis", "chest", "head", "foot_l", "foot_r") if body in found.joint_map]
    assert turn[:, torso].max() < 1e-3
