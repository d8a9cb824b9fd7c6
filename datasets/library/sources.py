"""Motion sources (a motion file, a folder of them, or the word "synthetic") as clips on the 20 bodies at one frame rate."""

import csv
import os
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from configs.errors import InputError
from configs.process_pool import map_on_cores
from datasets.formats.motion_file import FORMATS_IN_WORDS, READABLE_SUFFIXES, is_motion_file
from datasets.imu.recording import measured_accelerations
from datasets.motion.clip import FPS, BodyMotion
from datasets.motion.kinematics import resample
from datasets.performer.performer_clip import load_recording
from datasets.performer.reading_options import ReadingOptions
from datasets.retarget.plausibility import find_implausible
from datasets.retarget.retarget import retarget

SYNTHETIC_SOURCE = "synthetic"
INDEX_FILENAME = "motions.csv"
ROUGH_GROUND_KINDS = ("stairs", "steps", "climb")  # of motion that needs other ground than level
KINDS = (
    "walk", "run", "dash", "jog", "jump", "hop", "kick", "punch", "martial", "salsa", "dance", "indian", "bow", "bye",
    "wave", "raise", "squat", "sit", "stand", "turn", "crawl", "throw",
)  # words in a file's name, of which the first counts  # fmt: skip


@dataclass(frozen=True)
class SourceMotion:
    """One clip of a source.

    Attributes:
        clip: Clip on the 20 bodies.
        accelerations: Free accelerations measured by the suit, in the clip's world, at 100 Hz [m/s^2], shape (N, 19, 3); None if the
            file holds none.
        notices: Lines on what was guessed or mended of its file, or looks wrong.
    """

    clip: BodyMotion
    accelerations: np.ndarray | None = None
    notices: tuple[str, ...] = ()


@dataclass(frozen=True)
class Credit:
    """Origin of a clip.

    Attributes:
        performer: Name of the performer.
        system: Capture system, see ``BodyMotion``.
        kind: Kind of motion.
    """

    performer: str
    system: str
    kind: str


def _say(line: str) -> None:
    """Print a line for the user on standard error."""
    print(line, file=sys.stderr)


def load_clips(
    source: str | os.PathLike[str],
    reading: ReadingOptions | None = None,
    fps: float = FPS,
    seed: int = 0,
    progress: Callable[[Sequence[Any]], Iterable[Any]] = iter,
    say: Callable[[str], None] = _say,
) -> list[BodyMotion]:
    """Return the clips of a motion source; arguments and errors are those of ``load_source_motions``."""
    return [one.clip for one in load_source_motions(source, reading, fps, seed, progress, say)]


def load_source_motions(
    source: str | os.PathLike[str],
    reading: ReadingOptions | None = None,
    fps: float = FPS,
    seed: int = 0,
    progress: Callable[[Sequence[Any]], Iterable[Any]] = iter,
    say: Callable[[str], None] = _say,
) -> list[SourceMotion]:
    """Return the clips of a motion source, with the accelerations that an MVNX file holds.

    Args:
        source: Motion file, folder of them (searched with its subfolders, in the order of paths), or "synthetic".
        reading: Known joints, unit and axes of all the files; the rest is detected.
        fps: Frame rate of the returned clips [1/s].
        seed: Seed of synthetic motion.
        progress: Wraps the loop over the files, such as a progress bar.
        say: Called with a line for each broken file of a folder, which is left out, and with one on all that was guessed or mended.

    Returns:
        Clips on the 20 bodies with unique names, credited by the ``motions.csv`` of the folder or of one above it.

    Raises:
        InputError: If there is no motion, or the file, or every file of the folder, is broken; names the file.
    """
    if str(source) == SYNTHETIC_SOURCE:
        from datasets.synthetic.clips import synthetic_clips  # slow to make, so not imported by those who read files

        return [SourceMotion(resample(clip, fps)) for clip in synthetic_clips(seed=seed)]
    paths = find_motion_files(source)
    read, broken = [], []
    for path, one in zip(paths, map_on_cores(partial(_read, reading=reading, fps=fps), paths, progress), strict=True):
        if isinstance(one, SourceMotion):
            read.append((path, one))
        else:
            broken.append(one)
    if broken and Path(source).is_file():
        raise broken[0]
    for error in broken:
        say(f"{error}; left out")
    if not read:
        raise InputError(f"{source}: none of {len(paths)} motion files can be read, see above")
    if line := notices_line(read, source):
        say(line)
    names, index = unique_names([path for path, _ in read]), read_index(paths[0])
    recordings = []
    for (path, one), name in zip(read, names, strict=True):
        by = credit(path, index)
        system = "imu" if one.accelerations is not None else by.system
        recordings.append(replace(one, clip=replace(one.clip, name=name, performer=by.performer, system=system, kind=by.kind)))
    return recordings


def notices_line(read: Sequence[tuple[Path, SourceMotion]], source: str | os.PathLike[str]) -> str:
    """Return the line on all that was guessed or mended in files of a source, with the command that tells the rest; empty if nothing."""
    noticed = [(path, one.notices[0]) for path, one in read if one.notices]
    if not noticed:
        return ""
    some = f"{len(noticed)} of {len(read)} files were read with something guessed or mended, or look wrong"
    return f"{source}: {some}, such as {noticed[0][0].name}: {noticed[0][1]} All lines: python -m datasets.describe {source}"


def _read(path: Path, reading: ReadingOptions | None, fps: float) -> SourceMotion | InputError:
    """Return the clip of a file with its accelerations, or what is wrong with the file."""
    try:
        bvh, performer_clip = load_recording(path, reading)
        retargeted = retarget(performer_clip)
    except InputError as error:
        return InputError(str(error))  # one of another class may not travel between processes
    clip = resample(retargeted.motion, fps)
    notices = (*performer_clip.notices, *find_implausible(retargeted))
    return SourceMotion(clip, measured_accelerations(bvh, retargeted, clip), notices)


def find_motion_files(source: str | os.PathLike[str]) -> list[Path]:
    """Return the motion files of a source, sorted by path; of files of one name in one folder only that whose format holds most.

    Raises:
        InputError: If there are none.
    """
    path = Path(source)
    if not path.exists():
        raise InputError(
            f"{path}: no such file or folder; a motion source is a {FORMATS_IN_WORDS} file, a folder of them, or '{SYNTHETIC_SOURCE}'"
        )
    if path.is_file():
        return [path]
    files = find_readable_files(path)
    richest = {file.with_suffix(""): file for suffix in READABLE_SUFFIXES[::-1] for file in files if file.suffix.lower() == suffix}
    return sorted(richest.values())


def find_readable_files(folder: Path) -> list[Path]:
    """Return all motion files in a folder and its subfolders, sorted by path.

    Raises:
        InputError: If there are none.
    """
    files = sorted(file for file in folder.rglob("*") if is_motion_file(file) and file.is_file())
    if not files:
        raise InputError(f"{folder}: no {FORMATS_IN_WORDS} file here or below")
    return files


def read_index(path: Path) -> dict[Path, Credit]:
    """Return the credits of the ``motions.csv`` nearest above ``path``, by path; none if there is no such file.

    Raises:
        InputError: If the index lacks a column.
    """
    folder = next((folder for folder in path.resolve().parents if (folder / INDEX_FILENAME).is_file()), None)
    if folder is None:
        return {}
    with (folder / INDEX_FILENAME).open(encoding="utf-8", newline="") as file:
        rows = csv.DictReader(file)
        missing = {"path", "system", "subject", "motion"} - set(rows.fieldnames or ())
        if missing:
            raise InputError(
                f"{folder / INDEX_FILENAME}: lacks the column {', '.join(sorted(missing))}; path, system, subject, motion are needed"
            )
        return {(folder / row["path"]).resolve(): Credit(row["subject"], row["system"], _kind(row["motion"])) for row in rows}


def credit(path: Path, index: dict[Path, Credit]) -> Credit:
    """Return the credit of a file from the index, else from its name: the performer of "anna_walk_02.bvh" is "anna_walk"."""
    known = index.get(path.resolve())
    stem = re.sub(r"[\W_]*\d+$", "", path.stem) or path.stem
    return known or Credit(stem, "unknown", _kind(path.stem))


def _kind(text: str) -> str:
    """Return the kind of motion named in a text: one on rough ground wherever it stands ("walk up stairs"), else the first."""
    text = text.lower()
    rough = [kind for kind in ROUGH_GROUND_KINDS if kind in text]
    if rough:
        return rough[0]
    found = [(text.find(kind), kind) for kind in KINDS if kind in text]
    return min(found)[1] if found else "unknown"


def unique_names(files: list[Path]) -> list[str]:
    """Return the files' stems; with their folder, or their whole path, in front where others have the same."""
    stems, longer = [file.stem for file in files], [f"{file.parent.name}/{file.stem}" for file in files]
    return [
        stem if stems.count(stem) == 1 else name if longer.count(name) == 1 else str(file)
        for file, stem, name in zip(files, stems, longer, strict=True)
    ]
