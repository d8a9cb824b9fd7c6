"""Cleans motion capture: ``python -m eval.clean IN.bvh --out OUT.bvh [--report DIR]``, or a folder of motion files into another."""

import argparse
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import timedelta
from math import ceil
from pathlib import Path

import torch
from rich.console import Console, RenderableType
from rich.markup import escape
from rich.progress import Progress, ProgressColumn, SpinnerColumn, Task, TextColumn
from rich.progress_bar import ProgressBar
from rich.text import Text

from agents.weights.pretrained import PRETRAINED_POLICY
from configs.errors import InputError
from configs.exit_codes import run_command
from configs.process_pool import available_cores
from datasets.formats.motion_file import (
    FORMATS_IN_WORDS,
    can_write,
    is_motion_file,
    writable_suffixes,
    write_motion_file,
)
from datasets.joints.mapping_draft import JointMapError, save_draft
from datasets.library.sources import find_readable_files
from datasets.performer.performer_clip import read_performer_file
from datasets.performer.reading_arguments import add_reading_options, parse_reading, reading_from_arguments
from datasets.performer.reading_options import ReadingOptions
from eval.clean.edits import STAGES
from eval.clean.pipeline import CleaningPipeline
from eval.clean.progress import REPORTING, CleaningProgress, expected_seconds
from eval.clean.report import write_clip_report, write_folder_report
from eval.clean.result import CleaningResult
from eval.clean.samcon import GOOD, QUALITIES
from eval.pages.output_files import check_writable, reporting_write_errors
from trainers.runs.run_log import make_console


def pair_inputs_with_outputs(source: Path, target: Path) -> Iterator[tuple[Path, Path]]:
    """Return each motion file of a source, a file or a folder, and where its clean clip goes.

    The clip of a file in a folder keeps the file's name and format; it becomes a BVH where that format cannot be written.

    Raises:
        InputError: If there is none, or the target cannot take it.
    """
    if not source.exists():
        raise InputError(f"{source}: no such file or folder; name a {FORMATS_IN_WORDS} file or a folder of them")
    if source.is_dir():
        if target.is_file() or is_motion_file(target):
            raise InputError(f"--out {target} is a file's name, should be a folder's, for the clips of {source}")
        if target.resolve() == source.resolve():
            raise InputError(f"--out {target} is the folder of the clips itself, should be another one")
        found = find_readable_files(source)
        files = [file for file in found if target.resolve() not in file.resolve().parents]  # not what was cleaned before
        names = [file.relative_to(source) for file in files]
        yield from ((file, target / _output_name(name, names)) for file, name in zip(files, names, strict=True))
        return
    if not is_motion_file(source):
        raise InputError(f"{source}: no {FORMATS_IN_WORDS} file; a clip to clean is one")
    if target.is_dir() or not can_write(target, source):
        suffixes = writable_suffixes(source)
        what = "a folder" if target.is_dir() else f"no {' or '.join(suffixes)} file"
        raise InputError(f"--out {target} is {what}, should be a file's name such as {target / source.with_suffix(suffixes[0]).name}")
    if target.resolve() == source.resolve():
        raise InputError(f"--out {target} is the clip itself, should be another file's name")
    yield source, target


def _output_name(name: Path, names: list[Path]) -> Path:
    """Return the name of a clean clip: the recording's, as a BVH if its format cannot be written; "a.amc.bvh" where others are called a."""
    if can_write(name, name):
        return name
    suffix = writable_suffixes(name)[0]
    same = [other for other in names if other.with_suffix("") == name.with_suffix("")]
    return name.with_suffix(suffix) if len(same) == 1 else name.with_name(name.name + suffix)


def clean_files(
    source: Path,
    target: Path,
    report: Path | None,
    pipeline: CleaningPipeline,
    reading: ReadingOptions | None,
) -> None:
    """Clean a clip, or all clips of a folder, and print a line for each.

    Args:
        source: Motion file, or a folder of them.
        target: File or folder to write.
        report: Folder of the report, None for no report.
        pipeline: Stages of the cleaning.
        reading: Joint names, unit and axes that the user gave.

    Raises:
        InputError: If a clip cannot be cleaned; of a folder at the end, after all that can.
    """
    console, reports, num_failed, drafts = make_console(), {}, 0, set[str]()
    clips = list(pair_inputs_with_outputs(source, target))
    check_writable(target if source.is_dir() else target.parent)
    for file, out in clips:
        begin = time.monotonic()
        with _progress(console, file, pipeline, report is not None) as progress:
            try:
                recorded = read_performer_file(file, reading)
                bvh, cleaned = pipeline.clean(recorded, file.stem, reading, progress=progress)
                with reporting_write_errors(out):
                    out.parent.mkdir(parents=True, exist_ok=True)
                    written = write_motion_file(out, bvh, file)
            except InputError as failure:
                error = failure
                if isinstance(failure, JointMapError) and failure.draft not in drafts:  # one for all clips of the same skeleton
                    drafts.add(failure.draft)
                    error = save_draft(failure, file.stem, Path())
                told = f"{error}" if str(file) in str(error) else f"{file}: {error}"
                if source.is_file():
                    raise InputError(told) from failure
                console.print(escape(f"{told}; left out"))
                num_failed += 1
                continue
            console.print(escape(_line(file, out, cleaned, time.monotonic() - begin, written)))
            if report:
                progress(REPORTING)
                page = report / _page_name(out, [each for _, each in clips]).relative_to(target) if source.is_dir() else report
                with reporting_write_errors(page):
                    reports[str(page.relative_to(report))] = write_clip_report(cleaned, page)
                console.print(escape(f"  report: {page / 'index.html'}"))
    if report and source.is_dir() and reports:
        with reporting_write_errors(report):
            write_folder_report(reports, report)
        console.print(escape(f"report over all clips: {report / 'index.html'}"))
    if num_failed:
        raise InputError(f"{source}: {num_failed} of {len(clips)} files could not be cleaned, see above; the others were")


def _page_name(out: Path, every: list[Path]) -> Path:
    """Return the name of a clip's report: its file's without suffix, unless files differ in nothing else."""
    bare = out.with_suffix("")
    return bare if [each.with_suffix("") for each in every].count(bare) == 1 else out


@contextmanager
def _progress(console: Console, file: Path, pipeline: CleaningPipeline, report: bool) -> Iterator[CleaningProgress]:
    """Draw a bar with the stage and the time left while a file is cleaned; nothing where there is no terminal."""
    search, threads = (pipeline.simulator.search, pipeline.simulator.threads) if pipeline.simulator else (None, 1)
    done = CleaningProgress(expected_seconds(file.stat().st_size, search, threads, report))
    columns = SpinnerColumn(), TextColumn("{task.description}"), _Stage(done), _Bar(done), _TimeLeft(done)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        bar.add_task(escape(file.name), total=1.0)
        yield done


class _Stage(ProgressColumn):
    """Column with the stage of a cleaning."""

    def __init__(self, progress: CleaningProgress) -> None:
        super().__init__()
        self._progress = progress

    def render(self, task: Task) -> RenderableType:
        """Return the name of the stage."""
        return Text(self._progress.stage)


class _Bar(_Stage):
    """Column with a bar of the share of a cleaning that is done."""

    def render(self, task: Task) -> RenderableType:
        """Return the bar."""
        return ProgressBar(total=1.0, completed=self._progress.share, width=30)


class _TimeLeft(_Stage):
    """Column with the time that a cleaning will still take."""

    def render(self, task: Task) -> RenderableType:
        """Return hours, minutes and seconds."""
        return Text(f"{timedelta(seconds=ceil(self._progress.seconds_left))} left")


def _line(file: Path, out: Path, cleaned: CleaningResult, seconds: float, written: tuple[str, ...]) -> str:
    """Return the line that is printed of a cleaned clip, with those on how it was read, cleaned and written."""
    trusted = 100.0 * float(cleaned.confidence.mean())
    told = "".join(f"\n  {line}" for line in (cleaned.read_as, *cleaned.notices, *written))
    restarted = f", restarted {len(cleaned.restarts)} times" if cleaned.restarts else ""
    helped = f", helped by {100.0 * cleaned.mean_assist:.1f} % of the body's weight" if cleaned.mean_assist else ""
    physics = f"{trusted:.0f} % of it is physics{helped}{restarted}"
    return f"{file.name} -> {out}: {cleaned.before.seconds:.1f} s in {seconds:.1f} s; {physics}{told}"


def main(arguments: list[str] | None = None, prog: str = "python -m eval.clean") -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog=prog, description="Clean motion capture: BVH in, clean BVH out, same skeleton.")
    parser.add_argument("source", type=Path, metavar="IN", help=f"a {FORMATS_IN_WORDS} file, or a folder of them")
    parser.add_argument(
        "--out", type=Path, required=True, metavar="OUT", help="the clean file, BVH or the format of IN if it can be written, or the folder"
    )
    parser.add_argument("--report", type=Path, metavar="DIR", help="write a page with before and after there")
    parser.add_argument("--policy", type=Path, metavar="FILE", default=PRETRAINED_POLICY, help="another policy than the package's")
    parser.add_argument("--without", choices=STAGES, action="append", default=[], help="leave a stage out; may be given twice")
    parser.add_argument(
        "--assist",
        type=float,
        metavar="SHARE",
        default=QUALITIES[GOOD].assist_force_bw,
        help="largest force that helps the simulated body on its pelvis, as a share of its weight (default %(default)s; 0: none)",
    )
    parser.add_argument(
        "--quality",
        choices=QUALITIES,
        default=GOOD,
        help="how long the simulation searches: on two cores about the clip's length, three or ten times as long (default %(default)s)",
    )
    parser.add_argument("--threads", type=int, metavar="N", default=available_cores(), help="cores to use (default: all, %(default)s here)")
    add_reading_options(parser)
    options = parse_reading(parser, arguments)
    return run_command(lambda: _run(options))


def _run(options: argparse.Namespace) -> None:
    if options.report:
        check_writable(options.report, "--report")
    if options.threads < 1:
        raise InputError(f"--threads {options.threads} should be 1 or more")
    if not 0.0 <= options.assist <= 1.0:
        raise InputError(f"--assist {options.assist:g} should be a share of the body's weight, from 0 to 1")
    reading = reading_from_arguments(options)
    torch.set_num_threads(options.threads)
    search = replace(QUALITIES[options.quality], assist_force_bw=options.assist)
    pipeline = CleaningPipeline.load(options.threads, options.policy, search).without(options.without)
    clean_files(options.source, options.out, options.report, pipeline, reading)
