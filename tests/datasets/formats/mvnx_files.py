"""A small MVNX file for tests: somebody in a T-pose who faces y."""

import re
from pathlib import Path

import numpy as np

from tests.datasets.formats.bvh_fuzzer import mutate

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


NUMBERS = (b"nan", b"inf", b"1e999", b"1e6", b"-999999", b"0", b"1,5", b"x", b"", b"1 2", b"1e-300", b"9" * 5000)
LABELS = (b"", b"Pelvis", b"Head", b"LeftHand", b"&#10;", b"&#x2028;", b"&lt;", b"x" * 5000, b"/", b"Prop1")
COUNTS = (b"-1", b"0", b"1", b"0.0001", b"1e9", b"nan", b"inf", b"x", b"")
BOMB = b'<!DOCTYPE mvnx [<!ENTITY a0 "1">' + b"".join(b'<!ENTITY a%d "&a%d;&a%d;">' % (n, n - 1, n - 1) for n in range(1, 60)) + b"]>"


def mutate_mvnx(text: bytes, rng: np.random.Generator) -> bytes:
    """Return an MVNX file after damage of any text, or one to three kinds of its own."""
    if rng.integers(4) == 0:
        return mutate(text, rng)
    for index in rng.integers(len(MVNX_MUTATIONS), size=rng.integers(1, 4)):
        text = MVNX_MUTATIONS[index](text, rng)
    return text


def _replace(text: bytes, pattern: bytes, by: bytes, rng: np.random.Generator, most: int = 3) -> bytes:
    """Return the text with up to ``most`` of the places that fit a pattern, whose first group stays, replaced."""
    found = list(re.finditer(pattern, text, re.DOTALL))
    for place in sorted(rng.integers(len(found), size=rng.integers(1, most + 1)) if found else (), reverse=True):
        text = text[: found[place].end(1)] + by + text[found[place].end() :]
    return text


def _mvnx_number(text: bytes, rng: np.random.Generator) -> bytes:
    """Damage numbers of frames or points, far apart or many."""
    return _replace(
        text, rb"((?:<orientation>|<position>|<sensorFreeAcceleration>|<pos_b>| )+)[-+0-9.e]+", NUMBERS[rng.integers(len(NUMBERS))], rng, 20
    )


def _mvnx_zeros(text: bytes, rng: np.random.Generator) -> bytes:
    """Make all positions or orientations of some frames zero."""
    tag = (b"orientation", b"position")[rng.integers(2)]
    return _replace(text, rb"(<%s>)[^<]*" % tag, b" ".join([b"0"] * (92 if tag == b"orientation" else 69)), rng, 20)


def _mvnx_element(text: bytes, rng: np.random.Generator) -> bytes:
    """Leave out, rename or double an element."""
    tags = (
        b"segments",
        b"segment",
        b"sensors",
        b"sensor",
        b"joints",
        b"joint",
        b"connector1",
        b"frames",
        b"frame",
        b"orientation",
        b"position",
        b"points",
        b"pos_b",
    )
    tag = tags[rng.integers(len(tags))]
    found = list(re.finditer(rb"<%s[ >].*?(?:</%s>|/>)" % (tag, tag), text, re.DOTALL))
    if not found:
        return text
    one = found[rng.integers(len(found))]
    by = (b"", one[0] * int(rng.integers(2, 200)), one[0].replace(tag, b"x"), b"<%s/>" % tag)[rng.integers(4)]
    return text[: one.start()] + by[: 2**22] + text[one.end() :]


def _mvnx_label(text: bytes, rng: np.random.Generator) -> bytes:
    return _replace(text, rb'(label=")[^"]*', LABELS[rng.integers(len(LABELS))], rng)


def _mvnx_connector(text: bytes, rng: np.random.Generator) -> bytes:
    return _replace(text, rb"(<connector[12]>)[^<]*", LABELS[rng.integers(len(LABELS))], rng)


def _mvnx_attribute(text: bytes, rng: np.random.Generator) -> bytes:
    name = (b"frameRate", b"index", b"type", b"segmentCount", b"xmlns", b"version")[rng.integers(6)]
    return _replace(text, rb'(%s=")[^"]*' % name, COUNTS[rng.integers(len(COUNTS))], rng)


def _mvnx_many(text: bytes, rng: np.random.Generator) -> bytes:
    """Add thousands of segments, frames or nested elements."""
    count = int(rng.integers(1, 20_000))
    what = (b'<segment label="s%d"/>', b'<frame index="%d"/>', b"<deep>")[rng.integers(3)]
    many = b"".join(what % number if b"%" in what else what for number in range(count))
    place = (b"</segments>", b"</frames>", b"<segments>")[rng.integers(3)]
    return text.replace(place, many + place, 1)


def _mvnx_bomb(text: bytes, rng: np.random.Generator) -> bytes:
    """Declare entities that would grow to millions of times their size, or that name a file."""
    outside = b'<!DOCTYPE mvnx [<!ENTITY a59 SYSTEM "file:///etc/hostname">]>'
    body = text.partition(b"?>")[2] or text
    return (BOMB, outside)[rng.integers(2)] + _replace(body, rb"(<position>)[^<]*", b"&a59;", rng)


MVNX_MUTATIONS = (_mvnx_number, _mvnx_zeros, _mvnx_element, _mvnx_label, _mvnx_connector, _mvnx_attribute, _mvnx_many, _mvnx_bomb)
