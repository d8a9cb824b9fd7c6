"""Evaluation report of a trained policy: ``python -m eval.report --run runs/mixed --out DIR [--motions PATH ...]``."""

import argparse
import json
import time
from pathlib import Path

import torch
from rich.console import Console

from configs.exit_codes import run_command
from configs.process_pool import available_cores
from eval.metrics.tracking import summarise
from eval.pages.output_files import check_writable, write_whole
from eval.pages.render import INSTALL_HINT
from eval.report.clip_selection import EvaluationClips, choose_clips
from eval.report.data import collect_report
from eval.report.evaluate import evaluate_clips
from eval.report.median_window import plot_median_window
from eval.report.page import render_report
from eval.report.plots import plot_by_clip, plot_survival, plot_training
from eval.report.videos import Video, render_videos, save_best_strip
from eval.runs.trained_run import TrainedRun, load_run
from eval.runs.training_curves import read_curves
from trainers.data.motion_config import RECONSTRUCTED
from trainers.runs.run_log import make_console


def notices_of(run: TrainedRun, tested: EvaluationClips, videos: list[Video]) -> list[str]:
    """Return the notices at the top of a report."""
    notices = []
    for by in sorted(set(tested.seen_in.values())):
        count = f"{sum(value == by for value in tested.seen_in.values())} of {len(tested.recorded)} clips"
        notices.append(f"{count} were seen in {by}, or their performer was: on these it is no test of generalisation.")
    for model in sorted(set(tested.root_models.values())):
        names = ", ".join(name for name, by in tested.root_models.items() if by == model)
        notices.append(f"The shipped model {model} gave the root of {names}: IMU suits record none, or the file holds none.")
    if tested.suited and run.config.data.root_source == RECONSTRUCTED:
        notices.append("Root3D gave the root of clips through simulated suits, from their poses and accelerations.")
    if not tested.suited:
        notices.append("No clip is free of suit errors, so none was put through a simulated suit.")
    if not videos:
        notices.append(INSTALL_HINT[0].upper() + INSTALL_HINT[1:] + ".")
    return notices


def write_report(run: TrainedRun, out: Path, motions: list[str] | None, console: Console) -> None:
    """Evaluate a run and write ``report.json``, ``index.html`` and ``best.png`` into ``out``."""
    begin = time.monotonic()
    threads = available_cores()
    torch.set_num_threads(threads)
    with console.status("reading clips") as status:
        tested = choose_clips(run.config.data, run.card, motions, status.update)
    minutes = sum(clip.seconds for clip in tested.recorded) / 60.0
    console.print(f"{len(tested.recorded)} clips of {tested.source}, {minutes:.1f} minutes; {len(tested.left_out)} left out")
    recorded = evaluate_clips(run, tested.recorded, None, threads, console, "as recorded")
    suited = evaluate_clips(run, tested.suited, tested.truths, threads, console, "through a suit")
    videos = render_videos(recorded, console)
    report = collect_report(run, tested, recorded, suited, time.monotonic() - begin)
    figures = {"survival": plot_survival(recorded.tracking, suited.tracking), "by_clip": plot_by_clip(report["clips"])}
    course = plot_median_window(suited, tested.truths) or plot_median_window(recorded, None)
    page = render_report(report, figures, plot_training(read_curves(run.folder)), course, videos, notices_of(run, tested, videos))
    text = json.dumps(report, indent=1, allow_nan=False)
    out.mkdir(parents=True, exist_ok=True)
    write_whole(out / "report.json", text + "\n")
    write_whole(out / "index.html", page)
    save_best_strip(recorded, out / "best.png")
    means = summarise(one.policy for one in recorded.tracking)
    console.print("   ".join(f"{name} {value['mean']:.3f} ± {value['std']:.3f}" for name, value in means.items()))
    console.print(f"report: {out / 'index.html'} and {out / 'report.json'}, {time.monotonic() - begin:.0f} s")


def main(arguments: list[str] | None = None, prog: str = "python -m eval.report") -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog=prog, description="Evaluate a trained policy on clips.")
    parser.add_argument("--run", type=Path, required=True, help="a run's folder, such as runs/mixed, or a policy's file")
    parser.add_argument("--out", type=Path, required=True, help="folder for report.json and index.html")
    parser.add_argument(
        "--motions", nargs="+", action="extend", help="motion files, folders of them, or 'synthetic'; the held-out clips by default"
    )
    options = parser.parse_args(arguments)
    return run_command(lambda: _run(options))


def _run(options: argparse.Namespace) -> None:
    check_writable(options.out)
    write_report(load_run(options.run), options.out, options.motions, make_console())
