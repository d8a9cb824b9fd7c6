"""Seeded damage to mapping files, for the tests of what reads them."""

import numpy as np

from datasets.motion.humanoid import BODY_NAMES
from tests.builders import MIXAMO, joint_name
from tests.datasets.formats.bvh_fuzzer import mutate

VALUES = (
    b"", b"~", b"[]", b"{}", b"[Hips, Head]", b"{a: 1}", b"1", b"-1", b"nan", b".nan", b".inf", b"1e400", b"true", b"2026-01-01",
    b"!!binary aGk=",
    b"!!python/object/apply:os.getcwd []", b"&a [*a]", b"*a", b"'x\\ny'", b'"x\\ny\\u2028"', b"Hips", b"Head", b"LeftArm", b"z", b"-y",
    b"0.01", b"9" * 5000, b"0x" + b"f" * 400, b"\xff",
)  # fmt: skip
KEYS = (
    b"head", b"unit", b"up", b"thigh_l", b"1", b"~", b"[a, b]", b"{a: b}", b"? x", b"!!set {a}", b".nan", b"nobody", b"'a\\nb'", b'"a\\nb"',
    b"<<",
)  # fmt: skip
# Each list holds the one before nine times: short in the file, endless for who writes it out
ALIASES = [b"head: &a [x,x,x,x,x,x,x,x,x]", *(b"k%d: &%c [%s]" % (n, 98 + n, b",".join([b"*%c" % (97 + n)] * 9)) for n in range(9))]


def whole_mapping() -> bytes:
    """Return a mapping file that names the joints of ``tests.builders.as_bvh``."""
    return "".join(f"{body}: {joint_name(body, MIXAMO)}\n" for body in BODY_NAMES).encode() + b"unit: 0.01\nup: y\n"


def mutate_mapping(text: bytes, rng: np.random.Generator) -> bytes:
    """Return a mapping file after damage of any text, or of its own kinds."""
    if rng.integers(4) == 0:
        return mutate(text, rng)
    lines = text.split(b"\n")
    for place in rng.integers(len(lines) - 1, size=rng.integers(1, 4)):
        key, _, value = lines[place].partition(b": ")
        key = KEYS[rng.integers(len(KEYS))] if rng.integers(4) == 0 else key
        lines[place] = key + b": " + (VALUES[rng.integers(len(VALUES))] if rng.integers(2) else value)
    if rng.integers(10) == 0:
        lines += ALIASES if rng.integers(2) else [b"head: " + b"[" * int(rng.integers(1, 5000))]
    return b"\n".join(lines)
