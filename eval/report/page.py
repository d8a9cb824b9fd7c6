"""HTML page of a report: numbers, plots and videos, without need of a network."""

from typing import Any

from omegaconf import OmegaConf

from eval.metrics.catalogue import TRACKING_CATALOGUE, metrics_with_values
from eval.pages.page import render_page
from eval.report.median_window import WindowPlots
from eval.report.videos import Video


def render_report(
    report: dict[str, Any],
    figures: dict[str, Any],
    training: list[Any],
    course: WindowPlots | None,
    videos: list[Video],
    notices: list[str],
) -> str:
    """Return the page as HTML.

    Args:
        report: Content of ``report.json``.
        figures: Plots by name: ``survival`` and ``by_clip``.
        training: Plots of the training as (heading, how to read it, figure).
        course: Artefacts over time of the median window, None if there is none.
        videos: Videos, possibly none.
        notices: Notices at the top of the page.
    """
    return render_page(
        "report/report.html.j2",
        {},
        report=report,
        figures=figures,
        training=training,
        course=course,
        videos=videos,
        notices=notices,
        tracking_metrics=TRACKING_CATALOGUE,
        artefact_metrics=metrics_with_values(report["artefacts"]["after"], report["artefacts_suit"]["after"]),
        config_yaml=OmegaConf.to_yaml(OmegaConf.create(report["config"])),
    )
