"""Trees of other forms than hips, spine and limbs from the hips up: read as a human's, and written back as they were."""

from collections.abc import Callable
from dataclasses import replace
from warnings import catch_warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.formats.bvh import Bvh
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, SKELETON
from datasets.motion.kinematics import body_poses, joint_poses
from datasets.motion.rotation import conjugate, from_axis_angle, multiply, rotate
from datasets.performer.performer_clip import PerformerClip, performer_clip_from_bvh
from datasets.performer.reading_options import ReadingOptions
from datasets.retarget.retarget import retarget, retarget_with
from datasets.retarget.transfer_back import from_performer_bvh, to_performer_bvh, transfer_back
from tests.builders import MIXAMO, as_bvh, lively, posed

OFFSETS = dict(zip(BODY_NAMES, SKELETON.offsets, strict=True))
FEET_AND_TOES = ("toe_l", "toe_r", "foot_l", "foot_r")


def from_segments(clip: BodyMotion, joints: list[tuple[str, str, str | None, np.ndarray]]) -> Bvh:
    """Return a clip as BVH in metres, Z up, on another tree.

    Args:
        clip: Clip on the 20 bodies.
        joints: Name, body that it rotates with, its parent's name, and its point in that body's frame, depth first.
    """
    places, turns = body_poses(clip)
    names = tuple(name for name, *_ in joints)
    parents = tuple(-1 if parent is None else names.index(parent) for _, _, parent, _ in joints)
    index = [BODY_NAMES.index(body) for _, body, _, _ in joints]
    points = np.stack(
        [places[:, b] + rotate(turns[:, b], np.tile(at, (len(clip), 1))) for b, (*_, at) in zip(index, joints, strict=True)], 1
    )
    offsets, values = [], [points[:, 0]]
    for joint, parent in enumerate(parents):
        over = turns[:, index[parent]] if parent >= 0 else np.tile([1.0, 0.0, 0.0, 0.0], (len(clip), 1))
        steps = rotate(conjugate(over), points[:, joint] - points[:, parent])
        offsets.append(steps[0] if parent >= 0 else np.zeros(3))
        assert parent < 0 or np.ptp(steps, axis=0).max() < 1e-9, "the tree has bones of constant length"
        with catch_warnings(action="ignore", category=UserWarning):
            local = Rotation.from_quat(multiply(conjugate(over), turns[:, index[joint]]), scalar_first=True)
            values.append(local.as_euler("ZXY", degrees=True))
    rotations = ("Zrotation", "Xrotation", "Yrotation")
    channels = (("Xposition", "Yposition", "Zposition", *rotations), *[rotations] * (len(joints) - 1))
    sites = tuple(() for _ in joints)
    return Bvh(names, parents, np.array(offsets), channels, sites, 1 / clip.fps, np.concat(values, axis=1))


NO_OFFSET = np.zeros(3)
Joints = list[tuple[str, str, str | None, np.ndarray]]


def legs(over: str) -> Joints:
    """Return the joints of both legs under a joint, each at the origin of its body."""
    return [
        joint
        for side, word in (("l", "Left"), ("r", "Right"))
        for joint in (
            (f"{word}UpLeg", f"thigh_{side}", over, NO_OFFSET),
            (f"{word}Leg", f"shin_{side}", f"{word}UpLeg", NO_OFFSET),
            (f"{word}Foot", f"foot_{side}", f"{word}Leg", NO_OFFSET),
        )
    ]


def arms(over: str) -> Joints:
    """Return the joints of both arms under a joint, each at the origin of its body."""
    return [
        joint
        for side, word in (("l", "Left"), ("r", "Right"))
        for joint in (
            (f"{word}Shoulder", f"collar_{side}", over, NO_OFFSET),
            (f"{word}Arm", f"upper_arm_{side}", f"{word}Shoulder", NO_OFFSET),
            (f"{word}ForeArm", f"forearm_{side}", f"{word}Arm", NO_OFFSET),
            (f"{word}Hand", f"hand_{side}", f"{word}ForeArm", NO_OFFSET),
        )
    ]


def hung_from_the_head(clip: BodyMotion) -> Bvh:
    """Return a clip whose root is the crown; each joint of the trunk is at the upper end of its bone, where the bone above ends."""
    return from_segments(
        clip,
        [
            ("HEAD", "head", None, np.array([0.0, 0.0, 0.2])),
            ("CHEST", "chest", "HEAD", OFFSETS["head"]),
            ("WAIST", "spine", "CHEST", OFFSETS["chest"]),
            ("HIP", "pelvis", "WAIST", OFFSETS["spine"]),
            *legs("HIP"),
            *arms("CHEST"),
        ],
    )


def hung_from_the_chest(clip: BodyMotion) -> Bvh:
    """Return a clip whose root is a point in the chest, from which the head goes up and the spine down."""
    return from_segments(
        clip,
        [
            ("Chest", "chest", None, np.array([0.05, 0.0, 0.1])),
            ("Head", "head", "Chest", NO_OFFSET),
            *arms("Chest"),
            ("Waist", "spine", "Chest", OFFSETS["chest"]),
            ("Hips", "pelvis", "Waist", OFFSETS["spine"]),
            *legs("Hips"),
        ],
    )


def pelvis_beside_the_spine(clip: BodyMotion) -> Bvh:
    """Return a clip in which a joint above the pelvis carries both pelvis and spine."""
    return from_segments(
        clip,
        [
            ("hip", "pelvis", None, np.array([0.0, 0.0, 0.05])),
            ("pelvis", "pelvis", "hip", NO_OFFSET),
            *legs("pelvis"),
            ("Spine", "spine", "hip", NO_OFFSET),
            ("Spine1", "chest", "Spine", NO_OFFSET),
            ("Head", "head", "Spine1", NO_OFFSET),
            *arms("Spine1"),
        ],
    )


def hips_at_one_point(clip: BodyMotion) -> Bvh:
    bvh = as_bvh(clip)
    offsets = bvh.offsets.copy()
    offsets[[bvh.names.index("LeftUpLeg"), bvh.names.index("RightUpLeg")], 0] = 0.0  # x is to the left in a Y-up file
    return replace(bvh, offsets=offsets)


def without_head(clip: BodyMotion) -> Bvh:
    return as_bvh(clip, without=("head",))


def without_hands(clip: BodyMotion) -> Bvh:
    return as_bvh(clip, without=("hand_l", "hand_r"))


def without_feet(clip: BodyMotion) -> Bvh:
    return as_bvh(clip, without=FEET_AND_TOES)


FORMS = [hung_from_the_head, hung_from_the_chest, pelvis_beside_the_spine, hips_at_one_point, without_head, without_hands, without_feet]


def opened(bvh: Bvh) -> PerformerClip:
    return performer_clip_from_bvh(bvh, "clip")


def joint_places(found: PerformerClip) -> dict[str, np.ndarray]:
    """Return the positions (T, 3) [m] of the joints by their bodies."""
    positions, _ = joint_poses(found.motion)
    return {body: positions[:, joint] for body, joint in found.joint_map.items()}


@pytest.mark.parametrize("form", FORMS)
def test_a_tree_of_another_form_is_read_as_the_same_clip(form: Callable[[BodyMotion], Bvh]) -> None:
    clip = lively()
    found = opened(form(clip))
    places, at = body_poses(clip)[0], joint_places(found)
    # the pelvis of a turned tree begins where the spine ends, its feet that lack are level, which moves no joint
    for body in found.joint_map.keys() - {"pelvis", *FEET_AND_TOES[:2]}:
        np.testing.assert_allclose(at[body], places[:, BODY_NAMES.index(body)], atol=2e-6, err_msg=body)


@pytest.mark.parametrize("form", FORMS)
def test_what_did_not_change_keeps_its_numbers_on_any_tree(form: Callable[[BodyMotion], Bvh]) -> None:
    bvh = form(lively())
    found = opened(bvh)
    result = retarget(found)
    written = to_performer_bvh(bvh, found, transfer_back(result, result.motion))
    assert np.array_equal(written.values, bvh.values)
    assert (written.names, written.parents, written.channels) == (bvh.names, bvh.parents, bvh.channels)


@pytest.mark.parametrize("form", FORMS)
def test_a_change_of_the_pelvis_is_in_the_file_on_any_tree(form: Callable[[BodyMotion], Bvh]) -> None:
    bvh = form(lively())
    found = opened(bvh)
    result = retarget(found)
    local, root = result.motion.local_rotations.copy(), result.motion.root_position.copy()
    lean = from_axis_angle(np.array([0.0, 1.0, 0.0]), np.array(np.radians(10.0)))
    local[:, 0] = multiply(local[:, 0], np.broadcast_to(lean, local[:, 0].shape))
    root[:, 2] += np.linspace(0.0, 0.05, len(root))
    after = replace(result.motion, local_rotations=local, root_position=root)
    said = retarget_with(result, from_performer_bvh(to_performer_bvh(bvh, found, transfer_back(result, after)), found))
    wanted, came = body_poses(after)[0], body_poses(said)[0]
    shoulders = [
        BODY_NAMES.index(body) for body in ("chest", "upper_arm_l", "upper_arm_r", "hand_l", "thigh_l", "shin_r", "foot_l", "foot_r")
    ]
    np.testing.assert_allclose(came[:, shoulders], wanted[:, shoulders], atol=5e-4)


def test_a_tree_hung_from_the_head_turns_only_the_head_when_the_head_turns() -> None:
    bvh = hung_from_the_head(lively())
    found = opened(bvh)
    result = retarget(found)
    local = result.motion.local_rotations.copy()
    head = BODY_NAMES.index("head")
    local[:, head] = multiply(
        local[:, head], np.broadcast_to(from_axis_angle(np.array([0.0, 0.0, 1.0]), np.array(0.5)), local[:, head].shape)
    )
    written = to_performer_bvh(bvh, found, transfer_back(result, replace(result.motion, local_rotations=local)))
    before, after = joint_places(found), joint_places(replace(found, motion=from_performer_bvh(written, found)))
    for body in found.joint_map:
        np.testing.assert_allclose(after[body], before[body], atol=1e-6)
    assert not np.array_equal(written.values[:, 3:6], bvh.values[:, 3:6])  # the root of the file is the head


@pytest.mark.parametrize(
    ("form", "notices"),
    [
        (hung_from_the_head, ["hangs from 'HEAD'; it is read as hanging from 'HIP'"]),
        (pelvis_beside_the_spine, []),
        (hips_at_one_point, ["Both hips are at one point"]),
        (without_head, ["no joint for head; put at a person's distance from Spine1"]),
        (without_hands, ["no joint for left hand, right hand; put at a person's distance from LeftForeArm, RightForeArm"]),
        (without_feet, ["no joint for left foot, right foot; put at a person's distance from LeftLeg, RightLeg"]),
        (lambda clip: as_bvh(clip, names=MIXAMO | {"head": "Neck"}), ["the head; 'Neck' was taken by its place"]),
    ],
)
def test_what_was_guessed_is_said(form: Callable[[BodyMotion], Bvh], notices: list[str]) -> None:
    said = opened(form(lively())).notices
    assert len(said) == len(notices)
    assert all(part in line for part, line in zip(notices, said, strict=True))


def test_an_end_site_is_where_the_hand_is_unless_it_is_a_mere_stub() -> None:
    bvh = without_hands(posed({}))
    joint = bvh.names.index("LeftForeArm")

    def hand_with_site(centimetres: float) -> np.ndarray:
        sites = tuple(((centimetres, 0.0, 0.0),) if index == joint else of for index, of in enumerate(bvh.end_sites))
        at = joint_places(opened(replace(bvh, end_sites=sites)))
        return at["hand_l"][0] - at["forearm_l"][0]

    np.testing.assert_allclose(hand_with_site(20.0), (0.0, 0.2, 0.0), atol=1e-9)  # x of the file is our y
    np.testing.assert_allclose(hand_with_site(2.0), (0.0, 0.25, 0.0), atol=1e-9)  # a person's forearm, of the upper arm's 28 cm


def test_feet_that_lack_stay_level_as_far_as_an_ankle_bends() -> None:
    found = opened(without_feet(posed({"thigh_l_y": -20.0, "shin_l_y": 40.0, "thigh_r_y": 60.0})))
    turns = joint_poses(found.motion)[1]
    up = {side: rotate(turns[0, found.joint_map[f"foot_{side}"]], np.array([0.0, 0.0, 1.0])) for side in "lr"}
    lean = {side: np.degrees(np.arccos(up[side][2])) for side in "lr"}
    assert lean["l"] == pytest.approx(0.0, abs=1e-6)  # the shin leans by 20 degrees
    assert lean["r"] == pytest.approx(25.0, abs=1e-6)  # by 60, of which an ankle takes 35


def test_hips_at_one_point_are_read_a_persons_width_apart() -> None:
    at = joint_places(opened(hips_at_one_point(posed({}))))
    np.testing.assert_allclose(at["thigh_l"][0] - at["thigh_r"][0], (0.0, 0.18, 0.0), atol=1e-9)


def test_on_a_turned_tree_a_bone_that_is_damaged_is_mended_in_the_file() -> None:
    """The file hangs from the head and places the joint below; in one frame that is 60 cm off, and so is all but the head."""
    whole = hung_from_the_head(posed({}, frames=60))
    below, first = whole.parents.index(0), len(whole.channels[0])
    assert below == 1
    channels = (whole.channels[0], (*whole.channels[0][:3], *whole.channels[1]), *whole.channels[2:])
    clean = replace(whole, channels=channels, values=np.insert(whole.values, [first] * 3, whole.offsets[1], axis=1))
    values = clean.values.copy()
    values[30, first] += 60.0
    damaged = replace(clean, values=values)
    found = performer_clip_from_bvh(damaged, "clip")
    assert [(one.start, one.stop, one.mended) for one in found.damage] == [(30, 31, True)]
    np.testing.assert_allclose(to_performer_bvh(damaged, found, found.motion).values, clean.values, atol=1e-5)


def test_a_mapping_is_followed_on_a_turned_tree() -> None:
    bvh = hung_from_the_head(lively())
    names = tuple({"HIP": "Bone4", "LeftForeArm": "Bone9"}.get(name, name) for name in bvh.names)
    found = performer_clip_from_bvh(replace(bvh, names=names), "clip", ReadingOptions({"pelvis": "Bone4", "forearm_l": "Bone9"}))
    assert found.motion.skeleton.names[found.joint_map["forearm_l"]] == "Bone9"
    assert found.motion.skeleton.parents[found.joint_map["pelvis"]] == -1
