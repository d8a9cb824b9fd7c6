"""Cleaning of files: one clip, or all of a folder, each with its edits, its report and its line."""

import time
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from configs.errors import InputError
from datasets.formats.motion_file import write_motion_file
from datasets.joints.mapping_draft import JointMapError, save_draft
from datasets.performer.performer_clip import read_performer_file
from datasets.performer.reading_options import ReadingOptions
from eval.clean.edits import PHYSICS, EditError, Edits, combine_reading
from eval.clean.edits_file import edits_path, read_edits
from eval.clean.output_names import page_name, pair_inputs_with_outputs
from eval.clean.pipeline import CleaningPipeline
from eval.clean.progress import REPORTING, CleaningProgress, expected_seconds
from eval.clean.quality import QUALITIES
from eval.clean.report import write_clip_report, write_folder_report
from eval.clean.result import CleaningResult
from eval.pages.output_files import check_writable, reporting_write_errors


class Output(Protocol):
    """Whoever is told what becomes of each clip: ``ConsoleOutput`` or ``EventOutput``."""

    def cleaning(self, file: Path, out: Path, progress: CleaningProgress, place: tuple[int, int]) -> AbstractContextManager[None]:
        """Tell that a clip is begun, as the first to the last of several: (number from 1, of how many)."""
        ...

    def advanced(self) -> None:
        """Tell that the progress of the clip went on."""
        ...

    def cleaned(self, file: Path, out: Path, result: CleaningResult, seconds: float, written: tuple[str, ...]) -> None:
        """Tell that a clip was cleaned and written."""
        ...

    def reported(self, file: Path | None, page: Path) -> None:
        """Tell where the report of a clip is, or that over all clips."""
        ...

    def failed(self, file: Path, error: str, several: bool) -> None:
        """Tell why a clip, alone or one of several, could not be cleaned."""
        ...

    def waiting(self, folder: Path) -> None:
        """Tell that files are waited for."""
        ...

    def finished(self, num_cleaned: int, num_failed: int) -> None:
        """Tell that all is done."""
        ...


@dataclass(frozen=True)
class CleaningJob:
    """What is to be cleaned, and how.

    Attributes:
        source: Motion file, or a folder of them.
        target: File or folder to write.
        pipeline: Stages of the cleaning.
        report: Folder of the report, None for no report.
        reading: What the user said of the files.
        edits: File of the clip's edits, or the folder of those of a folder's clips; None for no edits.
        quality: Quality that the user named, which counts more than that of edits; None if it was not named.
    """

    source: Path
    target: Path
    pipeline: CleaningPipeline
    report: Path | None = None
    reading: ReadingOptions | None = None
    edits: Path | None = None
    quality: str | None = None

    def edits_of(self, file: Path) -> Path | None:
        """Return the file of a clip's edits: the one that was named, or in the folder that was named the one called like the clip."""
        if self.edits is None or not self.source.is_dir():
            return self.edits
        named = edits_path(self.edits / file.relative_to(self.source))
        return named if named.is_file() else None


def clean_files(job: CleaningJob, output: Output) -> None:
    """Clean a clip, or all clips of a folder.

    Raises:
        InputError: If a clip cannot be cleaned; of a folder at the end, after all that can.
    """
    clips = list(pair_inputs_with_outputs(job.source, job.target))
    check_job(job)
    reports: dict[str, dict[str, Any]] = {}
    num_failed, drafts = 0, set[str]()
    for number, (file, out) in enumerate(clips, 1):
        try:
            page = clean_clip(job, file, out, clips, output, (number, len(clips)))
        except InputError as failure:
            told = told_failure(failure, file, drafts)
            output.failed(file, told, job.source.is_dir())
            if job.source.is_file():
                raise InputError(told) from failure
            num_failed += 1
            continue
        reports |= page
    if job.report and job.source.is_dir() and reports:
        with reporting_write_errors(job.report):
            write_folder_report(reports, job.report)
        output.reported(None, job.report / "index.html")
    output.finished(len(clips) - num_failed, num_failed)
    if num_failed:
        raise InputError(f"{job.source}: {num_failed} of {len(clips)} files could not be cleaned, see above; the others were")


def check_job(job: CleaningJob) -> None:
    """Raise an InputError if a job's output cannot be written, or its edits are not those of its source."""
    check_writable(job.target if job.source.is_dir() else job.target.parent)
    if job.edits and job.source.is_dir() and not job.edits.is_dir():
        example = edits_path(Path("NAME.bvh")).name
        raise InputError(f"--edits {job.edits} should be a folder, such as {job.source}, with the edits of each clip as {example}")
    if job.edits and job.source.is_file() and job.edits.is_dir():
        raise InputError(f"--edits {job.edits} is a folder, should be a file such as {edits_path(job.edits / job.source.name)}")


def clean_clip(
    job: CleaningJob, file: Path, out: Path, clips: Sequence[tuple[Path, Path]], output: Output, place: tuple[int, int]
) -> dict[str, dict[str, Any]]:
    """Clean one clip of a job, write it and its report; return what the report holds by its folder, nothing without one.

    Args:
        job: What is to be cleaned.
        file: The clip's file.
        out: File to write.
        clips: All files of the job and their outputs, by which reports are named.
        output: Whoever is told.
        place: Number of the clip from 1, and of how many.

    Raises:
        InputError: If the clip cannot be read, cleaned or written.
    """
    begin, named = time.monotonic(), job.edits_of(file)
    edits = read_edits(named) if named else Edits()
    if job.quality:
        edits = replace(edits, quality=None)
    progress = _progress(job, file, edits)

    def advance(stage: str, share: float = 0.0) -> None:
        progress(stage, share)
        output.advanced()

    with output.cleaning(file, out, progress, place):
        reading = combine_reading(job.reading or ReadingOptions(), edits.reading)
        recorded = read_performer_file(file, reading)
        try:
            bvh, cleaned = job.pipeline.clean(recorded, file.stem, reading, progress=advance, edits=edits)
        except EditError as error:
            raise InputError(f"{named}: {error}") from error
        with reporting_write_errors(out):
            out.parent.mkdir(parents=True, exist_ok=True)
            written = write_motion_file(out, bvh, file)
        output.cleaned(file, out, cleaned, time.monotonic() - begin, written)
        if not job.report:
            return {}
        advance(REPORTING)
        named_page = page_name(out, [each for _, each in clips]).relative_to(job.target) if job.source.is_dir() else Path()
        page = job.report / named_page
        with reporting_write_errors(page):
            report = write_clip_report(cleaned, page)
        output.reported(file, page / "index.html")
        return {str(named_page): report}


def _progress(job: CleaningJob, file: Path, edits: Edits) -> CleaningProgress:
    """Return the clock of the cleaning of a file."""
    simulator = None if PHYSICS in edits.without else job.pipeline.simulator
    search, threads = (simulator.search, simulator.threads) if simulator else (None, 1)
    if search and edits.quality:
        search = QUALITIES[edits.quality]
    return CleaningProgress(expected_seconds(file.stat().st_size, search, threads, job.report is not None))


def told_failure(failure: InputError, file: Path, drafts: set[str]) -> str:
    """Return the line about a clip that failed; the draft of a mapping file is saved once for all clips of the same skeleton."""
    error: InputError = failure
    if isinstance(failure, JointMapError) and failure.draft not in drafts:
        drafts.add(failure.draft)
        error = save_draft(failure, file.stem, Path())
    return f"{error}" if str(file) in str(error) else f"{file}: {error}"
