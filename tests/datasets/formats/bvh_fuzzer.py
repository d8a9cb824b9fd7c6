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


def mutate_gently(text: bytes, rng: np.random.Generator) -> bytes:
    """Return a BVH file after one to three changes that leave it whole: other numbers, names or frames, which go deeper than the parser."""
    for index in rng.integers(len(GENTLE_MUTATIONS), size=rng.integers(1, 4)):
        text = GENTLE_MUTATIONS[index](text, rng)
    return text


def _rows(text: bytes) -> tuple[bytes, np.ndarray]:
    """Return what is before the rows of a whole file, and their numbers (T, C)."""
    lines = text.rstrip().split(b"\n")
    first = max(number for number, line in enumerate(lines) if line.startswith(b"Frame Time")) + 1
    return b"\n".join(lines[:first]), np.array([line.split() for line in lines[first:]], dtype=float)


def _with_rows(head: bytes, values: np.ndarray) -> bytes:
    before, frames, after = head.rpartition(b"\nFrames:")
    head = before + frames + b" %d\n" % len(values) + after.partition(b"\n")[2]
    return b"\n".join([head, *(" ".join(map(repr, row)).encode() for row in values.tolist()), b""])


def _part_of_rows(values: np.ndarray, rng: np.random.Generator) -> tuple[slice, np.ndarray]:
    """Return a span of frames, one or many, and some of the columns, one, all or any."""
    first, last = sorted(rng.integers(len(values) + 1, size=2))
    columns = (rng.integers(values.shape[1], size=1), np.arange(values.shape[1]), np.flatnonzero(rng.random(values.shape[1]) < 0.3))
    return slice(first, max(last, first + 1) if rng.integers(2) else first + 1), columns[rng.integers(3)]


def _other_values(text: bytes, rng: np.random.Generator) -> bytes:
    """Make channels of some frames constant, huge, tiny, wild, or turn them round."""
    head, values = _rows(text)
    frames, columns = _part_of_rows(values, rng)
    own = values[frames][:, columns]
    number = float((0.0, 90.0, 180.0, -1e6, 1e6, 1e-300, 5e-324)[rng.integers(7)])
    changed = (np.full_like(own, number), own * rng.normal(), own + rng.normal(0, 100, own.shape), own[::-1])[rng.integers(4)]
    values[np.ix_(np.arange(len(values))[frames], columns)] = np.clip(changed, -1e6, 1e6)
    return _with_rows(head, values)


def _no_number(text: bytes, rng: np.random.Generator) -> bytes:
    head, values = _rows(text)
    frames, columns = _part_of_rows(values, rng)
    values[np.ix_(np.arange(len(values))[frames], columns)] = (np.nan, np.inf)[rng.integers(2)]
    return _with_rows(head, values)


def _other_frames(text: bytes, rng: np.random.Generator) -> bytes:
    """Keep few frames, repeat them, or hold one."""
    head, values = _rows(text)
    few = values[: rng.integers(1, 8)]
    held = np.concat([values, np.repeat(values[-1:], rng.integers(1, 300), axis=0)])
    return _with_rows(head, (few, np.concat([values, values]), held, np.repeat(values[:1], len(values), axis=0))[rng.integers(4)])


def _other_time(text: bytes, rng: np.random.Generator) -> bytes:
    times = (b"0.001", b"1", b"0.0001", b"0.9999", b"0.04", b"1e-4")
    return text.replace(b"Frame Time: ", b"Frame Time: " + times[rng.integers(len(times))] + b"\nFrame Time: ", rng.integers(2))


def _other_offsets(text: bytes, rng: np.random.Generator) -> bytes:
    """Make one offset, or all in a part of the file, zero, tiny, huge or other."""
    lines = text.split(b"\n")
    places = [number for number, line in enumerate(lines) if line.strip().startswith(b"OFFSET")]
    first, last = sorted(rng.integers(len(places) + 1, size=2))
    for place in places[first : max(last, first + 1) if rng.integers(2) else first + 1]:
        words = (b"0 0 0", b"1e-300 0 0", b"1e6 1e6 1e6", b"1e-9 1e-9 0", b"%f %f %f" % tuple(rng.normal(0, 30, 3)))
        lines[place] = b"OFFSET " + words[rng.integers(len(words))]
    return b"\n".join(lines)


def _other_names(text: bytes, rng: np.random.Generator) -> bytes:
    """Give a joint the name of another one, no telling one, or a side that it has not."""
    lines = text.split(b"\n")
    places = [number for number, line in enumerate(lines) if line.strip().startswith((b"JOINT", b"ROOT"))]
    for place in rng.choice(places, size=rng.integers(1, 4)):
        kind = lines[place].split()[0]
        other = (lines[rng.choice(places)].split(maxsplit=1)[1], b"x", b"Left", b"\x07", b"%" * 80, "Bein\u2028L".encode())
        lines[place] = kind + b" " + other[rng.integers(len(other))]
    return b"\n".join(lines)


GENTLE_MUTATIONS: tuple[Mutation, ...] = (_other_values, _no_number, _other_frames, _other_time, _other_offsets, _other_names)
