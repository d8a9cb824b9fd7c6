"""Cleaning of all clips of a folder with one clip's settings, each with its own edits where it has some."""

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from configs.errors import InputError
from datasets.formats.motion_file import write_motion_file
from datasets.performer.performer_clip import read_performer_file
from eval.clean.edits import Edits
from eval.clean.edits_file import edits_path, read_edits
from eval.clean.output_names import pair_inputs_with_outputs
from eval.clean.pipeline import CleaningPipeline
from eval.clean.session import CleaningCancelled, CleaningSession
from eval.studio.state.saved_files import is_cleaned

CLEANED = "cleaned"  # folder in that of the clips, into which clean ones go


class Batch:
    """Cleaning of a folder, in a thread of its own.

    Attributes:
        target: Folder that clean clips go to.
        lines: One line for each clip that is done.
        num_clips: Number of clips.
        share: Share of the clip that is being cleaned.
        is_running: Whether there is more to do.
    """

    def __init__(self, folder: Path, settings: Edits, pipeline: CleaningPipeline, on_change: Callable[[], None]) -> None:
        """Begin.

        Args:
            folder: Folder of the clips.
            settings: Quality, stages and what files were said to be, for clips without edits of their own.
            pipeline: Stages of the cleaning.
            on_change: Called after each clip.

        Raises:
            InputError: If there is no clip.
        """
        self.target, self.lines, self.share, self.is_running = folder / CLEANED, list[str](), 0.0, True
        self._settings = Edits(
            reading=replace(settings.reading, figure=None, skeleton=None), quality=settings.quality, without=settings.without
        )
        self._pairs = [pair for pair in pair_inputs_with_outputs(folder, self.target) if not is_cleaned(pair[0])]
        self.num_clips, self._pipeline, self._on_change, self._is_stopped = len(self._pairs), pipeline, on_change, False
        self._thread = threading.Thread(target=self._run, daemon=True, name="batch")
        self._thread.start()

    def wait(self) -> None:
        """Wait until all clips are done."""
        self._thread.join()

    def stop(self) -> None:
        """Stop after at most one more stage of the clip that is being cleaned."""
        self._is_stopped = True

    def _run(self) -> None:
        try:
            for file, out in self._pairs:
                self.share = 0.0
                try:
                    self.lines.append(self._clean(file, out))
                except CleaningCancelled:
                    self.lines.append(f"{file.name}: stopped")
                    return
                except InputError as error:
                    self.lines.append(f"{error}" if file.name in str(error) else f"{file.name}: {error}")
                self._on_change()
        finally:
            self.is_running = False
            self._on_change()

    def _clean(self, file: Path, out: Path) -> str:
        """Clean a clip and return its line."""
        own = edits_path(file)
        edits = read_edits(own) if own.is_file() else self._settings
        session = CleaningSession(read_performer_file(file, edits.reading), file.stem, self._pipeline, edits.reading)
        result = session.solve(edits, True, self._progress, lambda: self._is_stopped)
        out.parent.mkdir(parents=True, exist_ok=True)
        write_motion_file(out, session.write(result), file)
        return f"{file.name} → {out.name}, {result.simulated.mean():.0%} by physics{', with its edits' if own.is_file() else ''}"

    def _progress(self, _stage: str, share: float = 0.0) -> None:
        self.share = max(self.share, share)
