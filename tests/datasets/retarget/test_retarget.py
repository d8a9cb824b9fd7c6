"""Retargeting: the same motion comes out whatever the conventions of the skeleton."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.formats.bvh import Bvh
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, hinge_angles, rotations_from_hinges
from datasets.motion.kinematics import body_poses, lowest_point_heights
from datasets.motion.rotation import conjugate, multiply, rotate, rotation_angle
from datasets.performer.performer_clip import load_performer_clip, performer_clip_from_bvh
from datasets.retarget.retarget import Retargeted, retarget
from datasets.retarget.retarget_error import measure_retarget
from tests.builders import STANDING, as_bvh, hinge, lively, posed


def _turned(limbs: tuple[str, ...], axis: str, degrees_left: float, degrees_right: float) -> dict[str, Rotation]:
    """Return frames of both sides' limbs turned about one axis."""
    sides = {"l": degrees_left, "r": degrees_right}
    return {f"{limb}_{side}": Rotation.from_euler(axis, angle, degrees=True) for limb in limbs for side, angle in sides.items()}


# Frames as rigs without a human rest pose have them: x along the bone, which is down in legs, sideways in arms, up in the torso
ALONG_BONES = {
    **dict.fromkeys(("pelvis", "spine", "chest", "head"), Rotation.from_euler("y", -90, degrees=True)),
    **_turned(("thigh", "shin"), "y", 90, 90),
    **_turned(("foot", "toe"), "y", 40, 40),
    **_turned(("collar", "upper_arm", "forearm", "hand"), "z", 90, -90),
}
# Rest poses with arms, or arms and collars, where no T-pose has them, or with bent knees or a bent back
ODD_REST_POSES = {
    "arms down": _turned(("collar", "upper_arm", "forearm", "hand"), "x", -90, 90),
    "arms forward": _turned(("collar", "upper_arm", "forearm", "hand"), "z", -90, 90),
    "arms up": _turned(("collar", "upper_arm", "forearm", "hand"), "x", 90, -90),
    "A-pose": _turned(("collar", "upper_arm", "forearm", "hand"), "x", -45, 45),
    "A-pose of arms alone": _turned(("upper_arm", "forearm", "hand"), "x", -45, 45),
    "N-pose of arms alone": _turned(("upper_arm", "forearm", "hand"), "x", -90, 90),
    "knees bent": _turned(("thigh",), "y", -40, -40) | _turned(("shin",), "y", 50, 50),
    "arms down, knees bent": _turned(("collar", "upper_arm", "forearm", "hand"), "x", -90, 90) | _turned(("thigh",), "y", -60, -60),
    "stooped": {"chest": Rotation.from_euler("y", 80, degrees=True)},
}
SPLAYED = _turned(("thigh", "shin"), "x", -20, 20)  # as CMU's: the zero pose has the legs splayed


def retargeted(bvh: Bvh) -> Retargeted:
    return retarget(performer_clip_from_bvh(bvh, "clip"))


def largest_turn(a: np.ndarray, b: np.ndarray) -> float:
    """Return the largest angle [rad] between rotations of the same shape."""
    return float(rotation_angle(multiply(conjugate(a), b)).max())


@pytest.mark.parametrize("frames", [{}, SPLAYED, ALONG_BONES], ids=["t-pose", "splayed", "along-bones"])
@pytest.mark.parametrize(("unit", "up"), [(0.01, "y"), (0.056444, "z")])
def test_our_own_skeleton_in_any_fashion_gives_the_same_motion(frames: dict[str, Rotation], unit: float, up: str) -> None:
    clip = lively()
    result = retargeted(as_bvh(clip, unit, up, frames))
    assert result.scale == pytest.approx(1.0)
    assert result.lift == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(result.motion.root_position, clip.root_position, atol=1e-6)
    assert largest_turn(result.motion.local_rotations, clip.local_rotations) < 1e-4
    assert result.calibration.rest_is_human == (frames is not ALONG_BONES)


def test_toes_of_longer_feet_are_farther_from_the_ankle() -> None:
    """Toes of a performer whose feet are a fifth longer than the humanoid's, at half its size, in a file in cm."""
    bvh = as_bvh(lively(), unit=0.02, frames=ALONG_BONES)
    toes = [bvh.names.index(f"{side}ToeBase") for side in ("Left", "Right")]
    longer = bvh.offsets.copy()
    longer[toes] *= 1.2
    found = retargeted(replace(bvh, offsets=longer)).motion.toe_offsets
    assert found == pytest.approx(1.2 * np.array([[0.13, 0.0, -0.06]] * 2), abs=1e-6)
    assert retargeted(as_bvh(lively(), without=("toe_l",))).motion.toe_offsets is None


def strolling() -> BodyMotion:
    """Return somebody who strolls and swings arms and knees; spine and collars hardly move, and on average not at all."""
    frames = 120
    wave = np.sin(2 * np.pi * np.arange(frames) / 60.0)
    clip = posed({}, frames)
    hinges = np.zeros((frames, 43))
    for side, sign in (("l", 1.0), ("r", -1.0)):
        hinges[:, hinge(f"upper_arm_{side}_x")] = sign * (-1.1 + 0.2 * wave)
        hinges[:, hinge(f"forearm_{side}_z")] = -sign * (0.5 + 0.3 * wave)
        hinges[:, hinge(f"thigh_{side}_y")] = sign * 0.3 * wave
        hinges[:, hinge(f"shin_{side}_y")] = 0.5 + 0.3 * wave
        hinges[:, hinge(f"collar_{side}_z")] = 0.05 * wave
    return replace(clip, local_rotations=rotations_from_hinges(clip.local_rotations[:, 0], hinges))


def farthest_with_rest_pose(frames: dict[str, Rotation]) -> np.ndarray:
    """Return how far [m] each body is at most from where it should be, from the pelvis, in a file with this rest pose, shape (20,)."""
    clip = strolling()
    expected, _ = body_poses(clip)
    found, _ = body_poses(retargeted(as_bvh(clip, frames=frames)).motion)
    return np.linalg.norm((found - found[:, :1]) - (expected - expected[:, :1]), axis=-1).max(axis=0)


@pytest.mark.parametrize("name", ODD_REST_POSES)
def test_the_same_bodies_to_a_centimetre_whatever_the_rest_pose(name: str) -> None:
    assert farthest_with_rest_pose(ODD_REST_POSES[name]).max() < 0.01


def test_a_frame_of_a_motion_as_rest_pose_does_not_bend_the_trunk() -> None:
    """As in FBX files without a skin: a figure that bends over by 40 degrees in mid-stride.

    Calibration takes the line from hips to spine to lean back by 7 degrees, which here is upright, so that the pelvis is 7 degrees off: the
    spine, 0.1 m above it, and all above that by 0.1 m sin 7 = 12.2 mm, the hips, 0.03 m below it, by 3.7 mm. Nobody stands: toes are
    unknown. Believed, that rest pose would move the head by 40 degrees of 0.27 m.
    """
    forward = Rotation.from_euler("y", 40, degrees=True)
    stride = {body: forward for body in ("chest", "head", "collar_l", "collar_r", "upper_arm_l", "forearm_l", "hand_l")}
    stride |= {body: forward * Rotation.from_euler("x", 70, degrees=True) for body in ("upper_arm_r", "forearm_r", "hand_r")}
    stride |= {"thigh_l": Rotation.from_euler("y", -40, degrees=True), "shin_r": Rotation.from_euler("y", 50, degrees=True)}
    farthest = farthest_with_rest_pose(stride)
    above = [index for index, body in enumerate(BODY_NAMES) if not body.startswith(("pelvis", "thigh", "shin", "foot", "toe"))]
    below = [index for index, body in enumerate(BODY_NAMES) if body.startswith(("thigh", "shin", "foot"))]
    np.testing.assert_allclose(farthest[above], 0.0122, atol=0.001)
    np.testing.assert_allclose(farthest[below], 0.0037, atol=0.001)


def test_every_frame_is_one_that_the_hinges_can_take() -> None:
    motion = retargeted(as_bvh(lively(seed=3))).motion
    again = rotations_from_hinges(motion.local_rotations[:, 0], hinge_angles(motion.local_rotations))
    same = np.abs(np.sum(again * motion.local_rotations, axis=-1))
    np.testing.assert_allclose(same, 1.0, atol=1e-9)


def test_size_place_and_heading_do_not_matter_and_can_be_undone() -> None:
    clip = lively()
    turn = Rotation.from_euler("z", 130, degrees=True)
    local = clip.local_rotations.copy()
    local[:, 0] = (turn * Rotation.from_quat(local[:, 0], scalar_first=True)).as_quat(scalar_first=True)
    root = turn.apply(clip.root_position.copy()) + np.array([3.0, -2.0, 0.5])
    moved = BodyMotion(1.4 * root, local, clip.fps, "moved")
    bvh = as_bvh(moved)
    larger = replace(bvh, offsets=1.4 * bvh.offsets)
    result = retargeted(larger)
    np.testing.assert_allclose(result.motion.root_position, clip.root_position, atol=1e-6)
    assert largest_turn(result.motion.local_rotations, clip.local_rotations) < 1e-4
    # 1 / 1.4 of the size; the pelvis began at (3, -2) in our size, 0.5 m too high, heading 130 degrees
    assert result.scale == pytest.approx(1 / 1.4)
    np.testing.assert_allclose(result.origin, (3.0, -2.0), atol=1e-6)
    assert result.yaw == pytest.approx(np.radians(130))
    assert result.lift == pytest.approx(-0.5, abs=1e-6)
    np.testing.assert_allclose(result.to_humanoid_world(moved.root_position), result.motion.root_position, atol=1e-6)


def test_directions_of_limbs_are_the_performers_when_proportions_differ() -> None:
    bvh = as_bvh(lively(seed=5))
    offsets = bvh.offsets.copy()
    for joint, factor in {"LeftLeg": 0.8, "LeftFoot": 1.2, "RightLeg": 0.8, "RightFoot": 1.2, "LeftForeArm": 1.3, "RightHand": 0.7}.items():
        offsets[bvh.names.index(joint)] *= factor
    result = retargeted(replace(bvh, offsets=offsets))
    ours, _ = body_poses(result.motion)
    motion = result.performer_clip.motion
    theirs, _ = body_poses(lively(seed=5))
    bent = np.abs(hinge_angles(result.motion.local_rotations)[:, hinge("shin_l_y")]) > np.radians(50)
    assert bent.sum() > 20
    for upper, lower in (("upper_arm_l", "forearm_l"), ("forearm_l", "hand_l"), ("upper_arm_r", "forearm_r"), ("forearm_r", "hand_r")):
        a, b = BODY_NAMES.index(upper), BODY_NAMES.index(lower)
        np.testing.assert_allclose(_unit(ours[:, b] - ours[:, a])[bent], _unit(theirs[:, b] - theirs[:, a])[bent], atol=1e-4)
    # thigh 0.8 x 0.42 and shin 1.2 x 0.41 are 0.828 m of leg; ankles stay where the performer's are, but for that different knee
    assert result.scale == pytest.approx(0.83 / 0.828)
    errors = measure_retarget(result).error_local
    assert errors[[BODY_NAMES.index("foot_l"), BODY_NAMES.index("foot_r")]].max() < 0.005
    assert len(motion) == len(result.motion)


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def test_knees_bend_backward_and_elbows_forward() -> None:
    bends = {"shin_l_y": 60.0, "shin_r_y": 60.0, "forearm_l_z": -90.0, "forearm_r_z": 90.0}
    result = retargeted(as_bvh(posed(bends | {"thigh_l_y": -30.0, "thigh_r_y": -30.0})))
    angles = np.degrees(hinge_angles(result.motion.local_rotations))[0]
    assert {name: angles[hinge(name)] for name in bends} == pytest.approx(bends, abs=0.1)


def test_a_straight_knee_keeps_the_twist_of_its_thigh_although_noise_bends_it_anyhow() -> None:
    rng = np.random.default_rng(0)
    clip = lively()
    bvh = as_bvh(posed({}, frames=len(clip)))
    values = bvh.values.copy()
    column = {name: 3 + 3 * joint for joint, name in enumerate(bvh.names)}  # of each joint's first rotation
    knee = column["LeftLeg"]
    values[:, knee : knee + 3] += rng.normal(0.0, 1.0, (len(values), 3))  # one degree
    result = retargeted(replace(bvh, values=values))
    thigh = result.motion.local_rotations[:, BODY_NAMES.index("thigh_l")]
    twist = np.degrees(2 * np.arctan2(thigh[:, 3], thigh[:, 0]))  # about its bone, which is z
    assert np.abs(twist).max() < 1.0


def test_without_toe_joints_the_toe_is_in_line_with_the_foot() -> None:
    clip = lively()
    result = retargeted(as_bvh(clip, without=("toe_l", "toe_r")))
    assert largest_turn(result.motion.local_rotations, clip.local_rotations) < 1e-4


def test_a_toe_gives_way_to_the_ground() -> None:
    """Heels raised by 30 degrees after standing: the balls stay on the ground, so the toes must bend up by 30 degrees.

    The ball's underside is 0.13 m ahead of and 0.08 m below the ankle, so the ankle rises from 0.08 m by
    0.13 sin 30 + 0.08 cos 30 - 0.08 = 0.0543 m.
    """
    standing, raised = posed({}, 60), posed({"foot_l_y": 30.0, "foot_r_y": 30.0}, 60, STANDING + 0.0543)
    root = np.concatenate([standing.root_position, raised.root_position])
    root[60:, 0] = np.linspace(0, 4, 60)  # too fast to be taken for standing
    clip = BodyMotion(root, np.concatenate([standing.local_rotations, raised.local_rotations]), 60.0, "raised")
    result = retargeted(as_bvh(clip))
    angles = np.degrees(hinge_angles(result.motion.local_rotations))
    np.testing.assert_allclose(angles[:58, hinge("toe_l_y")], 0.0, atol=0.1)
    np.testing.assert_allclose(angles[62:, hinge("toe_l_y")], -30.0, atol=0.2)
    # the toe's joint is 0.02 m above the ball's underside, along the tilted foot: 0.02 (cos 30 - 1)
    assert lowest_point_heights(*body_poses(result.motion))[62:].min() == pytest.approx(-0.0027, abs=1e-4)


def test_a_file_whose_hips_never_move_has_no_root() -> None:
    # Ours is moved about the file's hips as they turn, so it is the file that has to tell.
    moving = lively()
    assert retarget(performer_clip_from_bvh(as_bvh(moving), "moving")).motion.rooted
    pinned = replace(moving, root_position=np.tile([0.3, 0.2, 0.9], (len(moving), 1)))
    assert not retarget(performer_clip_from_bvh(as_bvh(pinned), "pinned")).motion.rooted


def kicking(pitch: float, height: float, angles: tuple[float, float]) -> BodyMotion:
    """Return two seconds of a figure with a still pelvis, pitched [degrees] at a height [m], whose thighs swing to angles and back."""
    swing = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(120) / 120)
    clips = [posed({"thigh_l_y": angles[0] * one, "thigh_r_y": angles[1] * one}, 1, height) for one in swing]
    local = np.concatenate([clip.local_rotations for clip in clips])
    local[:, 0] = Rotation.from_euler("Y", pitch, degrees=True).as_quat(scalar_first=True)
    return BodyMotion(np.tile([0.0, 0.0, height], (120, 1)), local, 60.0, "kicking")


@pytest.mark.parametrize(
    ("pitch", "angles", "rooted"),
    [
        (-90.0, (-30.0, -30.0), True),  # on the back, where the legs may do as they like
        (0.0, (-30.0, 0.0), True),  # on one leg
        (0.0, (-30.0, 30.0), False),  # as in walking, where one foot would have to stay in its place
    ],
)
def test_a_pelvis_that_keeps_still_by_right_was_recorded(pitch: float, angles: tuple[float, float], rooted: bool) -> None:
    clip = kicking(pitch, 0.1 if pitch else STANDING, angles)
    assert retarget(performer_clip_from_bvh(as_bvh(clip), "kicking")).motion.rooted is rooted


def test_the_ground_is_under_who_lies_with_feet_in_the_air() -> None:
    """On the back, 0.1 m under the pelvis' origin; straight legs of 0.83 m are raised by 20 degrees, and keep the feet 0.28 m higher."""
    clip = kicking(-90.0, 0.1, (0.0, 0.0))
    raised = posed({"thigh_l_y": -20.0, "thigh_r_y": -20.0}, 1).local_rotations
    local = np.repeat(raised, len(clip), axis=0)
    local[:, 0] = clip.local_rotations[:, 0]
    result = retargeted(as_bvh(replace(clip, local_rotations=local)))
    assert result.ground == pytest.approx(0.0, abs=0.03)


def test_the_ground_is_under_the_standing_feet() -> None:
    sunk = posed({}, height=STANDING - 0.11)
    result = retargeted(as_bvh(sunk))
    assert result.lift == pytest.approx(0.11, abs=1e-6)
    np.testing.assert_allclose(result.motion.root_position[:, 2], STANDING, atol=1e-6)


def test_soles_are_level_although_the_rest_pose_has_them_tilted() -> None:
    tilted = {f"foot_{side}": Rotation.from_euler("xy", [10, 25], degrees=True) for side in "lr"}
    result = retargeted(as_bvh(posed({}), frames=tilted))
    _, rotations = body_poses(result.motion)
    up = rotate(rotations[:, BODY_NAMES.index("foot_l")], np.broadcast_to((0.0, 0.0, 1.0), (len(rotations), 3)))
    np.testing.assert_allclose(up[:, 2], 1.0, atol=1e-9)


def test_a_foot_without_toe_or_end_site_points_where_the_hips_do() -> None:
    bvh = as_bvh(posed({}), without=("toe_l", "toe_r"))
    result = retargeted(replace(bvh, end_sites=((),) * len(bvh.names)))
    assert largest_turn(result.motion.local_rotations, posed({}).local_rotations) < 1e-6


@pytest.mark.shared_data
@pytest.mark.parametrize(
    "file",
    ["cmu/train/cmu_12_01.bvh", "cmu/train/cmu_16_12_60fps.bvh", "mit/imu/rokoko_jesse_dance.bvh", "gpl/imu/xsens_neura_S02_walk1.bvh"],
)
def test_real_performers_ankles_are_met_and_knees_bend_backward(shared_data: Path, file: str) -> None:
    result = retarget(load_performer_clip(shared_data / file))
    fidelity = measure_retarget(result)
    assert fidelity.error_local[[BODY_NAMES.index("foot_l"), BODY_NAMES.index("foot_r")]].max() < 0.01
    angles = np.degrees(hinge_angles(result.motion.local_rotations))
    assert np.percentile(angles[:, [hinge("shin_l_y"), hinge("shin_r_y")]], 1) > -10.0
