"""Tiny clips for tests: a motion on the 20 bodies, and the same motion as BVH on skeletons of several fashions."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from datasets.formats.bvh import Bvh, channel_values, local_pose, write_bvh
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODIES, BODY_NAMES, HINGE_COUNT, HINGE_NAMES, SKELETON, rotations_from_hinges

STANDING = 0.03 + 0.42 + 0.41 + 0.08  # m, height of the pelvis over the soles: hip offset, thigh, shin, ankle height
MIXAMO = {
    "pelvis": "Hips", "spine": "Spine", "chest": "Spine1", "head": "Head", "collar": "Shoulder", "upper_arm": "Arm",
    "forearm": "ForeArm", "hand": "Hand", "thigh": "UpLeg", "shin": "Leg", "foot": "Foot", "toe": "ToeBase",
}  # fmt: skip
TO_Y_UP = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])  # ours (x, y, z) is (z, x, y) of a Y-up file


def hinge(name: str) -> int:
    """Return the index of a hinge such as "shin_l_y"."""
    return HINGE_NAMES.index(name)


def posed(angles: dict[str, float], frames: int = 30, height: float = STANDING) -> BodyMotion:
    """Return a clip that holds a pose given by hinge angles in degrees; all others are zero, a T-pose."""
    hinges = np.zeros((frames, HINGE_COUNT))
    for name, degrees in angles.items():
        hinges[:, hinge(name)] = np.radians(degrees)
    still = np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1))
    root = np.tile([0.0, 0.0, height], (frames, 1))
    return BodyMotion(root, rotations_from_hinges(still, hinges), 60.0, "posed")


def lively(seed: int = 0, standing: int = 40, moving: int = 80) -> BodyMotion:
    """Return a clip that stands in a T-pose, then moves every hinge smoothly while it flies forward, too fast to stand.

    Knees and elbows only bend the way that knees and elbows do, and clearly, toes keep still.
    """
    rng = np.random.default_rng(seed)
    frames = standing + moving
    time = np.clip(np.arange(frames) - standing, 0, None) / 60.0
    wave = np.sin(np.pi * time[:, None] * rng.uniform(0.8, 1.6, HINGE_COUNT))
    hinges = wave * rng.uniform(0.1, 0.5, HINGE_COUNT)
    for name, sign in (("shin_l_y", 1), ("shin_r_y", 1), ("forearm_l_z", -1), ("forearm_r_z", 1)):
        hinges[:, hinge(name)] = sign * 1.2 * (1 - np.exp(-6 * time)) * (1 + 0.2 * wave[:, hinge(name)])
    for index, name in enumerate(HINGE_NAMES):
        if name.startswith("toe"):
            hinges[:, index] = 0.0
    root = np.stack([4.0 * time, 0.3 * np.sin(2 * time), STANDING + 0.6 * (1 - np.exp(-8 * time))], axis=1)
    turned = Rotation.from_euler("ZYX", np.stack([0.8 * time, 0.2 * np.sin(time), 0.1 * np.sin(2 * time)], axis=1))
    return BodyMotion(root, rotations_from_hinges(turned.as_quat(scalar_first=True), hinges), 60.0, "lively")


def as_bvh(
    motion: BodyMotion,
    unit: float = 0.01,
    up: str = "y",
    frames: dict[str, Rotation] | None = None,
    names: dict[str, str] | None = None,
    without: tuple[str, ...] = (),
) -> Bvh:
    """Return a motion on the 20 bodies as BVH.

    Args:
        motion: The clip.
        unit: Metres per unit of the file.
        up: "y" or "z".
        frames: Body -> rotation of the joint's own frame against the body's; where it is not the identity the file's zero pose
            is no T-pose.
        names: Body without side -> joint name without side; "Left" and "Right" are put in front.
        without: Bodies that the file lacks; they must be leaves.
    """
    to_file = Rotation.from_matrix(TO_Y_UP if up == "y" else np.eye(3))
    own = {body: (frames or {}).get(body, Rotation.identity()) for body in BODY_NAMES}
    order = [index for index in _depth_first() if BODY_NAMES[index] not in without]
    offsets, values, channels = [], [], []
    for index in order:
        body = BODIES[index]
        over = own[body.parent] if body.parent else Rotation.identity()
        turned = over.inv() * Rotation.from_quat(motion.local_rotations[:, index], scalar_first=True) * own[body.name]
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Gimbal lock")  # any of the many solutions will do
            turns = (to_file * turned * to_file.inv()).as_euler("ZXY", degrees=True)
        if body.parent is None:
            values.append(to_file.apply(motion.root_position.copy()) / unit)
            channels.append(("Xposition", "Yposition", "Zposition", "Zrotation", "Xrotation", "Yrotation"))
        else:
            channels.append(("Zrotation", "Xrotation", "Yrotation"))
        values.append(turns)
        offsets.append(to_file.apply(over.inv().apply(SKELETON.offsets[index].copy())) / unit)
    parents = tuple(order.index(SKELETON.parents[index]) if SKELETON.parents[index] >= 0 else -1 for index in order)
    tip = {body: to_file.apply(own[body].inv().apply([0.2, 0.0, -0.08])) / unit for body in ("foot_l", "foot_r")}
    sites = tuple((tuple(tip[BODY_NAMES[i]].tolist()),) if BODY_NAMES[i] in tip and i + 1 not in order else () for i in order)
    return Bvh(
        tuple(joint_name(BODY_NAMES[index], names or MIXAMO) for index in order),
        parents,
        np.array(offsets),
        tuple(channels),
        sites,  # type: ignore[arg-type]
        1.0 / motion.fps,
        np.concatenate(values, axis=1),
    )


def write_two_figures(path: Path, one: Bvh, other: Bvh) -> None:
    """Write a file with two ROOTs: two clips of the same number of frames side by side."""
    texts = []
    for bvh in (one, other):
        write_bvh(path, bvh)
        texts.append(path.read_text())
    trees = [text[text.index("ROOT") : text.index("MOTION")] for text in texts]
    lines = [text[text.index("MOTION") :].splitlines() for text in texts]
    rows = [f"{left} {right}" for left, right in zip(lines[0][3:], lines[1][3:], strict=True)]
    path.write_text("\n".join(["HIERARCHY", *trees, *lines[0][:3], *rows]))


def joint_name(body: str, names: dict[str, str]) -> str:
    """Return the joint's name for a body such as "thigh_l"."""
    base, _, side = body.rpartition("_")
    return {"l": "Left", "r": "Right"}[side] + names[base] if side in ("l", "r") else names[body]


def _depth_first() -> list[int]:
    """Return the bodies' indices, each followed by all below it, as a BVH file lists them."""
    order: list[int] = []
    open_ = [0]
    while open_:
        index = open_.pop()
        order.append(index)
        open_.extend(reversed(SKELETON.children(index)))
    return order


def in_axes(bvh: Bvh, axes: np.ndarray) -> Bvh:
    """Return a file of 20 joints as another program writes it, whose axes are ``axes`` (3, 3) times this one's; a reflection mirrors it."""
    positions, rotations = local_pose(bvh)
    turned = axes @ Rotation.from_quat(rotations.reshape(-1, 4), scalar_first=True).as_matrix() @ axes.T
    quaternions = Rotation.from_matrix(turned).as_quat(scalar_first=True).reshape(rotations.shape)
    sites = tuple(tuple(tuple((axes @ site).tolist()) for site in sites) for sites in bvh.end_sites)
    moved = replace(bvh, offsets=bvh.offsets @ axes.T, end_sites=sites)  # type: ignore[arg-type]
    return replace(moved, values=channel_values(moved, positions @ axes.T, quaternions))
