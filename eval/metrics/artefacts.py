"""Artefact metrics of a clip (docs/metrics.md): each is a mean of one of the tracks of ``eval.metrics.artefact_tracks``.

T frames. Tracks are in metres, metrics in cm/s, mm and km/s^3.
"""

import numpy as np

from datasets.motion.clip import BodyMotion
from eval.metrics.artefact_tracks import ArtefactTracks, compute_artefact_tracks, distances_local, distances_world, sole_speeds

SKATE_HEIGHT_M, SKATE_SPEED_M_S = 0.05, 0.5  # m, m/s: a foot that is lower and faster skates (GMD)
GROUND_TOLERANCE_M = 0.005  # m; a body whose lowest point is farther from the ground floats or penetrates
MIN_PENETRATION_M = 0.01  # m; a smaller overlap of two shapes is none
BALANCE_MARGIN_M = 0.05  # m; a centre of mass that is farther outside the support polygon is out of balance


def artefact_metrics(motion: BodyMotion, truth: BodyMotion | None = None, original: BodyMotion | None = None) -> dict[str, float]:
    """Return all artefact metrics of a clip by id, in the units of docs/metrics.md.

    Args:
        motion: Clip to judge.
        truth: Clean clip of the same frames and rate, where it is known. Its contacts and flights then count.
        original: Clip that ``motion`` was made from, if any: same frames and rate.

    Returns:
        Values by id; ``truth_error_*`` only with a truth other than ``motion``, ``deviation_*`` only with an original.

    Raises:
        ValueError: If the clips differ in their number of frames or their rate.
    """
    return metrics_of_tracks(compute_artefact_tracks(motion, truth)) | distance_metrics(motion, truth, original)


def distance_metrics(motion: BodyMotion, truth: BodyMotion | None, original: BodyMotion | None) -> dict[str, float]:
    """Return the metrics of a clip by id that compare it with another one; arguments are those of ``artefact_metrics``."""
    values = {}
    for name, other in (("deviation", original), ("truth_error", None if truth is motion else truth)):
        if other is not None:
            values[f"{name}_local"], values[f"{name}_world"] = mean_distance_local_mm(motion, other), mean_distance_world_mm(motion, other)
    return values


def metrics_of_tracks(tracks: ArtefactTracks) -> dict[str, float]:
    """Return the metrics that follow from a clip's tracks, by id."""
    return {
        "foot_skate": foot_skate(tracks),
        "skating_ratio": skating_ratio(tracks),
        "floating": floating(tracks),
        "ground_penetration": ground_penetration(tracks),
        "self_penetration": float(np.mean(tracks.penetration_depth > MIN_PENETRATION_M)),
        "self_penetration_depth": 1e3
        * float(np.mean(np.where(tracks.penetration_depth > MIN_PENETRATION_M, tracks.penetration_depth, 0.0))),
        "jitter": 1e-3 * _mean(tracks.jerk),
        "imbalance": imbalance(tracks),
    }


def foot_skate(tracks: ArtefactTracks) -> float:
    """Return the mean horizontal speed [cm/s] of a foot's lowest point while it is in contact by height in two successive frames.

    The speed is that of the material point that is lowest in the later frame. Source: PhysDiff, per second.
    """
    return 100.0 * _mean(tracks.foot_speed[tracks.sustained_contacts])


def skating_ratio(tracks: ArtefactTracks) -> float:
    """Return the share of frames in which a foot is below 5 cm in two successive frames and faster than 0.5 m/s. Source: GMD."""
    low = tracks.foot_height < SKATE_HEIGHT_M
    skating = low[1:] & low[:-1] & (tracks.foot_speed[1:] > SKATE_SPEED_M_S)
    return _mean(skating[:, 0] | skating[:, 1])


def floating(tracks: ArtefactTracks) -> float:
    """Return the mean height [mm] of the body's lowest point where it is over 5 mm, else 0, without the frames in which the truth flies."""
    heights = tracks.lowest[~tracks.is_airborne]
    return 1e3 * _mean(np.where(heights > GROUND_TOLERANCE_M, heights, 0.0))


def ground_penetration(tracks: ArtefactTracks) -> float:
    """Return the mean depth [mm] of the body's lowest point under the ground where it is over 5 mm, else 0."""
    return 1e3 * _mean(np.where(tracks.lowest < -GROUND_TOLERANCE_M, -tracks.lowest, 0.0))


def imbalance(tracks: ArtefactTracks) -> float:
    """Return the share of frames with a contact whose centre of mass is over 5 cm outside the feet in contact. Source: thesis 4.5.1."""
    return _mean(tracks.com_overhang[tracks.contacts.any(axis=1)] > BALANCE_MARGIN_M)


def mean_distance_local_mm(motion: BodyMotion, other: BodyMotion) -> float:
    """Return the mean distance of the joints with the roots aligned [mm]."""
    return 1e3 * float(distances_local(motion, other).mean())


def mean_distance_world_mm(motion: BodyMotion, other: BodyMotion) -> float:
    """Return the mean distance of the joints in the world [mm]."""
    return 1e3 * float(distances_world(motion, other).mean())


def contact_agreement(contacts_by_force: np.ndarray, contacts_by_height: np.ndarray) -> dict[str, float]:
    """Return how well contacts by height agree with the contacts by force of a simulation.

    Args:
        contacts_by_force: Whether a foot carries at least 0.05 of body weight, bool, any shape.
        contacts_by_height: Whether its lowest point is under 2 cm, bool, same shape.

    Returns:
        Shares of all feet in all frames: ``agree``, ``height_alone`` (low, but without load), ``force_alone`` (loaded, but not low)
        and ``commoner``, what always guessing the commoner answer by force would reach. Empty without frames.

    Raises:
        ValueError: If the shapes differ.
    """
    if contacts_by_force.shape != contacts_by_height.shape:
        raise ValueError(f"contacts by force have shape {contacts_by_force.shape}, by height {contacts_by_height.shape}: should be equal")
    if not contacts_by_force.size:
        return {}
    carried = float(contacts_by_force.mean())
    return {
        "agree": float(np.mean(contacts_by_force == contacts_by_height)),
        "height_alone": float(np.mean(contacts_by_height & ~contacts_by_force)),
        "force_alone": float(np.mean(contacts_by_force & ~contacts_by_height)),
        "commoner": max(carried, 1.0 - carried),
    }


def _mean(values: np.ndarray) -> float:
    """Return the mean of values; 0 if there are none."""
    return float(values.mean()) if len(values) else 0.0


def support_slide(clip: BodyMotion) -> float:
    """Return the mean horizontal speed of the slower foot's lowest point [cm/s]; it should be 0 while either foot stands."""
    return 100.0 * float(sole_speeds(clip).min(axis=1).mean())
