"""Files that a browser sends: taken into one folder under a harmless name, once they have been read."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from configs.errors import InputError
from datasets.formats.motion_file import AMC_SUFFIX, FORMATS_IN_WORDS, is_motion_file

SKELETON_SUFFIX = ".asf"  # which AMC files need beside them
MAX_UPLOAD_BYTES = 512 * 2**20
MAX_STEM = 80  # characters of a file's name without its suffix


def harmless_name(sent: str) -> str:
    """Return a file's name that a browser sent, without folders and without characters that mean anything to a system.

    Raises:
        InputError: If it is no motion file's name.
    """
    name = Path(sent.replace("\\", "/")).name
    stem = "".join(letter if letter.isalnum() or letter in " ._-()" else "_" for letter in Path(name).stem).strip(" .")[:MAX_STEM]
    suffix = Path(name).suffix.lower()
    if not is_motion_file(Path(f"a{suffix}")) and suffix != SKELETON_SUFFIX:
        shown = "".join(letter if letter.isprintable() else "?" for letter in name)[:MAX_STEM]
        raise InputError(f"{shown or 'the file'}: no {FORMATS_IN_WORDS} file; a clip to clean is one")
    return f"{stem or 'clip'}{suffix}"


@contextmanager
def received_file(sent: str, content: bytes, folder: Path) -> Iterator[Path]:
    """Yield a file that a browser sent, in a folder that is gone afterwards; ``keep_file`` keeps it.

    Args:
        sent: Name that the browser sent.
        content: Contents.
        folder: Folder of the files that were kept, whose skeletons an AMC file may need.

    Raises:
        InputError: If it is no motion file, empty or too large.
    """
    name = harmless_name(sent)
    if not 0 < len(content) <= MAX_UPLOAD_BYTES:
        raise InputError(f"{name}: {len(content)} bytes, should be a file of 1 to {MAX_UPLOAD_BYTES} bytes")
    with TemporaryDirectory(prefix="adapt-mimic-") as temporary:
        path = Path(temporary) / name
        path.write_bytes(content)
        if path.suffix == AMC_SUFFIX and folder.is_dir():
            for skeleton in folder.glob(f"*{SKELETON_SUFFIX}"):
                shutil.copy(skeleton, path.with_name(skeleton.name))
        yield path


def keep_file(path: Path, folder: Path) -> Path:
    """Copy a file into a folder, made where it is missing, and return it there; another file of its name gets no other contents."""
    folder.mkdir(parents=True, exist_ok=True)
    content, number = path.read_bytes(), 1
    while True:
        kept = folder / (path.name if number == 1 else f"{path.stem}-{number}{path.suffix}")
        if not kept.exists():
            kept.write_bytes(content)
            return kept
        if kept.is_file() and kept.read_bytes() == content:
            return kept
        number += 1
