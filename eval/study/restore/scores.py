"""Scores of a restoring network on a pair (docs/metrics.md, restored poses)."""

import numpy as np

from agents.restore.model import RestoreModel
from agents.restore.restore import restore_poses
from datasets.cleanup.foot_contacts import detect_foot_contacts
from datasets.cleanup.plant_feet import plant_feet
from datasets.library.drift_alignment import align_drift
from datasets.library.misalignment import follow_heading, misalignment_tracks
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import body_poses
from eval.clean.restored_poses import restore_clip
from eval.metrics.artefacts import mean_distance_local_mm, stance_skate
from eval.study.restore.suit_pairs import SuitPair

Scores = dict[str, float]


def score_pair(model: RestoreModel, pair: SuitPair) -> Scores:
    """Return the measures of a suit's clip before and after the network.

    Args:
        model: Restoring network.
        pair: Clip and its truth.
    """
    found = restore_poses(model, pair.faulty)
    contacts, said = detect_foot_contacts(pair.truth), found.contacts[:, :2] > 0.5
    captured, true = body_poses(pair.faulty)[1], body_poses(pair.truth)[1]
    constant = misalignment_tracks(captured, follow_heading(true, captured, pair.truth.fps)).mean(axis=0)
    standing = max(contacts.mean(), 1.0 - contacts.mean())
    return {
        "truth_error_local": _error(pair.faulty, pair.truth),
        "restored_error": _error(found.motion, pair.truth),
        "constant": _degrees(constant),
        "constant_error": _degrees(found.constant - constant),
        "within_two_std": float(np.mean(np.abs(found.constant - constant) < 2.0 * found.constant_std)),
        "contact_accuracy": _accuracy(said, contacts),
        "contact_commoner": 100.0 * float(standing),
        "stance_skate_before": stance_skate(pair.faulty, contacts),
        "stance_skate_planted": stance_skate(plant_feet(found.motion, said), contacts),
        "stance_skate_truth": stance_skate(pair.truth, contacts),
        "recognised": 100.0 * (restore_clip(model, pair.faulty).contacts is not None),
    }


def score_clean_clip(model: RestoreModel, clip: BodyMotion) -> Scores:
    """Return how far a clip that is clean already would be moved by the network, and is moved by the stage, which leaves most alone."""
    stage = restore_clip(model, clip)
    return {
        "moved_if_clean": mean_distance_local_mm(restore_poses(model, clip).motion, clip),
        "harm": mean_distance_local_mm(stage.motion, clip),
        "left_alone": 100.0 * (stage.contacts is None),
    }


def score_training(model: RestoreModel, pair: SuitPair) -> Scores:
    """Return the measures by which trainings are compared: of a suit's clip, and of the clean one behind it."""
    found = restore_poses(model, pair.faulty)
    return {
        f"{pair.source} restored_error": _error(found.motion, pair.truth),
        "contact_accuracy": _accuracy(found.contacts[:, :2] > 0.5, detect_foot_contacts(pair.truth)),
        "moved_if_clean": mean_distance_local_mm(restore_poses(model, pair.truth).motion, pair.truth),
    }


def _accuracy(said: np.ndarray, contacts: np.ndarray) -> float:
    """Return the share of contacts that are right [%]."""
    return 100.0 * float(np.mean(said == contacts))


def _error(clip: BodyMotion, truth: BodyMotion) -> float:
    """Return the mean distance of the joints from the truth, which follows the clip's drift, with the roots aligned [mm]."""
    return mean_distance_local_mm(clip, align_drift(truth, clip))


def _degrees(vectors: np.ndarray) -> float:
    """Return the mean angle of rotation vectors [deg]."""
    return float(np.degrees(np.linalg.norm(vectors, axis=-1)).mean())
