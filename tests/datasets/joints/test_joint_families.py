"""Joint names of the programs and rigs in use are found without a mapping file, and helper joints never win over a limb."""

import numpy as np
import pytest

from datasets.joints.joint_mapping import JointGeometry, find_joint_map
from datasets.motion.humanoid import BODIES, BODY_NAMES

# family: left and right; then pelvis, spine, chest, head and, with * for the side, collar, upper arm, forearm, hand, thigh, shin,
# foot, toe; - where the family has none
FAMILIES = {
    "mixamo": """Left/Right; mixamorig:Hips, mixamorig:Spine, mixamorig:Spine2, mixamorig:Head, mixamorig:*Shoulder, mixamorig:*Arm,
        mixamorig:*ForeArm, mixamorig:*Hand, mixamorig:*UpLeg, mixamorig:*Leg, mixamorig:*Foot, mixamorig:*ToeBase""",
    "mixamo without colon": """Left/Right; mixamorigHips, mixamorigSpine, mixamorigSpine2, mixamorigHead, mixamorig*Shoulder,
        mixamorig*Arm,
        mixamorig*ForeArm, mixamorig*Hand, mixamorig*UpLeg, mixamorig*Leg, mixamorig*Foot, mixamorig*ToeBase""",
    "rigify metarig": """L/R; spine, spine.001, spine.003, spine.006, shoulder.*, upper_arm.*, forearm.*, hand.*, thigh.*, shin.*, foot.*,
        toe.*""",
    "rigify DEF": """L/R; DEF-spine, DEF-spine.001, DEF-spine.003, DEF-spine.006, DEF-shoulder.*, DEF-upper_arm.*, DEF-forearm.*,
        DEF-hand.*, DEF-thigh.*, DEF-shin.*, DEF-foot.*, DEF-toe.*""",
    "rigify ORG": """L/R; ORG-spine, ORG-spine.001, ORG-spine.003, ORG-spine.006, ORG-shoulder.*, ORG-upper_arm.*, ORG-forearm.*,
        ORG-hand.*, ORG-thigh.*, ORG-shin.*, ORG-foot.*, ORG-toe.*""",
    "auto-rig pro": """l/r; root.x, spine_01.x, spine_02.x, head.x, shoulder.*, arm_stretch.*, forearm_stretch.*, hand.*, thigh_stretch.*,
        leg_stretch.*, foot.*, toes_01.*""",
    "character creator": """L/R; CC_Base_Hip, CC_Base_Waist, CC_Base_Spine02, CC_Base_Head, CC_Base_*_Clavicle, CC_Base_*_Upperarm,
        CC_Base_*_Forearm, CC_Base_*_Hand, CC_Base_*_Thigh, CC_Base_*_Calf, CC_Base_*_Foot, CC_Base_*_ToeBase""",
    "genesis 3 and 8": """l/r; hip, abdomenLower, chestLower, head, *Collar, *ShldrBend, *ForearmBend, *Hand, *ThighBend, *Shin,
        *Foot, *Toe""",
    "genesis 9": """l/r; hip, spine1, spine4, head, *_shoulder, *_upperarm, *_forearm, *_hand, *_thigh, *_shin, *_foot, *_toes""",
    "poser, second life": """l/r; hip, abdomen, chest, head, *Collar, *Shldr, *ForeArm, *Hand, *Thigh, *Shin, *Foot, *Toe""",
    "second life avatar": """Left/Right; mPelvis, mTorso, mChest, mHead, mCollar*, mShoulder*, mElbow*, mWrist*, mHip*, mKnee*,
        mAnkle*, mToe*""",
    "vrm": """L/R; J_Bip_C_Hips, J_Bip_C_Spine, J_Bip_C_Chest, J_Bip_C_Head, J_Bip_*_Shoulder, J_Bip_*_UpperArm, J_Bip_*_LowerArm,
        J_Bip_*_Hand, J_Bip_*_UpperLeg, J_Bip_*_LowerLeg, J_Bip_*_Foot, J_Bip_*_ToeBase""",
    "unity": """Left/Right; Hips, Spine, Chest, Head, *Shoulder, *UpperArm, *LowerArm, *Hand, *UpperLeg, *LowerLeg, *Foot, *Toes""",
    "unreal": """l/r; pelvis, spine_01, spine_03, head, clavicle_*, upperarm_*, lowerarm_*, hand_*, thigh_*, calf_*, foot_*, ball_*""",
    "mmd": """左/右; センター, 上半身, 上半身2, 頭, *肩, *腕, *ひじ, *手首, *足, *ひざ, *足首, *つま先""",
    "mmd in english": """L/R; center, upper body, upper body 2, head, shoulder_*, arm_*, elbow_*, wrist_*, leg_*, knee_*, ankle_*,
        toe_*""",
    "smpl": """L/R; Pelvis, Spine1, Spine3, Head, *_Collar, *_Shoulder, *_Elbow, *_Wrist, *_Hip, *_Knee, *_Ankle, *_Foot""",
    "smpl-x": """left/right; pelvis, spine1, spine3, head, *_collar, *_shoulder, *_elbow, *_wrist, *_hip, *_knee, *_ankle, *_foot""",
    "amass": """L/R; m_avg_Pelvis, m_avg_Spine1, m_avg_Spine3, m_avg_Head, m_avg_*_Collar, m_avg_*_Shoulder, m_avg_*_Elbow, m_avg_*_Wrist,
        m_avg_*_Hip, m_avg_*_Knee, m_avg_*_Ankle, m_avg_*_Foot""",
    "amass, female": """L/R; f_avg_Pelvis, f_avg_Spine1, f_avg_Spine3, f_avg_Head, f_avg_*_Collar, f_avg_*_Shoulder, f_avg_*_Elbow,
        f_avg_*_Wrist, f_avg_*_Hip, f_avg_*_Knee, f_avg_*_Ankle, f_avg_*_Foot""",
    "iclone, old": """L/R; RL_Hip, RL_Waist, RL_Spine02, RL_Head, RL_*_Clavicle, RL_*_Upperarm, RL_*_Forearm, RL_*_Hand, RL_*_Thigh,
        RL_*_Calf, RL_*_Foot, RL_*_ToeBase""",
    "without separators": """left/right; hips, lowerspine, upperspine, head, *collar, *uparm, *lowarm, *hand, *upleg,
        *lowleg, *foot, *toebase""",
    "ipi": """L/R; Hip, LowerSpine, Chest, Head, *Clavicle, *Shoulder, *Forearm, *Hand, *Thigh, *Shin, *Foot, *Toe""",
    "human3.6m": """left/right; Hip, Spine, Thorax, Nose, -, shoulder_*, elbow_*, wrist_*, hip_*, knee_*, ankle_*, -""",
    "deepmotion": """l/r; hips_JNT, spine_JNT, spine1_JNT, head_JNT, *_shoulder_JNT, *_arm_JNT, *_forearm_JNT, *_hand_JNT, *_upleg_JNT,
        *_leg_JNT, *_foot_JNT, *_toebase_JNT""",
    "rokoko newton": """Left/Right; Hips, Spine1, Spine4, Head, *Shoulder, *Arm, *ForeArm, *Hand, *Thigh, *Shin, *Foot, *Toe""",
    "perception neuron": """Left/Right; Robot_Hips, Robot_Spine, Robot_Spine3, Robot_Head, Robot_*Shoulder, Robot_*Arm, Robot_*ForeArm,
        Robot_*Hand, Robot_*UpLeg, Robot_*Leg, Robot_*Foot, -""",
    "xsens mvn": """Left/Right; Pelvis, L3, T8, Head, *Shoulder, *UpperArm, *ForeArm, *Hand, *UpperLeg, *LowerLeg, *Foot, *Toe""",
    "acclaim, vicon": """l/r; root, lowerback, thorax, head, *clavicle, *humerus, *radius, *wrist, *femur, *tibia, *foot, *toes""",
    "motive": """L/R; Skeleton_Hip, Skeleton_Ab, Skeleton_Chest, Skeleton_Head, Skeleton_*Shoulder, Skeleton_*UArm, Skeleton_*FArm,
        Skeleton_*Hand, Skeleton_*Thigh, Skeleton_*Shin, Skeleton_*Foot, Skeleton_*Toe""",
    "biped": """L/R; Bip01 Pelvis, Bip01 Spine, Bip01 Spine2, Bip01 Head, Bip01 * Clavicle, Bip01 * UpperArm, Bip01 * Forearm,
        Bip01 * Hand,
        Bip01 * Thigh, Bip01 * Calf, Bip01 * Foot, Bip01 * Toe0""",
    "cat": """L/R; CATRigPelvis, CATRigSpine1, CATRigRibcage, CATRigHead, CATRig*ArmCollarbone, CATRig*Arm1, CATRig*Arm2, CATRig*ArmPalm,
        CATRig*Leg1, CATRig*Leg2, CATRig*LegAnkle, -""",
    "cat, base human": """L/R; Base HumanPelvis, Base HumanSpine1, Base HumanRibcage, Base HumanHead, Base Human*Collarbone,
        Base Human*Upperarm, Base Human*Forearm, Base Human*Palm, Base Human*Thigh, Base Human*Calf, Base Human*Foot, Base Human*Toe""",
    "valve source": """L/R; ValveBiped.Bip01_Pelvis, ValveBiped.Bip01_Spine, ValveBiped.Bip01_Spine4, ValveBiped.Bip01_Head1,
        ValveBiped.Bip01_*_Clavicle, ValveBiped.Bip01_*_UpperArm, ValveBiped.Bip01_*_Forearm, ValveBiped.Bip01_*_Hand,
        ValveBiped.Bip01_*_Thigh, ValveBiped.Bip01_*_Calf, ValveBiped.Bip01_*_Foot, ValveBiped.Bip01_*_Toe0""",
    "kinect": """Left/Right; SpineBase, SpineMid, SpineShoulder, Head, -, Shoulder*, Elbow*, Wrist*, Hip*, Knee*, Ankle*, Foot*""",
    "kinect 1": """Left/Right; HipCenter, Spine, ShoulderCenter, Head, -, Shoulder*, Elbow*, Wrist*, Hip*, Knee*, Ankle*, Foot*""",
    "azure kinect": """LEFT/RIGHT; PELVIS, SPINE_NAVEL, SPINE_CHEST, HEAD, CLAVICLE_*, SHOULDER_*, ELBOW_*, WRIST_*, HIP_*, KNEE_*,
        ANKLE_*, FOOT_*""",
    "makehuman, old": """L/R; Root, Spine1, Spine3, Head, Clavicle_*, UpArm_*, LoArm_*, Hand_*, UpLeg_*, LoLeg_*, Foot_*, Toe_*""",
    "makehuman": """L/R; root, spine04, spine01, head, clavicle.*, upperarm01.*, lowerarm01.*, wrist.*, upperleg01.*, lowerleg01.*,
        foot.*,
        toe1-1.*""",
    "genea": """l/r; b_root, b_spine0, b_spine3, b_head, b_*_shoulder, b_*_arm, b_*_forearm, b_*_wrist, b_*_upleg, b_*_leg, b_*_foot,
        -""",
    "mocopi": """l/r; root, torso_2, torso_6, head, *_shoulder, *_up_arm, *_low_arm, *_hand, *_up_leg, *_low_leg, *_foot, *_toes""",
    "slimevr": """LEFT/RIGHT; HIP, WAIST, CHEST, HEAD, *_SHOULDER, *_UPPER_ARM, *_LOWER_ARM, *_HAND, *_UPPER_LEG, *_LOWER_LEG, *_FOOT,
        -""",
    "cascadeur": """L/R; Pelvis, Stomach, Chest, Head, Clavicle_*, Arm_*, Forearm_*, Hand_*, Thigh_*, Calf_*, Foot_*, Toe_*""",
    "advanced skeleton": """L/R; Root_M, Spine1_M, Chest_M, Head_M, Scapula_*, Shoulder_*, Elbow_*, Wrist_*, Hip_*, Knee_*, Ankle_*,
        Toes_*""",
    "names and sides in the other order": """Lft/Rgt; pelvis_jnt, spine_jnt, chest_jnt, head_jnt, collar_*_jnt, arm_upper_*_jnt,
        arm_lower_*_jnt, hand_*_jnt, leg_upper_*_jnt, leg_lower_*_jnt, foot_*_jnt, toe_*_jnt""",
    "lf and rt": """Lf/Rt; Pelvis, Spine, Chest, Head, *_Clav, *_Shoulder, *_Elbow, *_Wrist, *_Thigh, *_Shin, *_Foot, *_Toe""",
    "opensim": """l/r; pelvis, lumbar, torso, head, clavicle_*, humerus_*, ulna_*, hand_*, femur_*, tibia_*, foot_*, toes_*""",
    "chinese": """左/右; 骨盆, 脊椎, 胸, 头, *肩, *上臂, *前臂, *手, *大腿, *小腿, *脚, *脚趾""",
    "korean": """왼쪽/오른쪽; 골반, 척추, 가슴, 머리, *쇄골, *위팔, *아래팔, *손, *허벅지, *종아리, *발, *발가락""",
    "french, in short": """G/D; Bassin, Dos, Torse, Tete, Clavicule_*, Bras_*, AvantBras_*, Main_*, Cuisse_*, Mollet_*, Pied_*,
        Orteils_*""",
    "dutch": """links/rechts; bekken, ruggengraat, borst, hoofd, sleutelbeen_*, bovenarm_*, onderarm_*, hand_*, bovenbeen_*, onderbeen_*,
        voet_*, teen_*""",
    "dutch, sides first": """linker/rechter; Bekken, Ruggengraat, Borst, Hoofd, *Schouder, *Bovenarm, *Elleboog, *Pols, *Heup, *Knie,
        *Enkel, *Tenen""",
    "polish": """Lewe/Prawe; Miednica, Kręgosłup, KlatkaPiersiowa, Głowa, *Obojczyk, *Ramię, *Przedramię, *Dłoń, *Udo, *Łydka, *Stopa, -""",
    "portuguese": """Esq/Dir; Quadril, Coluna, Peito, Cabeça, Clavícula_*, Braço_*, Antebraço_*, Mão_*, Coxa_*, Canela_*, Pé_*, -""",
    "german": """links/rechts; Becken, Wirbelsäule, Brust, Kopf, Schlüsselbein_*, Oberarm_*, Unterarm_*, Hand_*, Oberschenkel_*,
        Unterschenkel_*, Fuß_*, Zehen_*""",
    "french": """gauche/droite; Bassin, Colonne, Poitrine, Tête, Clavicule_*, Bras_*, Avant-bras_*, Main_*, Cuisse_*, Tibia_*, Pied_*,
        Orteils_*""",
    "spanish": """izq/der; Pelvis, Columna, Pecho, Cabeza, Clavícula_*, Brazo_*, Antebrazo_*, Mano_*, Muslo_*, Rodilla_*, Tobillo_*,
        Pie_*""",
}  # fmt: skip
PARENTS = {body.name: body.parent for body in BODIES}


def tree(text: str) -> dict[str, str | None]:
    """Return joint -> parent of a tree written as "parent > child child; ...", the root first."""
    parents: dict[str, str | None] = {}
    for line in text.replace("\n", " ").split(";"):
        parent, _, children = (part.strip() for part in line.partition(">"))
        parents.setdefault(parent, None)
        parents |= dict.fromkeys(children.split(), parent)
    return parents


def depth_first(parents: dict[str, str | None]) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Return names and parents' indices of a tree as a BVH file lists them."""
    names: list[str] = []

    def visit(joint: str) -> None:
        names.append(joint)
        for child, parent in parents.items():
            if parent == joint:
                visit(child)

    visit(next(joint for joint, parent in parents.items() if parent is None))
    return tuple(names), tuple(-1 if (parent := parents[name]) is None else names.index(parent) for name in names)


def joints_of(family: str) -> dict[str, str]:
    """Return body -> joint name of a family."""
    sides, _, listed = FAMILIES[family].partition(";")
    parts = ("pelvis", "spine", "chest", "head", "collar", "upper_arm", "forearm", "hand", "thigh", "shin", "foot", "toe")
    joints: dict[str, str] = dict(zip(parts, (name.strip() for name in listed.split(",")), strict=True))
    called = {body: joints.get(body) or joints[body[:-2]].replace("*", sides.split("/")["lr".index(body[-1])]) for body in BODY_NAMES}
    return {body: name for body, name in called.items() if name != "-"}


@pytest.mark.parametrize("family", FAMILIES)
def test_joints_of_each_family_are_found(family: str) -> None:
    joints = joints_of(family)
    over = dict(PARENTS)
    for body in BODY_NAMES:
        while over[body] is not None and over[body] not in joints:
            over[body] = over[over[body] or ""]
    parents: dict[str, str | None] = {name: joints.get(over[body] or "") for body, name in joints.items()}
    names, indices = depth_first(parents)
    assert {body: names[joint] for body, joint in find_joint_map(names, indices).items()} == joints


# family: tree with helper joints, and what must be found besides what the name says: body, joint
WITH_HELPERS = {
    "genesis 8": (
        """hip > pelvis abdomenLower; pelvis > lThighBend rThighBend; lThighBend > lThighTwist; lThighTwist > lShin; lShin > lFoot;
        lFoot > lMetatarsals; lMetatarsals > lToe; lToe > lBigToe; rThighBend > rThighTwist; rThighTwist > rShin; rShin > rFoot;
        abdomenLower > abdomenUpper; abdomenUpper > chestLower; chestLower > chestUpper lPectoral rPectoral;
        chestUpper > lCollar rCollar neckLower; lCollar > lShldrBend; lShldrBend > lShldrTwist; lShldrTwist > lForearmBend;
        lForearmBend > lForearmTwist; lForearmTwist > lHand; lHand > lThumb1 lCarpal1; rCollar > rShldrBend; rShldrBend > rShldrTwist;
        rShldrTwist > rForearmBend; rForearmBend > rForearmTwist; rForearmTwist > rHand; neckLower > neckUpper; neckUpper > head;
        head > upperFaceRig lEar""",
        {"pelvis": "pelvis", "spine": "abdomenUpper", "chest": "chestUpper", "head": "head", "upper_arm_l": "lShldrBend",
         "forearm_r": "rForearmBend", "hand_l": "lHand", "thigh_l": "lThighBend", "shin_r": "rShin", "toe_l": "lToe"},
    ),
    "character creator": (
        """CC_Base_BoneRoot > CC_Base_Hip; CC_Base_Hip > CC_Base_Pelvis CC_Base_Waist; CC_Base_Pelvis > CC_Base_L_Thigh CC_Base_R_Thigh;
        CC_Base_L_Thigh > CC_Base_L_ThighTwist01 CC_Base_L_KneeShareBone CC_Base_L_Calf;
        CC_Base_L_Calf > CC_Base_L_CalfTwist01 CC_Base_L_Foot;
        CC_Base_L_Foot > CC_Base_L_ToeBaseShareBone CC_Base_L_ToeBase; CC_Base_R_Thigh > CC_Base_R_ThighTwist01 CC_Base_R_Calf;
        CC_Base_R_Calf > CC_Base_R_Foot; CC_Base_Waist > CC_Base_Spine01; CC_Base_Spine01 > CC_Base_Spine02;
        CC_Base_Spine02 > CC_Base_NeckTwist01 CC_Base_L_Clavicle CC_Base_R_Clavicle CC_Base_L_Breast;
        CC_Base_NeckTwist01 > CC_Base_NeckTwist02;
        CC_Base_NeckTwist02 > CC_Base_Head; CC_Base_Head > CC_Base_FacialBone; CC_Base_L_Clavicle > CC_Base_L_Upperarm;
        CC_Base_L_Upperarm > CC_Base_L_UpperarmTwist01 CC_Base_L_Forearm; CC_Base_L_Forearm > CC_Base_L_ElbowShareBone CC_Base_L_Hand;
        CC_Base_L_Hand > CC_Base_L_Thumb1; CC_Base_R_Clavicle > CC_Base_R_Upperarm; CC_Base_R_Upperarm > CC_Base_R_Forearm;
        CC_Base_R_Forearm > CC_Base_R_Hand""",
        {"pelvis": "CC_Base_Pelvis", "spine": "CC_Base_Spine01", "chest": "CC_Base_Spine02", "head": "CC_Base_Head",
         "thigh_l": "CC_Base_L_Thigh", "shin_l": "CC_Base_L_Calf", "toe_l": "CC_Base_L_ToeBase", "upper_arm_l": "CC_Base_L_Upperarm",
         "forearm_l": "CC_Base_L_Forearm", "hand_l": "CC_Base_L_Hand"},
    ),
    "mmd": (
        """全ての親 > センター 左足IK親; 左足IK親 > 左足ＩＫ; 左足ＩＫ > 左つま先ＩＫ; センター > グルーブ;
        グルーブ > 腰; 腰 > 上半身 下半身;
        下半身 > 左足 右足 左足D; 左足 > 左ひざ; 左ひざ > 左足首; 左足首 > 左つま先; 左足D > 左ひざD; 左ひざD > 左足首D; 右足 > 右ひざ;
        右ひざ > 右足首; 上半身 > 上半身2; 上半身2 > 首 左肩P 右肩P; 首 > 頭; 頭 > 左目 両目; 左肩P > 左肩; 左肩 > 左肩C; 左肩C > 左腕;
        左腕 > 左腕捩; 左腕捩 > 左ひじ; 左ひじ > 左手捩; 左手捩 > 左手首; 左手首 > 左人指１; 右肩P > 右肩; 右肩 > 右腕; 右腕 > 右ひじ;
        右ひじ > 右手首""",
        {"pelvis": "下半身", "spine": "上半身", "chest": "上半身2", "head": "頭", "collar_l": "左肩", "upper_arm_l": "左腕",
         "forearm_l": "左ひじ", "hand_l": "左手首", "thigh_l": "左足", "shin_l": "左ひざ", "foot_l": "左足首", "toe_l": "左つま先"},
    ),
    "unreal": (
        """root > pelvis ik_foot_root ik_hand_root; pelvis > spine_01 thigh_l thigh_r; thigh_l > thigh_twist_01_l calf_l;
        calf_l > calf_twist_01_l foot_l; foot_l > ball_l; thigh_r > thigh_twist_01_r calf_r; calf_r > foot_r; spine_01 > spine_02;
        spine_02 > spine_03; spine_03 > clavicle_l clavicle_r neck_01 weapon_l; neck_01 > head; clavicle_l > upperarm_l;
        upperarm_l > upperarm_twist_01_l lowerarm_l; lowerarm_l > lowerarm_twist_01_l hand_l; hand_l > index_01_l thumb_01_l;
        clavicle_r > upperarm_r; upperarm_r > lowerarm_r; lowerarm_r > hand_r; ik_foot_root > ik_foot_l ik_foot_r;
        ik_hand_root > ik_hand_gun; ik_hand_gun > ik_hand_l ik_hand_r""",
        {"pelvis": "pelvis", "chest": "spine_03", "head": "head", "thigh_l": "thigh_l", "shin_l": "calf_l", "foot_r": "foot_r",
         "upper_arm_l": "upperarm_l", "forearm_l": "lowerarm_l", "hand_l": "hand_l"},
    ),
    "rigify DEF": (
        """root > DEF-spine; DEF-spine > DEF-spine.001 DEF-thigh.L DEF-thigh.R DEF-pelvis.L DEF-pelvis.R; DEF-spine.001 > DEF-spine.002;
        DEF-spine.002 > DEF-spine.003; DEF-spine.003 > DEF-spine.004 DEF-shoulder.L DEF-shoulder.R DEF-breast.L;
        DEF-spine.004 > DEF-spine.005;
        DEF-spine.005 > DEF-spine.006; DEF-spine.006 > DEF-jaw DEF-eye.L; DEF-shoulder.L > DEF-upper_arm.L;
        DEF-upper_arm.L > DEF-upper_arm.L.001;
        DEF-upper_arm.L.001 > DEF-forearm.L; DEF-forearm.L > DEF-forearm.L.001; DEF-forearm.L.001 > DEF-hand.L;
        DEF-shoulder.R > DEF-upper_arm.R;
        DEF-upper_arm.R > DEF-forearm.R; DEF-forearm.R > DEF-hand.R; DEF-thigh.L > DEF-thigh.L.001; DEF-thigh.L.001 > DEF-shin.L;
        DEF-shin.L > DEF-shin.L.001; DEF-shin.L.001 > DEF-foot.L; DEF-foot.L > DEF-toe.L; DEF-thigh.R > DEF-shin.R;
        DEF-shin.R > DEF-foot.R""",
        {"pelvis": "DEF-spine", "chest": "DEF-spine.003", "head": "DEF-spine.006", "upper_arm_l": "DEF-upper_arm.L",
         "forearm_l": "DEF-forearm.L", "hand_l": "DEF-hand.L", "thigh_l": "DEF-thigh.L", "shin_l": "DEF-shin.L", "toe_l": "DEF-toe.L"},
    ),
    "older biped, whose thighs hang from the spine and collars from the neck": (
        """Bip01 > Bip01_Footsteps Bip01_Pelvis; Bip01_Pelvis > Bip01_Spine; Bip01_Spine > Bip01_L_Thigh Bip01_R_Thigh Bip01_Spine1;
        Bip01_L_Thigh > Bip01_L_Calf; Bip01_L_Calf > Bip01_L_Foot; Bip01_L_Foot > Bip01_L_Toe0; Bip01_L_Toe0 > Bip01_L_Toe0Nub;
        Bip01_R_Thigh > Bip01_R_Calf; Bip01_R_Calf > Bip01_R_Foot; Bip01_Spine1 > Bip01_Neck;
        Bip01_Neck > Bip01_Head Bip01_L_Clavicle Bip01_R_Clavicle;
        Bip01_Head > Bip01_HeadNub Bip01_Ponytail1; Bip01_L_Clavicle > Bip01_L_UpperArm; Bip01_L_UpperArm > Bip01_L_ForeArm;
        Bip01_L_ForeArm > Bip01_L_ForeTwist Bip01_L_Hand; Bip01_R_Clavicle > Bip01_R_UpperArm; Bip01_R_UpperArm > Bip01_R_ForeArm;
        Bip01_R_ForeArm > Bip01_R_Hand""",
        {"pelvis": "Bip01_Pelvis", "chest": "Bip01_Spine1", "head": "Bip01_Head", "thigh_l": "Bip01_L_Thigh", "foot_l": "Bip01_L_Foot",
         "toe_l": "Bip01_L_Toe0", "forearm_l": "Bip01_L_ForeArm", "hand_l": "Bip01_L_Hand"},
    ),
}  # fmt: skip


@pytest.mark.parametrize("family", WITH_HELPERS)
def test_helper_joints_of_a_rig_are_no_limbs(family: str) -> None:
    text, expected = WITH_HELPERS[family]
    names, parents = depth_first(tree(text))
    found = {body: names[joint] for body, joint in find_joint_map(names, parents).items()}
    assert {body: found.get(body) for body in expected} == expected


HUMAN = """Hips > LeftUpLeg RightUpLeg Spine; LeftUpLeg > LeftLeg; LeftLeg > LeftFoot; RightUpLeg > RightLeg; RightLeg > RightFoot;
    Spine > Spine1; Spine1 > Neck LeftArm RightArm; Neck > Head; LeftArm > LeftForeArm; LeftForeArm > LeftHand; RightArm > RightForeArm;
    RightForeArm > RightHand"""


def geometry(names: tuple[str, ...], still: tuple[str, ...] = ()) -> JointGeometry:
    """Return joints 10 units from their parents, all of which turn but those named."""
    return JointGeometry(np.tile([0.0, 10.0, 0.0], (len(names), 1)), np.array([name not in still for name in names]))


@pytest.mark.parametrize(
    ("helpers", "still"),
    [
        ("LeftArm > L_Humerus", ()),  # carries no forearm
        ("Spine1 > L_Humerus; L_Humerus > L_Radius", ()),  # carries a forearm but no hand
        ("Hips > L_Humerus; L_Humerus > L_Radius; L_Radius > L_Wrist", ("L_Humerus", "L_Radius", "L_Wrist")),  # never moves
    ],
)
def test_the_arm_that_carries_forearm_and_hand_and_moves_wins_over_a_better_name(helpers: str, still: tuple[str, ...]) -> None:
    names, parents = depth_first(tree(f"{HUMAN}; {helpers}"))
    found = find_joint_map(names, parents, geometry=geometry(names, still))
    assert [names[found[body]] for body in ("upper_arm_l", "forearm_l", "hand_l")] == ["LeftArm", "LeftForeArm", "LeftHand"]


def test_a_bone_between_arm_and_forearm_that_never_turns_is_not_the_arm() -> None:
    names, parents = depth_first(tree(HUMAN.replace("LeftArm > LeftForeArm", "LeftArm > L_Humerus; L_Humerus > LeftForeArm")))
    assert names[find_joint_map(names, parents, geometry=geometry(names, ("L_Humerus",)))["upper_arm_l"]] == "LeftArm"


def test_an_arm_that_never_turns_on_a_collar_that_does_is_the_arm() -> None:
    with_collars = HUMAN.replace("LeftArm RightArm;", "LeftShoulder RightShoulder;")
    names, parents = depth_first(tree(f"{with_collars}; LeftShoulder > LeftArm; RightShoulder > RightArm"))
    found = find_joint_map(names, parents, geometry=geometry(names, ("LeftArm", "RightArm")))
    assert [names[found[body]] for body in ("collar_l", "upper_arm_l", "upper_arm_r")] == ["LeftShoulder", "LeftArm", "RightArm"]


def test_a_hand_or_foot_with_another_name_is_found_by_its_place() -> None:
    names, parents = depth_first(tree(HUMAN.replace("LeftFoot", "Shoe.L").replace("LeftHand", "Paw") + "; LeftForeArm > LeftForeArmTwist"))
    found = find_joint_map(names, parents, geometry=geometry(names))
    assert (names[found["foot_l"]], names[found["hand_l"]]) == ("Shoe.L", "Paw")
