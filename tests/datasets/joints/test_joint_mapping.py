"""Mapping of joints to bodies."""

import pytest

from configs.errors import InputError
from datasets.joints.joint_mapping import find_joint_map
from datasets.motion.humanoid import BODY_NAMES

# name and parent's name of each joint, one string a skeleton
FASHIONS = {
    "cmu": """Hips - LHipJoint Hips LeftUpLeg LHipJoint LeftLeg LeftUpLeg LeftFoot LeftLeg LeftToeBase LeftFoot
        RHipJoint Hips RightUpLeg RHipJoint RightLeg RightUpLeg RightFoot RightLeg RightToeBase RightFoot LowerBack Hips
        Spine LowerBack Spine1 Spine Neck Spine1 Neck1 Neck Head Neck1 LeftShoulder Spine1 LeftArm LeftShoulder
        LeftForeArm LeftArm LeftHand LeftForeArm LThumb LeftHand RightShoulder Spine1 RightArm RightShoulder
        RightForeArm RightArm RightHand RightForeArm""",
    "xsens": """Hips - Chest Hips Chest2 Chest Chest3 Chest2 Chest4 Chest3 Neck Chest4 Head Neck RightCollar Chest4
        RightShoulder RightCollar RightElbow RightShoulder RightWrist RightElbow LeftCollar Chest4 LeftShoulder LeftCollar
        LeftElbow LeftShoulder LeftWrist LeftElbow RightHip Hips RightKnee RightHip RightAnkle RightKnee RightToe RightAnkle
        LeftHip Hips LeftKnee LeftHip LeftAnkle LeftKnee LeftToe LeftAnkle""",
    "daz": """hip - abdomen hip chest abdomen neck chest head neck leftEye head rCollar chest rShldr rCollar rForeArm rShldr
        rHand rForeArm lCollar chest lShldr lCollar lForeArm lShldr lHand lForeArm rButtock hip rThigh rButtock rShin rThigh
        rFoot rShin lButtock hip lThigh lButtock lShin lThigh lFoot lShin""",
    "makehuman": """hip - abdomen hip chest abdomen neck chest head neck rcollar chest rshoulder rcollar relbow rshoulder
        rhand relbow lcollar chest lshoulder lcollar lelbow lshoulder lhand lelbow rbuttock hip rhip rbuttock rknee rhip
        rfoot rknee toe1-1.r rfoot lbuttock hip lhip lbuttock lknee lhip lfoot lknee toe1-1.l lfoot""",
    "bandai": """joint_Root - Hips joint_Root Spine Hips Chest Spine Neck Chest Head Neck Shoulder_L Chest UpperArm_L Shoulder_L
        LowerArm_L UpperArm_L Hand_L LowerArm_L Shoulder_R Chest UpperArm_R Shoulder_R LowerArm_R UpperArm_R Hand_R LowerArm_R
        UpperLeg_L Hips LowerLeg_L UpperLeg_L Foot_L LowerLeg_L Toes_L Foot_L UpperLeg_R Hips LowerLeg_R UpperLeg_R
        Foot_R LowerLeg_R Toes_R Foot_R""",
    "smpl": """Pelvis - L_Hip Pelvis L_Knee L_Hip L_Ankle L_Knee L_Foot L_Ankle R_Hip Pelvis R_Knee R_Hip R_Ankle R_Knee
        R_Foot R_Ankle Spine1 Pelvis Spine2 Spine1 Spine3 Spine2 Neck Spine3 Head Neck L_Collar Spine3 L_Shoulder L_Collar
        L_Elbow L_Shoulder L_Wrist L_Elbow L_Hand L_Wrist R_Collar Spine3 R_Shoulder R_Collar R_Elbow R_Shoulder
        R_Wrist R_Elbow R_Hand R_Wrist""",
}
# of the bodies in the order of the humanoid; - where there is no joint
EXPECTED = {
    "cmu": """Hips Spine Spine1 Head LeftShoulder LeftArm LeftForeArm LeftHand RightShoulder RightArm RightForeArm RightHand
        LeftUpLeg LeftLeg LeftFoot LeftToeBase RightUpLeg RightLeg RightFoot RightToeBase""",
    "xsens": """Hips Chest2 Chest4 Head LeftCollar LeftShoulder LeftElbow LeftWrist RightCollar RightShoulder RightElbow RightWrist
        LeftHip LeftKnee LeftAnkle LeftToe RightHip RightKnee RightAnkle RightToe""",
    "daz": """hip abdomen chest head lCollar lShldr lForeArm lHand rCollar rShldr rForeArm rHand
        lThigh lShin lFoot - rThigh rShin rFoot -""",
    "makehuman": """hip abdomen chest head lcollar lshoulder lelbow lhand rcollar rshoulder relbow rhand
        lhip lknee lfoot toe1-1.l rhip rknee rfoot toe1-1.r""",
    "bandai": """Hips Spine Chest Head Shoulder_L UpperArm_L LowerArm_L Hand_L Shoulder_R UpperArm_R LowerArm_R Hand_R
        UpperLeg_L LowerLeg_L Foot_L Toes_L UpperLeg_R LowerLeg_R Foot_R Toes_R""",
    "smpl": """Pelvis Spine2 Spine3 Head L_Collar L_Shoulder L_Elbow L_Wrist R_Collar R_Shoulder R_Elbow R_Wrist
        L_Hip L_Knee L_Ankle L_Foot R_Hip R_Knee R_Ankle R_Foot""",
}  # fmt: skip


def skeleton(fashion: str, prefix: str = "") -> tuple[tuple[str, ...], tuple[int, ...]]:
    words = FASHIONS[fashion].split()
    names = tuple(words[::2])
    parents = tuple(-1 if parent == "-" else names.index(parent) for parent in words[1::2])
    return tuple(prefix + name for name in names), parents


@pytest.mark.parametrize("fashion", FASHIONS)
def test_each_fashion_of_names_is_understood(fashion: str) -> None:
    names, parents = skeleton(fashion)
    roles = find_joint_map(names, parents)
    expected = {body: joint for body, joint in zip(BODY_NAMES, EXPECTED[fashion].split(), strict=True) if joint != "-"}
    assert {body: names[joint] for body, joint in roles.items()} == expected


def test_a_prefix_before_the_names_does_not_matter() -> None:
    for prefix in ("mixamorig:", "mixamorig"):
        names, parents = skeleton("cmu", prefix)
        assert find_joint_map(names, parents) == find_joint_map(*skeleton("cmu"))


def test_collars_that_hang_on_the_neck_leave_the_chest_below_it() -> None:
    words = FASHIONS["cmu"].replace("Shoulder Spine1", "Shoulder Neck")
    names = tuple(words.split()[::2])
    parents = tuple(-1 if parent == "-" else names.index(parent) for parent in words.split()[1::2])
    assert names[find_joint_map(names, parents)["chest"]] == "Spine1"


def test_what_is_missing_is_named_beside_what_there_is() -> None:
    names, parents = skeleton("cmu")
    names = tuple(name.replace("LeftForeArm", "Bone7") for name in names)
    with pytest.raises(InputError, match=r"forearm_l among Hips.*Bone7.*mapping file"):
        find_joint_map(names, parents)
    assert names[find_joint_map(names, parents, {"forearm_l": "Bone7"})["forearm_l"]] == "Bone7"


def test_a_mapping_overrides_what_is_found() -> None:
    names, parents = skeleton("cmu")
    assert names[find_joint_map(names, parents, {"spine": "LowerBack"})["spine"]] == "LowerBack"


def test_joints_that_do_not_hang_together_are_refused() -> None:
    names, parents = skeleton("cmu")
    with pytest.raises(InputError, match=r"'RightHand' was taken for hand_l but does not hang under 'LeftForeArm'"):
        find_joint_map(names, parents, {"hand_l": "RightHand"})
    with pytest.raises(InputError, match=r"head: 'Haed' is no joint.*perhaps 'Head'"):
        find_joint_map(names, parents, {"head": "Haed"})
