"""A small MVNX file for tests: somebody in a T-pose who faces y."""

from pathlib import Path

# Segment, parent, origin [m] of someone in a T-pose who faces x. The leg is 0.50 + 0.5375 m, ours is 0.83: scale 0.8, hips as well
SEGMENTS: dict[str, tuple[str, tuple[float, float, float]]] = {
    "Pelvis": ("", (0, 0, 1.1)), "L5": ("Pelvis", (0, 0, 1.2)), "L3": ("L5", (0, 0, 1.3)), "T12": ("L3", (0, 0, 1.4)),
    "T8": ("T12", (0, 0, 1.5)), "Neck": ("T8", (0, 0, 1.7)), "Head": ("Neck", (0, 0, 1.8)),
    "RightShoulder": ("T8", (0, -0.03, 1.65)), "RightUpperArm": ("RightShoulder", (0, -0.2, 1.65)),
    "RightForeArm": ("RightUpperArm", (0, -0.5, 1.65)), "RightHand": ("RightForeArm", (0, -0.8, 1.65)),
    "LeftShoulder": ("T8", (0, 0.03, 1.65)), "LeftUpperArm": ("LeftShoulder", (0, 0.2, 1.65)),
    "LeftForeArm": ("LeftUpperArm", (0, 0.5, 1.65)), "LeftHand": ("LeftForeArm", (0, 0.8, 1.65)),
    "RightUpperLeg": ("Pelvis", (0, -0.1125, 1.1)), "RightLowerLeg": ("RightUpperLeg", (0, -0.1125, 0.6)),
    "RightFoot": ("RightLowerLeg", (0, -0.1125, 0.0625)), "RightToe": ("RightFoot", (0.15, -0.1125, 0.02)),
    "LeftUpperLeg": ("Pelvis", (0, 0.1125, 1.1)), "LeftLowerLeg": ("LeftUpperLeg", (0, 0.1125, 0.6)),
    "LeftFoot": ("LeftLowerLeg", (0, 0.1125, 0.0625)), "LeftToe": ("LeftFoot", (0.15, 0.1125, 0.02)),
}  # fmt: skip
QUARTER = "0.70710678 0 0 0.70710678"  # a quarter turn to the left, so that someone who faces x faces y


def mvnx_frame(index: int, sensors: str, kind: str = "normal") -> str:
    """Return a frame of the T-pose turned to face y: (x, y) is at (-y, x)."""
    places = " ".join(f"{-y} {x} {z}" for _, (x, y, z) in SEGMENTS.values())
    return (
        f'<frame index="{index}" type="{kind}"><orientation>{" ".join([QUARTER] * 23)}</orientation>'
        f"<position>{places}</position><sensorFreeAcceleration>{sensors}</sensorFreeAcceleration></frame>"
    )


def mvnx_text(frames: str, head: str = "", sensors: tuple[str, ...] = ("Pelvis", "LeftHand"), rate: str = "50") -> str:
    """Return the text of a file with these frames, something before its root, segments with sensors, and a frame rate."""
    segments = "".join(f'<segment label="{name}"><points><point><pos_b>0 0 0.1</pos_b></point></points></segment>' for name in SEGMENTS)
    joints = "".join(
        f'<joint label="j{name}"><connector1>{parent}/j</connector1><connector2>{name}/j</connector2></joint>'
        for name, (parent, _) in SEGMENTS.items()
        if parent
    )
    listed = "".join(f'<sensor label="{name}"/>' for name in sensors)
    return (
        f'<?xml version="1.0"?>{head}<mvnx xmlns="http://www.xsens.com/mvn/mvnx"><subject frameRate="{rate}">'
        f"<segments>{segments}</segments><sensors>{listed}</sensors><joints>{joints}</joints><frames>{frames}</frames></subject></mvnx>"
    )


THREE = mvnx_frame(0, "0 2 0.5 7 8 9") + mvnx_frame(1, "1 2 0.5 7 8 9") + mvnx_frame(2, "2 2 0.5 7 8 9")


def write_mvnx_file(folder: Path, text: str) -> Path:
    """Write a file into a folder; return it."""
    file = folder / "clip.mvnx"
    file.write_text(text, encoding="utf-8")
    return file
