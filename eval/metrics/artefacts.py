"""Artefact metrics of a clip (docs/metrics.md): each is a mean of one of the tracks of ``eval.metrics.artefact_tracks``.

T frames. Tracks are in metres, metrics in cm/s, mm and km/s^3.
"""

from collections.abc import Mapping

import numpy as np

from datasets.motion.clip import BodyMotion
from eval.metrics.artefact_tracks import ArtefactTracks, compute_artefact_tracks, distances_local, distances_world, sole_speeds

SKATE_HEIGHT_M, SKATE_SPEED_M_S = 0.05, 0.5  # m, m/s: a foot that is lower and faster skates (GMD)
GROUND_TOLERANCE_M = 0.005  # m; a body whose lowest point is farther from the ground floats or penetrates
MIN_PENETRATION_M = 0.01  # m; a smaller overlap of two shapes is none
REMOVABLE = (
    "stance_skate", "foot_skate", "skating_ratio", "floating", "ground_penetration", "self_penetration", "self_penetration_depth", "jitter",
    "imbalance",
)  # artefacts that a clean clip has little of  # fmt: skip
MAX_TOUCHDOWN_ERROR_S = 0.5  # s; a touch-down that is farther from the truth's is another step's
MIN_EXCESS_SHARE = 0.1  # of the truth's own artefact, by which a clip's is to be larger for there to be something to remove
BALANCE_MARGIN_M = 0.05  # m; a centre of mass that is farther outside the support polygon is out of balance


def artefact_metrics(motion: BodyMotion, truth: BodyMotion | None = None, original: BodyMotion | None = None) -> dict[str, float]:
    """Return all artefact metrics of a clip by id, in the units of docs/metrics.md.

    Args:
        motion: Clip to judge.
        truth: Clean clip of the same frames and rate, where it is known. Its contacts and flights then count.
        original: Clip that ``motion`` was made from, if any: same frames and rate.

    Returns:
        Values by id; ``truth_error_*`` and those of ``contact_metrics`` only with a truth other than ``motion``, ``deviation_*`` only with
        an original.

    Raises:
        ValueError: If the clips differ in their number of frames or their rate.
    """
    tracks = compute_artefact_tracks(motion, truth, original)
    known = contact_metrics(tracks) if truth is not None and truth is not motion else {}
    return metrics_of_tracks(tracks) | known | distance_metrics(motion, truth, original)


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
        "stance_skate": _speed_of_standing_feet(tracks.foot_speed[1:], tracks.stands),
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


def contact_metrics(tracks: ArtefactTracks) -> dict[str, float]:
    """Return how well the feet of a clip stand when those of its truth do, by id, from tracks that were made with that truth."""
    return {
        "contact_agreement": float(np.mean(tracks.own_stands == tracks.stands)),
        "touchdown_error": touchdown_error_ms(tracks.own_stands, tracks.stands, tracks.fps),
    }


def touchdown_error_ms(stands: np.ndarray, truth: np.ndarray, fps: float) -> float:
    """Return the mean distance in time [ms] of each of the truth's touch-downs from the nearest one of the same foot; 0 if there are none.

    A touch-down that has none within ``MAX_TOUCHDOWN_ERROR_S`` counts as that far off.

    Args:
        stands: Whether the left and the right foot stand, bool, shape (T, 2).
        truth: The same in the truth, shape (T, 2).
        fps: Frames per second.

    Source: InstantTrack, HumanScore.
    """
    errors = []
    for own, true in zip(stands.T, truth.T, strict=True):
        begins, expected = (np.flatnonzero(side[1:] & ~side[:-1]) / fps for side in (own, true))
        distances = np.abs(expected[:, None] - begins[None, :]).min(axis=1, initial=MAX_TOUCHDOWN_ERROR_S)
        errors.append(distances)
    return 1e3 * _mean(np.concat(errors))


def stance_skate(motion: BodyMotion, stands: np.ndarray) -> float:
    """Return the mean horizontal speed [cm/s] of a foot's lowest point while that foot stands in two successive frames; 0 if none does.

    Args:
        motion: Clip of T frames.
        stands: Whether the left and the right foot stand, in the truth where that is known, shape (T, 2).
    """
    return _speed_of_standing_feet(sole_speeds(motion), stands)


def _speed_of_standing_feet(speeds: np.ndarray, stands: np.ndarray) -> float:
    """Return the mean [cm/s] of speeds (T - 1, 2) [m/s] since the frame before, of feet that stand (T, 2) in both."""
    return 100.0 * _mean(speeds[stands[1:] & stands[:-1]])


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


def compare_contact_rules(contacts_by_force: np.ndarray, contacts_by_height: np.ndarray) -> dict[str, float]:
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


def removed_shares(before: Mapping[str, float], after: Mapping[str, float], truth: Mapping[str, float]) -> dict[str, float]:
    """Return the share of each artefact's excess over the truth that was removed, by id: (before - after) / (before - truth).

    1 is as clean as the truth, 0 as faulty as before. An artefact of which there was no more than a tenth above the truth's is left out.

    Args:
        before: Artefacts of a clip, or means over clips, by id.
        after: The same after cleaning.
        truth: The same of the clean truth.
    """
    return {
        name: (value - after[name]) / (value - truth[name])
        for name, value in before.items()
        if name in REMOVABLE and name in after and name in truth and value > (1.0 + MIN_EXCESS_SHARE) * truth[name]
    }


def _mean(values: np.ndarray) -> float:
    """Return the mean of values; 0 if there are none."""
    return float(values.mean()) if len(values) else 0.0


def support_slide(clip: BodyMotion) -> float:
    """Return the mean horizontal speed of the slower foot's lowest point [cm/s]; it should be 0 while either foot stands."""
    return 100.0 * float(sole_speeds(clip).min(axis=1).mean())
