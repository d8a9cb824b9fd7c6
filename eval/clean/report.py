"""The before/after report of cleaned clips: a page, a JSON and a table of frames each, and one page over a folder of them."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from eval.clean.report_data import collect_report_data, frames_csv, tracks_by_side
from eval.clean.result import CleaningResult
from eval.clean.video import render_cleaning
from eval.metrics.artefact_tracks import ArtefactTracks, distances_local, distances_world
from eval.metrics.catalogue import metrics_with_values
from eval.metrics.rollout_motion import mean_over_clips
from eval.pages.artefact_plots import plot_artefacts, plot_over_time, spans_in_seconds
from eval.pages.figures import GREY, RECORDED, Figure
from eval.pages.output_files import write_whole
from eval.pages.page import render_page
from eval.pages.render import INSTALL_HINT

IN_FOLDERS = ("foot_skate", "floating", "ground_penetration", "self_penetration", "jitter", "deviation_local", "truth_error_local")


def write_clip_report(cleaned: CleaningResult, out: Path) -> dict[str, Any]:
    """Write ``report.json``, ``frames.csv`` and ``index.html`` about one cleaned clip.

    Args:
        cleaned: The clip before and after.
        out: Folder to write into, made where it is missing.

    Returns:
        What ``report.json`` holds.
    """
    tracks = tracks_by_side(cleaned)
    report = collect_report_data(cleaned, tracks)
    pictures = render_cleaning(cleaned, [one["frame"] for one in report["most_changed"]])
    notices = [*cleaned.notices, *([] if pictures else [f"{INSTALL_HINT[0].upper()}{INSTALL_HINT[1:]}."])]
    sides = [(side, values) for side, values in report["artefacts"].items() if values]
    metrics, plots = metrics_with_values(report["artefacts"]["after"]), _plots(cleaned, tracks)
    page = render_page(
        "clean/report.html.j2", {}, report=report, notices=notices, pictures=pictures, sides=sides, metrics=metrics, plots=plots
    )
    out.mkdir(parents=True, exist_ok=True)
    write_whole(out / "report.json", json.dumps(report, indent=1, allow_nan=False) + "\n")
    write_whole(out / "frames.csv", frames_csv(cleaned))
    write_whole(out / "index.html", page)
    return report


def write_folder_report(reports: Mapping[str, dict[str, Any]], out: Path) -> None:
    """Write ``report.json`` and ``index.html`` over the clips of a folder.

    Args:
        reports: What ``write_clip_report`` returned, by the folder under ``out`` that it wrote into.
        out: Folder to write into, made where it is missing.
    """
    means = mean_over_clips(report["artefacts"] for report in reports.values())
    sides = [(side, values) for side, values in means.items() if values]
    metrics = metrics_with_values(means["after"])
    columns = {name: metric for name, metric in metrics.items() if name in IN_FOLDERS}
    page = render_page("clean/folder_report.html.j2", {"address": quote}, reports=reports, sides=sides, metrics=metrics, columns=columns)
    table = {"artefacts": means, "clips": [{"folder": folder, **report} for folder, report in reports.items()]}
    out.mkdir(parents=True, exist_ok=True)
    write_whole(out / "report.json", json.dumps(table, indent=1, allow_nan=False) + "\n")
    write_whole(out / "index.html", page)


def _plots(cleaned: CleaningResult, sides: Mapping[str, ArtefactTracks]) -> list[tuple[str, Figure]]:
    """Return all plots over time as (title, figure)."""
    fps = cleaned.before.fps
    start_s = cleaned.start_s
    kept, restarts = spans_in_seconds(cleaned.kept, fps, start_s), cleaned.restarts
    moved = {
        "roots aligned": (1e3 * distances_local(cleaned.after, cleaned.before).mean(axis=1), RECORDED),
        "in the world": (1e3 * distances_world(cleaned.after, cleaned.before).mean(axis=1), GREY),
    }
    sure = plot_over_time({"confidence": (cleaned.confidence, RECORDED)}, "confidence, 0 to 1", fps, np.fmin, kept, restarts, start_s)
    sure["layout"]["yaxis"]["range"] = [0.0, 1.05]
    return [
        *plot_artefacts(sides, kept, restarts, start_s),
        ("How far joints were moved", plot_over_time(moved, "from the input [mm]", fps, np.fmax, kept, restarts, start_s)),
        ("Confidence", sure),
        (
            "Help on the pelvis",
            plot_over_time({"force": (cleaned.assist, RECORDED)}, "body weights", fps, np.fmax, kept, restarts, start_s),
        ),
    ]
