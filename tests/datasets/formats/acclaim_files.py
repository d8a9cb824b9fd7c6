"""ASF and AMC files for tests: an arm of two bones, a person with the bones of CMU, and seeded damage."""

from pathlib import Path

import numpy as np

from tests.datasets.formats.bvh_fuzzer import mutate

ARM = """# two bones along x, which turn about axes of their own
:version 1.10
:name arm
:units
  mass 1.0
  length 0.45
  angle deg
:documentation
   of no use
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
  begin
     id 1
     name upper
     direction 1 0 0
     length 2
     axis 0 0 90 XYZ
    dof rx ry rz
    limits (-160.0 20.0)
           (-70.0 70.0)
           (-60.0 70.0)
  end
  begin
     id 2
     name lower
     direction 1 0 0
     length 3
     axis 0 0 90 XYZ
    dof rx
    limits (-10.0 170.0)
  end
:hierarchy
  begin
    root upper
    upper lower
  end
"""
ROWS = "root {} {} {} {} {} {}\nupper {} {} {}\nlower {}\n"
STILL = (0,) * 10
# Bone, parent, end minus beginning [CMU's unit of 5.6444 cm], axis, degrees of freedom, of someone who faces z with arms held out; y is up
PERSON = (
    ("lhipjoint", "root", (1.8, 0, 0), "0 0 0", ""), ("lfemur", "lhipjoint", (0, -7.5, 0), "0 0 20", "rx ry rz"),
    ("ltibia", "lfemur", (0, -7.3, 0), "0 0 20", "rx"), ("lfoot", "ltibia", (0, -1.2, 2.2), "-90 0 20", "rx rz"),
    ("ltoes", "lfoot", (0, 0, 1.1), "-90 0 20", "rx"),
    ("rhipjoint", "root", (-1.8, 0, 0), "0 0 0", ""), ("rfemur", "rhipjoint", (0, -7.5, 0), "0 0 -20", "rx ry rz"),
    ("rtibia", "rfemur", (0, -7.3, 0), "0 0 -20", "rx"), ("rfoot", "rtibia", (0, -1.2, 2.2), "-90 0 -20", "rx rz"),
    ("rtoes", "rfoot", (0, 0, 1.1), "-90 0 -20", "rx"),
    ("lowerback", "root", (0, 2.1, 0), "0 0 0", "rx ry rz"), ("upperback", "lowerback", (0, 2.1, 0), "0 0 0", "rx ry rz"),
    ("thorax", "upperback", (0, 2.1, 0), "0 0 0", "rx ry rz"), ("lowerneck", "thorax", (0, 1.6, 0), "0 0 0", "rx ry rz"),
    ("upperneck", "lowerneck", (0, 1.0, 0), "0 0 0", "rx ry rz"), ("head", "upperneck", (0, 1.6, 0), "0 0 0", "rx ry rz"),
    ("lclavicle", "thorax", (3.3, 0.5, 0), "0 0 0", "ry rz"), ("lhumerus", "lclavicle", (5.2, 0, 0), "180 30 90", "rx ry rz"),
    ("lradius", "lhumerus", (3.4, 0, 0), "180 30 90", "rx"), ("lwrist", "lradius", (1.6, 0, 0), "180 30 90", "ry"),
    ("lhand", "lwrist", (0.8, 0, 0), "180 30 90", "rx rz"), ("lfingers", "lhand", (0.6, 0, 0), "180 30 90", "rx"),
    ("lthumb", "lwrist", (0.6, 0, 0.6), "-90 -45 0", "rx rz"),
    ("rclavicle", "thorax", (-3.3, 0.5, 0), "0 0 0", "ry rz"), ("rhumerus", "rclavicle", (-5.2, 0, 0), "180 -30 -90", "rx ry rz"),
    ("rradius", "rhumerus", (-3.4, 0, 0), "180 -30 -90", "rx"), ("rwrist", "rradius", (-1.6, 0, 0), "180 -30 -90", "ry"),
    ("rhand", "rwrist", (-0.8, 0, 0), "180 -30 -90", "rx rz"), ("rfingers", "rhand", (-0.6, 0, 0), "180 -30 -90", "rx"),
    ("rthumb", "rwrist", (-0.6, 0, 0.6), "-90 45 0", "rx rz"),
)  # fmt: skip
HIP_HEIGHT = 7.5 + 7.3 + 1.2  # of someone who stands on the soles


def rows(*frames: tuple[float, ...]) -> str:
    """Return a motion of the arm: ten values a frame."""
    told = "".join(f"{number}\n{ROWS.format(*values)}" for number, values in enumerate(frames, start=1))
    return f"#!OML:ASF arm.asf\n:FULLY-SPECIFIED\n:DEGREES\n{told}"


def write_arm(folder: Path, motion: str, skeleton: str = ARM, name: str = "arm_01") -> Path:
    """Write an arm and its motion; return the motion's file."""
    (folder / "arm.asf").write_text(skeleton)
    (folder / f"{name}.amc").write_text(motion)
    return folder / f"{name}.amc"


def write_person(folder: Path, bends: dict[str, str], frames: int = 120, scale: float = 1.0, length: str = "0.45") -> Path:
    """Write a person and a motion who holds a pose; return the motion's file.

    Args:
        folder: Where the files go.
        bends: Bone -> its values in all frames; those of the others are zero.
        frames: Number of frames.
        scale: Factor of all lengths.
        length: Unit of length that the skeleton states.
    """
    bones = "".join(
        f"begin\nid {number}\nname {name}\ndirection {' '.join(str(part / float(np.linalg.norm(end))) for part in end)}\n"
        f"length {scale * float(np.linalg.norm(end))}\naxis {axis} XYZ\n{f'dof {freedom}' if freedom else ''}\nend\n"
        for number, (name, _, end, axis, freedom) in enumerate(PERSON, start=1)
    )
    tree = "".join(f"{parent} {name}\n" for name, parent, *_ in PERSON)
    head = ARM[: ARM.index(":bonedata")].replace("length 0.45", f"length {length}")
    (folder / "05.asf").write_text(f"{head}:bonedata\n{bones}:hierarchy\nbegin\n{tree}end\n")
    still = {name: " ".join("0" for _ in freedom.split()) for name, _, _, _, freedom in PERSON if freedom} | bends
    row = f"root 0 {scale * HIP_HEIGHT} 0 0 0 0\n" + "".join(f"{name} {values}\n" for name, values in still.items())
    (folder / "05_12.amc").write_text(":FULLY-SPECIFIED\n:DEGREES\n" + "".join(f"{frame}\n{row}" for frame in range(1, frames + 1)))
    return folder / "05_12.amc"


def mutate_acclaim(text: bytes, rng: np.random.Generator) -> bytes:
    """Return an ASF or AMC file after damage of any text, or of its own kinds."""
    return mutate(text, rng) if rng.integers(2) else _MUTATIONS[rng.integers(len(_MUTATIONS))](text, rng)


def _swap_names(text: bytes, rng: np.random.Generator) -> bytes:
    """Exchange words all over the file: circles, bones twice or nowhere, other degrees of freedom."""
    words = (b"root", b"upper", b"lower", b"rx", b"tz", b"deg", b"XYZ", b"begin", b"end", b":hierarchy", b"l")
    one, other = rng.integers(len(words), size=2)
    return text.replace(words[one], words[other], int(rng.integers(1, 4)))


def _many_bones(text: bytes, rng: np.random.Generator) -> bytes:
    """Add thousands of bones, beside or under each other."""
    count = int(rng.integers(1, 5000))
    bones = b"".join(b"begin\nname b%d\nlength 1\ndirection 0 1 0\nend\n" % number for number in range(count))
    chain = bool(rng.integers(2))
    tree = b"".join(b"%s b%d\n" % (b"b%d" % (number - 1) if chain and number else b"upper", number) for number in range(count))
    return text.replace(b":hierarchy\n  begin\n", bones + b":hierarchy\nbegin\n" + tree)


def _many_frames(text: bytes, rng: np.random.Generator) -> bytes:
    """Add frames without a row, or with the last row alone."""
    row = text.rstrip().rpartition(b"\n")[2] if rng.integers(2) else b""
    return text + (b"7\n" + row + b"\n") * int(rng.integers(1, 2000))


def _wild_number(text: bytes, rng: np.random.Generator) -> bytes:
    numbers = (b"1e300", b"nan", b"-inf", b"1e999", b"0x10", b"-", b"1_0", b"9" * 500)
    return text.replace((b" 0", b" 1", b" 90", b"\n1\n")[rng.integers(4)], b" " + numbers[rng.integers(len(numbers))] + b"\n", 1)


_MUTATIONS = (_swap_names, _many_bones, _many_frames, _wild_number)


def mutate_numbers(text: bytes, rng: np.random.Generator) -> bytes:
    """Return an ASF or AMC file with up to five other words, mostly numbers, which goes deeper than the parser."""
    words = text.split(b" ")
    for place in rng.integers(len(words), size=rng.integers(1, 6)):
        words[place] = (b"0", b"1e6", b"-1e6", b"1e-300", b"nan", b"90", b"180", b"0\n")[rng.integers(8)]
    return b" ".join(words)
