"""Runs a speed benchmark with its peers and its limit in the same run: ``python -m eval.benchmark NAME [--json FILE]``."""

import argparse
import json
from collections.abc import Callable
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from configs.errors import InputError
from configs.exit_codes import run_command
from datasets.library.sources import SYNTHETIC_SOURCE
from eval.benchmark.clean import benchmark_clean
from eval.benchmark.contact import benchmark_contact
from eval.benchmark.env import benchmark_env
from eval.benchmark.learner import benchmark_learner
from eval.benchmark.libraries import benchmark_libraries
from eval.benchmark.live import benchmark_live
from eval.benchmark.root import benchmark_root
from eval.benchmark.scale import benchmark_scale
from eval.benchmark.studio import benchmark_studio
from eval.benchmark.timing.interleaved import BenchmarkResult
from eval.benchmark.train import benchmark_train
from eval.benchmark.worlds import benchmark_worlds
from eval.pages.output_files import write_whole

BENCHMARKS: dict[str, Callable[[str, int, Callable[[], None]], BenchmarkResult]] = {
    "clean": benchmark_clean,
    "contact": benchmark_contact,
    "env": benchmark_env,
    "learner": benchmark_learner,
    "libraries": benchmark_libraries,
    "live": benchmark_live,
    "root": benchmark_root,
    "scale": benchmark_scale,
    "studio": benchmark_studio,
    "train": benchmark_train,
    "worlds": benchmark_worlds,
}
PLOTTED_BENCHMARKS = ("contact",)


def main(arguments: list[str] | None = None, prog: str = "python -m eval.benchmark") -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog=prog, description="Measure speed against peers and the limit of the machine.")
    parser.add_argument("name", choices=sorted(BENCHMARKS), help="which benchmark")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there as well")
    parser.add_argument("--plot", type=Path, metavar="FILE", help=f"write a picture there, PNG ({', '.join(PLOTTED_BENCHMARKS)})")
    parser.add_argument("--motions", default=SYNTHETIC_SOURCE, metavar="PATH", help="motion source (default: synthetic)")
    parser.add_argument("--rounds", type=int, default=20, help="rounds of which medians are taken (default: 20)")
    options = parser.parse_args(arguments)
    return run_command(lambda: _run(options))


def _run(options: argparse.Namespace) -> None:
    _check(options)
    speed = _measure(options)
    Console().print(speed.table(), *speed.notes)
    if options.json:
        write_whole(options.json, json.dumps(speed.summary(), indent=2) + "\n")
    if options.plot:
        write_whole(options.plot, speed.plot_png)


def _check(options: argparse.Namespace) -> None:
    """Raise an error for wrong options before any work."""
    if options.rounds < 1:
        raise InputError(f"--rounds is {options.rounds}, should be 1 or more")
    if options.plot and options.name not in PLOTTED_BENCHMARKS:
        raise InputError(f"--plot {options.plot}: the benchmark {options.name} draws nothing, {', '.join(PLOTTED_BENCHMARKS)} does")
    for option, file in (("--json", options.json), ("--plot", options.plot)):
        if file and not file.absolute().parent.is_dir():
            raise InputError(f"{option} {file}: there is no folder {file.absolute().parent}")


def _measure(options: argparse.Namespace) -> BenchmarkResult:
    """Run the benchmark with a bar of its rounds on standard error."""
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(f"benchmark {options.name}", total=options.rounds + 1)
        return BENCHMARKS[options.name](options.motions, options.rounds, lambda: progress.advance(task))
