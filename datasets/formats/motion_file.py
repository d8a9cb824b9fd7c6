"""Motion files of every format that can be read or written, told apart by suffix: the one place that knows the suffixes."""

import os
from collections.abc import Callable
from pathlib import Path

from configs.errors import InputError
from datasets.formats.asf_amc import read_asf_amc, skeletons_beside
from datasets.formats.blender_runner import check_blender
from datasets.formats.blender_scene import SCENE_SUFFIXES, read_scene, write_scene
from datasets.formats.bvh import Bvh, read_bvh, write_bvh
from datasets.formats.made_scene import make_scene
from datasets.formats.mvnx import read_mvnx_as_bvh
from datasets.formats.mvnx_writer import write_mvnx

BVH_SUFFIX, MVNX_SUFFIX, AMC_SUFFIX = ".bvh", ".mvnx", ".amc"
READABLE_SUFFIXES = (MVNX_SUFFIX, BVH_SUFFIX, AMC_SUFFIX, *SCENE_SUFFIXES)  # of several files of one name the first holds most
_FORMATS = [suffix[1:].upper() for suffix in (BVH_SUFFIX, *(other for other in READABLE_SUFFIXES if other != BVH_SUFFIX))]
FORMATS_IN_WORDS = f"{', '.join(_FORMATS[:-1])} or {_FORMATS[-1]}"


def _write_bvh(path: Path, bvh: Bvh, _: Path) -> tuple[str, ...]:
    write_bvh(path, bvh)
    return ()


def _write_scene(path: Path, bvh: Bvh, source: Path) -> tuple[str, ...]:
    return write_scene(path, bvh, source) if _is_scene(source) else make_scene(path, bvh)


def _is_scene(path: Path) -> bool:
    return path.suffix.lower() in SCENE_SUFFIXES


_WRITERS: dict[str, Callable[[Path, Bvh, Path], tuple[str, ...]]] = {
    BVH_SUFFIX: _write_bvh,
    MVNX_SUFFIX: write_mvnx,
    **dict.fromkeys(SCENE_SUFFIXES, _write_scene),
}


def is_motion_file(path: Path) -> bool:
    """Return whether a file's name is that of a motion file that can be read."""
    return path.suffix.lower() in READABLE_SUFFIXES


def files_beside(path: Path) -> list[Path]:
    """Return the files that reading a motion file may depend on: the skeletons beside an AMC file."""
    return skeletons_beside(path) if path.suffix.lower() == AMC_SUFFIX else []


def can_write(path: Path, source: Path) -> bool:
    """Return whether a file with the suffix of ``path`` can be written of a clip that was read from ``source``.

    Every clip can be written as BVH, and as FBX or glTF: as a copy of the recorded scene, or as one that is made. MVNX is only written as a
    copy of a recorded MVNX.
    """
    return path.suffix.lower() in writable_suffixes(source)


def writable_suffixes(source: Path) -> list[str]:
    """Return the suffixes of the formats in which a clip from ``source`` can be written, its own first where that is one."""
    own = source.suffix.lower()
    every = (BVH_SUFFIX, *SCENE_SUFFIXES)
    if own in SCENE_SUFFIXES:
        every = (*SCENE_SUFFIXES, BVH_SUFFIX)
    return list(dict.fromkeys([*([own] if own in _WRITERS else []), *every]))


def suffixes_without_blender(source: Path) -> list[str]:
    """Return those of ``writable_suffixes`` for which no Blender is needed."""
    return [suffix for suffix in writable_suffixes(source) if suffix not in SCENE_SUFFIXES]


def suffixes_in_words(source: Path) -> str:
    """Return the suffixes of ``writable_suffixes``, as ".bvh, .fbx, .glb or .gltf"."""
    suffixes = writable_suffixes(source)
    return f"{', '.join(suffixes[:-1])} or {suffixes[-1]}"


def check_writer(path: Path, source: Path) -> None:
    """Check before the work that what writes a format is installed: Blender, where a scene is made of a clip that came as none.

    Raises:
        InputError: If it is not; says how to install it.
    """
    if _is_scene(path) and not _is_scene(source):
        check_blender(path)


def missing_scene_writer() -> str:
    """Return why FBX and glTF cannot be written here, with what would help; "" where they can."""
    file = Path(f"clip{SCENE_SUFFIXES[0]}")
    try:
        check_blender(file)
    except InputError as error:
        return str(error).removeprefix(f"{file}: ")
    return ""


def read_motion_file(
    path: str | os.PathLike[str], figure: int | None = None, skeleton: Path | None = None, fps: float | None = None
) -> Bvh:
    """Read and check a motion file; a file of an unknown suffix is read as BVH.

    Args:
        path: BVH, MVNX, AMC, FBX, GLB or glTF file.
        figure: Number of the figure to read, from 1, in a BVH or MVNX file or a scene with several.
        skeleton: ASF file of an AMC file, None to find it beside that.
        fps: Frame rate that the user gave [1/s], for BVH and AMC files, whose own may lack or be wrong.

    Returns:
        Contents of the file in the terms of BVH, with notices of what was guessed or mended.

    Raises:
        InputError: If the file cannot be read or is broken; names it.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix == MVNX_SUFFIX:
        return read_mvnx_as_bvh(path, figure)
    if suffix == AMC_SUFFIX:
        return read_asf_amc(path, skeleton, fps)
    if suffix in SCENE_SUFFIXES:
        return read_scene(path, figure)
    return read_bvh(path, figure, fps)


def write_motion_file(path: str | os.PathLike[str], bvh: Bvh, source: str | os.PathLike[str]) -> tuple[str, ...]:
    """Write a clip in the format of the suffix; an older file is replaced whole or not at all.

    Args:
        path: File to write.
        bvh: Clip; for an FBX or glTF of another format with its unit and up axis stated, as ``CleaningSession.write`` states them.
        source: File that the clip was read from, which gives what ``bvh`` does not hold.

    Returns:
        Lines for the user on what of the written file is not the clip's.

    Raises:
        InputError: If this format cannot be written of a clip from this source, or the file cannot be written there.
    """
    path, source = Path(path), Path(source)
    if not can_write(path, source):
        raise InputError(f"{path}: {source.name} can only be written as {suffixes_in_words(source)}; give a name that ends so")
    return _WRITERS[path.suffix.lower()](path, bvh, source)
