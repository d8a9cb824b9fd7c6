"""Errors of a predicted lower body against the true one (docs/metrics.md, lower body; LoBSTr 4.1)."""

import numpy as np

from datasets.motion.rotation import conjugate, multiply, rotation_angle


def contact_accuracy(predicted: np.ndarray, true: np.ndarray) -> float:
    """Return the share of contact labels that are right [%].

    Args:
        predicted: Predicted labels: whether each toe-base is in contact, shape (T, 2).
        true: True labels, shape (T, 2).
    """
    return 100.0 * float(np.mean(predicted == true))


def rotational_error(predicted: np.ndarray, true: np.ndarray) -> float:
    """Return the mean angle between predicted and true local rotations [deg].

    Args:
        predicted: Predicted quaternions of J joints, wxyz, shape (T, J, 4).
        true: True quaternions, shape (T, J, 4).
    """
    return float(np.degrees(rotation_angle(multiply(conjugate(true), predicted)).mean()))


def toe_position_error(predicted: np.ndarray, true: np.ndarray) -> float:
    """Return the mean distance between predicted and true toe-bases [cm].

    Args:
        predicted: Predicted positions, left and right, in the pelvis' frame [m], shape (T, 2, 3).
        true: True positions, shape (T, 2, 3).
    """
    return 100.0 * float(np.linalg.norm(predicted - true, axis=-1).mean())


def toe_velocity_error(predicted: np.ndarray, true: np.ndarray, fps: float) -> float:
    """Return the mean length of the difference between the velocities of predicted and true toe-bases [cm/s] (figure 3).

    Args:
        predicted: Predicted positions, left and right, in the pelvis' frame [m], shape (T, 2, 3).
        true: True positions, shape (T, 2, 3).
        fps: Frames per second.
    """
    return 100.0 * fps * float(np.linalg.norm(np.diff(predicted, axis=0) - np.diff(true, axis=0), axis=-1).mean())


def toe_distance_error(predicted: np.ndarray, true: np.ndarray) -> float:
    """Return the mean absolute error of the distance between the toe-bases [cm] (section 4.1.3).

    Args:
        predicted: Predicted positions, left and right, both in the same frame [m], shape (T, 2, 3).
        true: True positions, shape (T, 2, 3).
    """
    return 100.0 * float(np.abs(_toe_distances(predicted) - _toe_distances(true)).mean())


def toe_distance_bias(predicted: np.ndarray, true: np.ndarray) -> float:
    """Return the mean signed error of the distance between the toe-bases, negative if too near [cm]; arguments as before."""
    return 100.0 * float((_toe_distances(predicted) - _toe_distances(true)).mean())


def body_movement(local_rotations: np.ndarray) -> float:
    """Return the mean over frames of the sum over joints of the angle turned since the frame before [deg].

    Args:
        local_rotations: Local quaternions of J joints, wxyz, shape (T, J, 4).

    Source: Starke et al. 2020, "Local motion phases".
    """
    turned = rotation_angle(multiply(conjugate(local_rotations[:-1]), local_rotations[1:]))
    return float(np.degrees(turned.sum(axis=-1).mean()))


def _toe_distances(toes: np.ndarray) -> np.ndarray:
    """Return the distance between the toe-bases [m], shape (T,)."""
    return np.linalg.norm(toes[:, 0] - toes[:, 1], axis=-1)
