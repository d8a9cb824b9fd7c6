"""Everything that is open in one run of the studio: the folder of clips, uploaded files, the projects of all tabs."""

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path

from configs.errors import InputError
from configs.process_pool import available_cores
from datasets.formats.motion_file import (
    FORMATS_IN_WORDS,
    is_motion_file,
    missing_scene_writer,
    suffixes_without_blender,
    writable_suffixes,
)
from datasets.library.sources import find_readable_files
from datasets.performer.reading_options import ReadingOptions
from eval.clean.edits_file import edits_path
from eval.clean.pipeline import CleaningPipeline
from eval.studio.state.batch import CLEANED
from eval.studio.state.project import Project
from eval.studio.state.saved_files import is_cleaned
from eval.studio.state.uploads import SKELETON_SUFFIX, keep_file, received_file

MAX_LISTED = 500  # files of a folder
MAX_OPEN = 8  # clips that are kept open without a tab that shows them, the newest; their edits are in their files


class Workspace:
    """The clips of one run.

    Attributes:
        folder: Folder whose clips are offered; None where there is none.
        uploads: Folder that files which browsers send are kept in.
    """

    def __init__(self, source: Path | None, uploads: Path, load: Callable[[], CleaningPipeline] | None = None) -> None:
        """Begin to load the networks.

        Args:
            source: Clip or folder of clips; None for neither.
            uploads: Folder that uploaded files are kept in; made with the first of them.
            load: Returns the stages of the cleaning; by default those of the package.

        Raises:
            InputError: If there is no such clip or folder.
        """
        if source is not None and not source.exists():
            raise InputError(f"{source}: no such file or folder; name a {FORMATS_IN_WORDS} file or a folder of them")
        if source is not None and source.is_file() and not is_motion_file(source):
            raise InputError(f"{source}: no {FORMATS_IN_WORDS} file; a clip to clean is one")
        self.uploads = uploads
        self.folder = source if source is not None and source.is_dir() else None
        self.first = source if source is not None and source.is_file() else None
        self._projects: dict[Path, Project] = {}
        self._opened: Path | None = None
        self._lock = threading.RLock()
        threads = ThreadPoolExecutor(2, thread_name_prefix="loading")
        self._pipeline: Future[CleaningPipeline] = threads.submit(load or partial(CleaningPipeline.load, available_cores()))
        self._missing_writer = threads.submit(missing_scene_writer)  # starts another Python, which takes a while
        threads.shutdown(wait=False)

    @property
    def pipeline(self) -> CleaningPipeline:
        """Stages of the cleaning, once they are loaded."""
        return self._pipeline.result()

    @property
    def opened(self) -> Path | None:
        """File of the clip that was opened last, which a new tab shows."""
        return self._opened or self.first

    def formats(self, clip: Path) -> tuple[list[str], str]:
        """Return the suffixes of the formats that a clip can be written in here, its own first, and why not in more; "" where in all."""
        missing = self._missing_writer.result()
        return (suffixes_without_blender(clip) if missing else writable_suffixes(clip)), missing

    def files(self) -> list[Path]:
        """Return the clips that can be opened: those of the folder, and those that were uploaded."""
        found = [file for folder in (self.folder, self.uploads) if folder is not None and folder.is_dir() for file in _clips_in(folder)]
        return list(dict.fromkeys(file.resolve() for file in [*([self.first] if self.first else []), *found]))[:MAX_LISTED]

    def open(self, path: Path, reading: ReadingOptions | None = None) -> Project:
        """Return the project of a file; the same one for all tabs.

        Args:
            path: File.
            reading: What the user says of a file that could not be read without.

        Raises:
            InputError: If the file cannot be read; a ``JointMapError`` if its joints are not found.
        """
        path = path.resolve()
        with self._lock:
            if path not in self._projects:
                self._projects[path] = Project(path, self.pipeline, reading)
                self._projects[path].move(path)  # what was said of it is kept
                self._projects[path].clean(physics=False)
                self._close_old()
            self._opened = path
            return self._projects[path]

    def receive(self, name: str, content: bytes, reading: ReadingOptions | None = None) -> Project | None:
        """Return the project of a file that a browser sent; None for a skeleton, which is kept for the clips that need it.

        Args:
            name: Name that the browser sent.
            content: Contents.
            reading: What the user says of a file that could not be read without.

        Raises:
            InputError: If it is no motion file that can be read; then nothing of it is kept.
        """
        with received_file(name, content, self.uploads) as file:
            if file.suffix == SKELETON_SUFFIX:
                keep_file(file, self.uploads)
                return None
            project = Project(file, self.pipeline, reading)  # whatever is wrong with the file is found before it is kept
            kept = keep_file(file, self.uploads).resolve()
        with self._lock:
            if kept in self._projects or edits_path(kept).is_file():  # it was here before
                project.close()
            else:
                project.move(kept)
                self._projects[kept] = project
                project.clean(physics=False)
        return self.open(kept)

    def _close_old(self) -> None:
        """Close clips that no tab shows, but for the newest."""
        unseen = [path for path, project in self._projects.items() if not project.is_shown]
        for path in unseen[:-MAX_OPEN]:
            self._projects.pop(path).close()

    def close(self) -> None:
        """Stop all solving."""
        for project in self._projects.values():
            project.close()


def _clips_in(folder: Path) -> list[Path]:
    try:
        return [file for file in find_readable_files(folder) if CLEANED not in file.relative_to(folder).parts and not is_cleaned(file)]
    except InputError:  # none in it
        return []
