"""Measures of the LoBSTr study: distances of predicted lower bodies from the truth, as plain numbers."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from datasets.motion.rotation import to_matrix
from datasets.trackers.lower_body import MOVING_LEG_JOINTS, toe_positions
from datasets.trackers.trackers import TRACKER_RATE_HZ
from eval.metrics.lower_body import (
    body_movement,
    contact_accuracy,
    rotational_error,
    toe_distance_bias,
    toe_distance_error,
    toe_position_error,
    toe_velocity_error,
)
from eval.study.lobstr.evaluation_sessions import EvaluationClip, Session

SOURCE_PREFIXES = {"cmu": "cmu", "bandai": "bnr"}  # prefixes of the names of their clips
Scores = dict[str, float]


class PredictedLegs(NamedTuple):
    """Predicted lower body in all frames that have a second behind them.

    Attributes:
        legs: Rotations of the eight joints, wxyz, shape (S, 8, 4).
        contacts: Ground contacts of the toe-bases, bool, shape (S, 2); None if they are not predicted.
    """

    legs: np.ndarray
    contacts: np.ndarray | None = None

    @property
    def toes(self) -> np.ndarray:
        """Positions of the toe-bases in the pelvis' frame at the standard humanoid's size [m], shape (S, 2, 3)."""
        return toe_positions(to_matrix(self.legs))


def score_clips(clips: Sequence[EvaluationClip], predicted: Sequence[PredictedLegs]) -> Scores:
    """Return all measures over all frames of recorded clips (Tables 1 and 2), and those of Table 1 by folder."""
    pairs = [(clip, one) for clip, one in zip(clips, predicted, strict=True) if clip.is_recorded]
    found = weighted_mean([(len(one.legs), _errors(clip, one)) for clip, one in pairs])
    for source, begins in SOURCE_PREFIXES.items():
        own = weighted_mean([(len(one.legs), _errors(clip, one)) for clip, one in pairs if clip.motion.name.startswith(begins)])
        found |= {f"{name}_{source}": own[name] for name in ("contact_accuracy", "rotational_error", "toe_position_error") if name in own}
    return found


def score_sessions(sessions: Sequence[Session], predicted: Sequence[PredictedLegs], hidden: Sequence[np.ndarray]) -> Scores:
    """Return the measures of Table 3 by category, and of its total and figure 6 over all frames of recorded clips.

    Args:
        sessions: Sessions of one or several users.
        predicted: Predicted legs in each session.
        hidden: Whether each foot would be hidden from its tracker, bool, shape (S, 2) each.
    """
    triples = list(zip(sessions, predicted, hidden, strict=True))
    found = weighted_mean([(len(one.legs), _worn_errors(session, one)) for session, one, _ in triples if session.clip.is_recorded])
    found["toe_distance_total"] = found.pop("toe_distance_error")
    for category in sorted({session.clip.category for session in sessions}):
        own = [(len(one.legs), _worn_errors(session, one)) for session, one, _ in triples if session.clip.category == category]
        found[f"toe_distance_{category}"] = weighted_mean(own)["toe_distance_error"]
    return found | _while_hidden(triples)


def weighted_mean(parts: Sequence[tuple[int, Mapping[str, float]]]) -> Scores:
    """Return the means of measures that all parts have, weighted by the parts' frames."""
    if not parts:
        return {}
    frames = sum(weight for weight, _ in parts)
    shared = [name for name in parts[0][1] if all(name in values for _, values in parts)]
    return {name: sum(weight * values[name] for weight, values in parts) / frames for name in shared}


def _errors(clip: EvaluationClip, predicted: PredictedLegs) -> Scores:
    toes = predicted.toes
    found = {
        "rotational_error": rotational_error(predicted.legs, clip.legs),
        "rotational_error_moving": rotational_error(predicted.legs[:, MOVING_LEG_JOINTS], clip.legs[:, MOVING_LEG_JOINTS]),
        "toe_position_error": toe_position_error(toes, clip.toes),
        "toe_velocity_error": toe_velocity_error(toes, clip.toes, TRACKER_RATE_HZ),
        "toe_distance_error": toe_distance_error(toes, clip.toes),
        "body_movement": body_movement(predicted.legs),
    }
    if predicted.contacts is not None:
        found["contact_accuracy"] = contact_accuracy(predicted.contacts, clip.contacts)
    return found


def _worn_errors(session: Session, predicted: PredictedLegs) -> Scores:
    """Return the measures of a session; distances of toe-bases at the user's own size."""
    true, toes = session.size_ratio * session.clip.toes, float(session.calibration.scale) * predicted.toes
    distances: dict[str, Callable[[np.ndarray, np.ndarray], float]] = {
        "toe_distance_error": toe_distance_error,
        "toe_distance_bias": toe_distance_bias,
        "toe_position_error": toe_position_error,
    }
    return _errors(session.clip, predicted) | {name: measure(toes, true) for name, measure in distances.items()}


def _while_hidden(triples: Sequence[tuple[Session, PredictedLegs, np.ndarray]]) -> Scores:
    """Return the error of toe-bases while their foot is hidden [cm], and the share of hidden frames [%], over recorded clips."""
    errors, masks = [], []
    for session, one, hidden in triples:
        if session.clip.is_recorded:
            off = float(session.calibration.scale) * one.toes - session.size_ratio * session.clip.toes
            errors.append(100.0 * np.linalg.norm(off, axis=-1)[hidden])
            masks.append(hidden)
    share = float(np.mean(np.concat(masks)))
    found = {"hidden_share": 100.0 * share}
    return found | ({"toe_position_error_hidden": float(np.concat(errors).mean())} if share else {})
