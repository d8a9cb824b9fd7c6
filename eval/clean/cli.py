"""Cleans motion capture: ``python -m eval.clean IN.bvh --out OUT.bvh [--report DIR]``, or a folder of motion files into another."""

import argparse
import os
import sys
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path

import torch

from agents.weights.pretrained import PRETRAINED_POLICY
from configs.errors import InputError, RunError
from configs.exit_codes import run_command
from configs.process_pool import available_cores
from datasets.formats.motion_file import FORMATS_IN_WORDS
from datasets.performer.reading_arguments import add_reading_options, parse_reading, reading_from_arguments
from eval.clean.clean_files import CleaningJob, Output, clean_files
from eval.clean.console_output import ConsoleOutput
from eval.clean.edits import STAGES
from eval.clean.event_output import EventOutput
from eval.clean.pipeline import CleaningPipeline
from eval.clean.quality import GOOD, QUALITIES
from eval.clean.watch import watch_folder
from eval.pages.output_files import check_writable
from trainers.runs.run_log import make_console


def main(arguments: list[str] | None = None, prog: str = "python -m eval.clean") -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog=prog, description="Clean motion capture: BVH in, clean BVH out, same skeleton.")
    parser.add_argument("source", type=Path, metavar="IN", help=f"a {FORMATS_IN_WORDS} file, or a folder of them")
    parser.add_argument(
        "--out", type=Path, required=True, metavar="OUT", help="the clean file, BVH or the format of IN if it can be written, or the folder"
    )
    parser.add_argument("--report", type=Path, metavar="DIR", help="write a page with before and after there")
    parser.add_argument(
        "--edits",
        type=Path,
        metavar="FILE",
        help="edits of the clip, as the studio saves them; for a folder, that with NAME.edits.json",
    )
    parser.add_argument(
        "--policy",
        type=Path,
        metavar="FILE",
        default=PRETRAINED_POLICY,
        help="another policy than the package's for --quality fast to search along",
    )
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
        help=f"how long the simulation takes: on two cores about the clip's length, six or eight times as long (default {GOOD})",
    )
    parser.add_argument("--threads", type=int, metavar="N", default=available_cores(), help="cores to use (default: all, %(default)s here)")
    parser.add_argument("--json", action="store_true", help="write events to standard output, one JSON object a line, and nothing else")
    parser.add_argument("--watch", action="store_true", help="go on: clean files of the folder IN as they appear or change, until Ctrl-C")
    add_reading_options(parser)
    options = parse_reading(parser, arguments)
    if not options.json:
        return run_command(lambda: _run(options, ConsoleOutput(make_console())))
    events = EventOutput(sys.stdout)
    with redirect_stdout(sys.stderr):
        return run_command(lambda: _run_with_events(options, events))


def _run_with_events(options: argparse.Namespace, events: EventOutput) -> None:
    """Run the command; an error that no event told becomes one."""
    try:
        _run(options, events)
    except InputError as error:
        if not events.told_error:
            events.error(None, str(error))
        raise
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.__stdout__.fileno())  # type: ignore[union-attr]  # else Python complains at its end
        raise RunError("whoever read the events is gone; no file is half-written") from None


def _run(options: argparse.Namespace, output: Output) -> None:
    if options.report:
        check_writable(options.report, "--report")
    if options.threads < 1:
        raise InputError(f"--threads {options.threads} should be 1 or more")
    if not 0.0 <= options.assist <= 1.0:
        raise InputError(f"--assist {options.assist:g} should be a share of the body's weight, from 0 to 1")
    reading = reading_from_arguments(options)
    torch.set_num_threads(options.threads)
    search = replace(QUALITIES[options.quality or GOOD], assist_force_bw=options.assist)
    pipeline = CleaningPipeline.load(options.threads, options.policy, search).without(options.without)
    job = CleaningJob(options.source, options.out, pipeline, options.report, reading, options.edits, options.quality)
    if options.watch:
        watch_folder(job, output)
    else:
        clean_files(job, output)
