"""The numbers of a cleaned clip's report: ``report.json`` and ``frames.csv``."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from datasets.motion.humanoid import BODY_NAMES
from eval.clean.result import CleaningResult
from eval.metrics.artefact_tracks import CONTACT_BY_HEIGHT_M, ArtefactTracks, compute_artefact_tracks, distances_local, distances_world
from eval.metrics.artefacts import compare_contact_rules, contact_metrics, distance_metrics, metrics_of_tracks
from eval.pages.artefact_plots import spans_in_seconds

MAX_MOMENTS = 6  # pictures of the frames that were changed most
MIN_MOMENT_GAP_S = 0.5  # s between two of them
MIN_DEVIATION_M = 1e-3  # m, of a change that is worth a picture
CSV_HEADER = "frame,seconds,confidence,kept,contact_left,contact_right,deviation_local_mm,deviation_world_mm,assist_bw"


def tracks_by_side(cleaned: CleaningResult) -> dict[str, ArtefactTracks]:
    """Return the artefact tracks of "before", "after" and, where it is known, "truth"."""
    truth = cleaned.truth
    sides = {"before": cleaned.before, "after": cleaned.after} | ({"truth": truth} if truth else {})
    return {side: compute_artefact_tracks(clip, truth, cleaned.before) for side, clip in sides.items()}


def collect_report_data(cleaned: CleaningResult, tracks: Mapping[str, ArtefactTracks] | None = None) -> dict[str, Any]:
    """Return the content of ``report.json``; metrics by the ids and in the units of docs/metrics.md.

    Args:
        cleaned: The clip before and after.
        tracks: Artefact tracks from ``tracks_by_side``, where they are known already.
    """
    local, world = _deviations(cleaned)
    fps, truth = cleaned.before.fps, cleaned.truth
    tracks = tracks or tracks_by_side(cleaned)
    sides = {side: metrics_of_tracks(own) for side, own in tracks.items()}
    if truth:
        for side in ("before", "after"):
            sides[side] |= contact_metrics(tracks[side])
    sides["before"] |= distance_metrics(cleaned.before, truth, None)
    sides["after"] |= distance_metrics(cleaned.after, truth, cleaned.before)
    by_height = tracks["after"].foot_height < CONTACT_BY_HEIGHT_M
    return {
        "name": cleaned.name,
        "read_as": cleaned.read_as,
        "frames": len(cleaned.before),
        "fps": fps,
        "seconds": cleaned.before.seconds,
        "start_s": cleaned.start_s,
        "artefacts": sides | {"truth": sides.get("truth", {})},
        "deviation": {"local": _spread_mm(local), "world": _spread_mm(world)},
        "confidence": {
            "mean": float(cleaned.confidence.mean()),
            "lowest": float(cleaned.confidence.min()),
            "under_half": float(np.mean(~cleaned.simulated)),
        },
        "kept": {"share": float(cleaned.kept.mean()), "spans": spans_in_seconds(cleaned.kept, fps, cleaned.start_s)},
        "seams": list(cleaned.restarts),
        "assist_bw": {"mean": cleaned.mean_assist, "largest": float(cleaned.assist.max())},
        "contact_rule": compare_contact_rules(cleaned.contacts[cleaned.simulated], by_height[cleaned.simulated]),
        "most_changed": find_most_changed_frames(cleaned),
        "moved": [asdict(span) for span in cleaned.moved],
        "overlaps": [asdict(overlap) for overlap in cleaned.overlaps],
        "misalignments": [asdict(one) for one in cleaned.misalignments],
        "damage": [asdict(one) for one in cleaned.damage],
        "notices": [notice.text for notice in cleaned.notices],
    }


def find_most_changed_frames(cleaned: CleaningResult) -> list[dict[str, Any]]:
    """Return the frames whose joints were moved most, roots aligned, in the order of time: no two within half a second."""
    joints = distances_local(cleaned.after, cleaned.before)
    left, fps = joints.mean(axis=1), cleaned.before.fps
    found: list[dict[str, Any]] = []
    while len(found) < MAX_MOMENTS and left.max() > MIN_DEVIATION_M:
        frame = int(left.argmax())
        body = int(joints[frame].argmax())
        found.append({
            "frame": frame, "seconds": cleaned.start_s + frame / fps, "deviation_mm": 1e3 * float(joints[frame].mean()),
            "body": BODY_NAMES[body], "body_mm": 1e3 * float(joints[frame, body]),
        })  # fmt: skip
        left = np.where(np.abs(np.arange(len(left)) - frame) < MIN_MOMENT_GAP_S * fps, 0.0, left)
    return sorted(found, key=lambda one: one["frame"])


def frames_csv(cleaned: CleaningResult) -> str:
    """Return the table of all frames."""
    local, world = _deviations(cleaned)
    start_s, fps = cleaned.start_s, cleaned.before.fps
    rows = zip(cleaned.confidence, cleaned.kept, *cleaned.contacts.T, 1e3 * local, 1e3 * world, cleaned.assist, strict=True)
    lines = [
        f"{frame},{start_s + frame / fps:.4f},{confidence:.3f},{kept:d},{left:d},{right:d},{near:.1f},{far:.1f},{assist:.3f}"
        for frame, (confidence, kept, left, right, near, far, assist) in enumerate(rows)
    ]
    return "\n".join([CSV_HEADER, *lines]) + "\n"


def _deviations(cleaned: CleaningResult) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean distance of the joints from the input [m] with the roots aligned and in the world, each of shape (T,)."""
    return distances_local(cleaned.after, cleaned.before).mean(axis=1), distances_world(cleaned.after, cleaned.before).mean(axis=1)


def _spread_mm(values: np.ndarray) -> dict[str, float]:
    mm = 1e3 * values
    return {"mean_mm": float(mm.mean()), "p95_mm": float(np.percentile(mm, 95.0)), "worst_mm": float(mm.max())}
