"""Mirror images, left and right exchanged, of what a restoring network sees and says, in torch."""

import torch

from agents.restore.model import RestorePrediction
from datasets.motion.mirror import MIRRORED_AXIAL_VECTOR, MIRRORED_QUATERNION, OTHER_SIDE
from datasets.motion.rotation import Constant

_CONTACTS = [1, 0, 4, 5, 2, 3]
_QUATERNION = Constant(MIRRORED_QUATERNION)
_VECTOR = Constant(MIRRORED_AXIAL_VECTOR)
_ROOT = Constant([1.0, 1.0, -1.0])  # height, velocity ahead and to the left


def mirror_rotations(rotations: torch.Tensor) -> torch.Tensor:
    """Return the rotations (..., 20, 4) of the mirrored bodies."""
    return rotations[..., OTHER_SIDE, :] * _QUATERNION.like(rotations)


def mirror_vectors(vectors: torch.Tensor) -> torch.Tensor:
    """Return the rotation vectors (..., 20, 3) of the mirrored bodies, in their own frames."""
    return vectors[..., OTHER_SIDE, :] * _VECTOR.like(vectors)


def mirror_contacts(contacts: torch.Tensor) -> torch.Tensor:
    """Return the contacts (..., 6) of the mirrored feet, heels and toes."""
    return contacts[..., _CONTACTS]


def mirror_root(root: torch.Tensor) -> torch.Tensor:
    """Return the mirrored height and velocity of the pelvis (..., 3)."""
    return root * _ROOT.like(root)


def mirror_prediction(said: RestorePrediction) -> RestorePrediction:
    """Return what a network says of mirrored windows, for the windows themselves."""
    return RestorePrediction(
        mirror_vectors(said.constant),
        said.constant_log_std[..., OTHER_SIDE, :],
        mirror_vectors(said.varying),
        said.varying_log_std[..., OTHER_SIDE],
        mirror_contacts(said.contacts),
        mirror_root(said.root),
    )
