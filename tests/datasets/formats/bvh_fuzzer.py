"""Seeded damage to BVH files, for the tests of the parser."""

from collections.abc import Callable

import numpy as np

Mutation = Callable[[bytes, np.random.Generator], bytes]
WORDS = (
    b"nan",
    b"-inf",
    b"1e999",
    b"1.#QNAN",
    b"1,5",
    b"1,2,3",
    b"-",
    b"--3",
    b"# ",
    b"EndSite",
    b"9" * 400,
    b"9" * 6000,
    b"{",
    b"}",
    b"\x00",
    b"\xff\xfe",
    b"JOINT",
    b"End Site",
)
COUNTS = (b"0", b"-1", b"1", b"7", b"1.5", b"nan", b"2147483648", b"5000000000", b"9" * 30, b"1e9", b"0,04", b"")
NAMES = ("Schädel", "左腕ボーン", "Ä左", "\U0001f9b4")
ENCODINGS = ("utf-16", "utf-16-le", "utf-16-be", "utf-32", "cp932", "latin-1", "utf-8-sig", "utf-7")


def mutate(text: bytes, rng: np.random.Generator) -> bytes:
    """Return the file after one to three kinds of damage."""
    for index in rng.integers(len(MUTATIONS), size=rng.integers(1, 4)):
        text = MUTATIONS[index](text, rng)
    return text


def _truncate(text: bytes, rng: np.random.Generator) -> bytes:
    return text[: rng.integers(len(text) + 1)]


def _cut_out(text: bytes, rng: np.random.Generator) -> bytes:
    first, last = sorted(rng.integers(len(text) + 1, size=2))
    return text[:first] + text[last:]


def _replace_word(text: bytes, rng: np.random.Generator) -> bytes:
    words = text.split(b" ")
    words[rng.integers(len(words))] = WORDS[rng.integers(len(WORDS))]
    return b" ".join(words)


def _replace_byte(text: bytes, rng: np.random.Generator) -> bytes:
    damaged = bytearray(text)
    for place in rng.integers(len(text), size=5) if text else ():
        damaged[place] = rng.integers(256)
    return bytes(damaged)


def _replace_count(text: bytes, rng: np.random.Generator) -> bytes:
    """Damage what stands behind one of the keywords that promise something."""
    lines = text.split(b"\n")
    promising = [i for i, line in enumerate(lines) if line.strip().startswith((b"Frame", b"CHANNELS", b"OFFSET"))]
    if promising:
        chosen = promising[rng.integers(len(promising))]
        words = lines[chosen].split()
        words[rng.integers(1, len(words)) if len(words) > 1 else 0] = COUNTS[rng.integers(len(COUNTS))]
        lines[chosen] = b" ".join(words)
    return b"\n".join(lines)


def _drop_line(text: bytes, rng: np.random.Generator) -> bytes:
    lines = text.split(b"\n")
    del lines[rng.integers(len(lines))]
    return b"\n".join(lines)


def _repeat_lines(text: bytes, rng: np.random.Generator) -> bytes:
    lines = text.split(b"\n")
    first, last = sorted(rng.integers(len(lines) + 1, size=2))
    return b"\n".join(lines[:last] + lines[first:])


def _swap_lines(text: bytes, rng: np.random.Generator) -> bytes:
    lines = text.split(b"\n")
    one, other = rng.integers(len(lines), size=2)
    lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


def _nest(text: bytes, rng: np.random.Generator) -> bytes:
    """Open thousands of joints inside each other, with names of their own or the same one."""
    depth, same = int(rng.integers(1, 5000)), rng.integers(2)
    joints = b"".join(b"JOINT j%d\n{\nOFFSET 0 1 0\nCHANNELS 0\n" % (0 if same else number) for number in range(depth))
    return text.replace(b"End Site", joints + b"End Site", 1)


def _widen(text: bytes, rng: np.random.Generator) -> bytes:
    """Hang thousands of joints or end sites side by side."""
    one = (b"JOINT w%d { OFFSET 0 1 0 }\n", b"End Site { OFFSET 0 %d 0 }\n")[rng.integers(2)]
    return text.replace(b"End Site", b"".join(one % number for number in range(int(rng.integers(1, 5000)))) + b"End Site", 1)


def _noise(text: bytes, rng: np.random.Generator) -> bytes:
    place = rng.integers(len(text) + 1)
    return text[:place] + rng.bytes(int(rng.integers(1, 2000))) + text[place:]


def _only_noise(_: bytes, rng: np.random.Generator) -> bytes:
    return rng.bytes(int(rng.integers(0, 5000)))


def _long_line(text: bytes, rng: np.random.Generator) -> bytes:
    place = rng.integers(len(text) + 1)
    filler = (b" ", b"0", b"0 ", b"x")[rng.integers(4)]
    return text[:place] + filler * int(rng.integers(1, 400_000)) + text[place:]


def _recode(text: bytes, rng: np.random.Generator) -> bytes:
    """Write names outside of ASCII, in another encoding and perhaps under another one's mark."""
    named = text.decode("latin-1").replace("Hand", NAMES[rng.integers(len(NAMES))])
    mark = (b"", b"", b"\xff\xfe", b"\xfe\xff", b"\xef\xbb\xbf")[rng.integers(5)]
    return mark + named.encode(ENCODINGS[rng.integers(len(ENCODINGS))], errors="replace")


def _comma(text: bytes, rng: np.random.Generator) -> bytes:
    """Write decimal commas, or commas or tabs between numbers, in all of the file or from somewhere on."""
    place = rng.integers(len(text) + 1) * rng.integers(2)
    old, new = ((b".", b","), (b" ", b","), (b" ", b", "), (b" ", b"\t"))[rng.integers(4)]
    return text[:place] + text[place:].replace(old, new)


def _same_name(text: bytes, rng: np.random.Generator) -> bytes:
    return text.replace((b"Hand", b"Hips")[rng.integers(2)], (b"Arm", b"Arm_2")[rng.integers(2)])


def _more_figures(text: bytes, rng: np.random.Generator) -> bytes:
    """Repeat the hierarchy as that of further figures, one or hundreds, and perhaps their numbers in each row."""
    first, last = text.find(b"ROOT"), text.find(b"MOTION")
    if not 0 <= first < last:
        return text
    count, lines = (1, int(rng.integers(1, 500)))[rng.integers(2)], text[last:].split(b"\n")
    rows = lines[:3] + [b" ".join([line] * (1 + count * int(rng.integers(10) > 0))) for line in lines[3:]]
    return text[:last] + text[first:last] * count + b"\n".join(rows)


def _comment(text: bytes, rng: np.random.Generator) -> bytes:
    lines = text.split(b"\n")
    for place in rng.integers(len(lines) + 1, size=5):
        lines.insert(place, (b"# ", b"//", b"\t; ")[rng.integers(3)] + b"}{ 1 2 3")
    return b"\n".join(lines)


def _missing_values(text: bytes, rng: np.random.Generator) -> bytes:
    """Put what is no number into a tenth of the words after MOTION."""
    head, motion, rows = text.partition(b"MOTION")
    words = rows.split(b" ")
    return head + motion + b" ".join(b"nan" if rng.random() < 0.1 else word for word in words)


def _longer(text: bytes, rng: np.random.Generator) -> bytes:
    """Repeat the last row, whatever is promised, with positions of zero and without a line's end."""
    row = text.rstrip(b"\n").rpartition(b"\n")[2]
    return text + (b"0 0 0 " + row.partition(b" ")[2] + b"\n") * int(rng.integers(1, 500)) + row[: rng.integers(len(row) + 1)]


MUTATIONS: tuple[Mutation, ...] = (
    _truncate,
    _cut_out,
    _replace_word,
    _replace_byte,
    _replace_count,
    _drop_line,
    _repeat_lines,
    _swap_lines,
    _nest,
    _widen,
    _noise,
    _only_noise,
    _long_line,
    _recode,
    _comma,
    _same_name,
    _more_figures,
    _comment,
    _missing_values,
    _longer,
)
