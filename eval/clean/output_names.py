"""Where clean clips and their reports go: beside each other in a folder, under the names of their recordings."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from configs.errors import InputError
from datasets.formats.motion_file import (
    FORMATS_IN_WORDS,
    can_write,
    check_writer,
    is_motion_file,
    suffixes_in_words,
    writable_suffixes,
)
from datasets.library.sources import find_readable_files


def pair_inputs_with_outputs(source: Path, target: Path) -> Iterator[tuple[Path, Path]]:
    """Return each motion file of a source, a file or a folder, and where its clean clip goes.

    The clip of a file in a folder keeps the file's name and format; it becomes a BVH where that format cannot be written.

    Raises:
        InputError: If there is none, or the target cannot take it.
    """
    if not source.exists():
        raise InputError(f"{source}: no such file or folder; name a {FORMATS_IN_WORDS} file or a folder of them")
    if source.is_dir():
        yield from pair_folder(source, target, find_readable_files(source))
        return
    if not is_motion_file(source):
        raise InputError(f"{source}: no {FORMATS_IN_WORDS} file; a clip to clean is one")
    if target.is_dir() or not can_write(target, source):
        what = "a folder" if target.is_dir() else f"no {suffixes_in_words(source)} file"
        example = target / source.with_suffix(writable_suffixes(source)[0]).name
        raise InputError(f"--out {target} is {what}, should be a file's name such as {example}")
    if target.resolve() == source.resolve():
        raise InputError(f"--out {target} is the clip itself, should be another file's name")
    check_writer(target, source)
    yield source, target


def pair_folder(source: Path, target: Path, found: Sequence[Path]) -> list[tuple[Path, Path]]:
    """Return each of the files found in a folder, but what was cleaned before, and where its clean clip goes.

    Raises:
        InputError: If the target cannot take them.
    """
    if target.is_file() or is_motion_file(target):
        raise InputError(f"--out {target} is a file's name, should be a folder's, for the clips of {source}")
    if target.resolve() == source.resolve():
        raise InputError(f"--out {target} is the folder of the clips itself, should be another one")
    files = [file for file in found if target.resolve() not in file.resolve().parents]
    names = [file.relative_to(source) for file in files]
    return [(file, target / output_name(name, names)) for file, name in zip(files, names, strict=True)]


def output_name(name: Path, names: Sequence[Path]) -> Path:
    """Return the name of a clean clip: the recording's, as a BVH if its format cannot be written; "a.amc.bvh" where others are called a."""
    if can_write(name, name):
        return name
    suffix = writable_suffixes(name)[0]
    same = [other for other in names if other.with_suffix("") == name.with_suffix("")]
    return name.with_suffix(suffix) if len(same) == 1 else name.with_name(name.name + suffix)


def page_name(out: Path, every: Sequence[Path]) -> Path:
    """Return the name of a clip's report: its file's without suffix, unless files differ in nothing else."""
    bare = out.with_suffix("")
    return bare if [each.with_suffix("") for each in every].count(bare) == 1 else out
