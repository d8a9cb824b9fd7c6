"""Augmentation of a restoring network's windows: further misalignments, other skeletons' conventions, clean clips, mirrored bodies.

B windows of T frames; all rotations are of bodies in the world, wxyz.
"""

import torch

from agents.restore.features import heading_rotation
from agents.restore.kinematics import keep_hinges
from agents.restore.mirror import mirror_contacts, mirror_root, mirror_rotations, mirror_vectors
from agents.restore.spec import PATCH_FRAMES
from datasets.motion.humanoid import BODY_COUNT, BODY_NAMES
from datasets.motion.mirror import OTHER_SIDE
from datasets.motion.rotation import conjugate, from_rotation_vector, multiply
from trainers.supervised.restore_config import RestoreLearnerConfig
from trainers.supervised.restore_data import RestoreFrames

_RIGHT = [body for body, name in enumerate(BODY_NAMES) if name.endswith("_r")]
_MIDDLE = [body for body, other in enumerate(OTHER_SIDE) if body == other]
_UPPER = [body for body, name in enumerate(BODY_NAMES) if body and not name.startswith(("thigh", "shin", "foot", "toe"))]


def augment_windows(config: RestoreLearnerConfig, windows: RestoreFrames, random: torch.Generator) -> RestoreFrames:
    """Return windows of (B, T, ...) with random faults and conventions.

    Skeletons differ in what zero is, and a network that has seen one kind takes the others' for faults. A convention is the same left
    and right; what differs, or rolls and yaws the middle, is a fault. So both clips get a convention, which has to stay, and the
    captured one gets misalignments, which have to go.

    Args:
        config: Settings of the learner.
        windows: Windows of prepared motion.
        random: Generator of everything drawn.

    Returns:
        Windows whose true rotations are those of the network's steps alone, shape (B, S, 20, 4).
    """
    captured, truth, contacts, root = windows
    batch = len(truth)

    def draw_scales(largest: float) -> torch.Tensor:
        return largest * torch.rand(batch, 1, 1, 1, generator=random)

    if config.mirror:
        captured, truth, contacts, root = _mirror_half(windows)
    if config.exchange_share:
        exchanged = torch.rand(batch, generator=random) < config.exchange_share
        captured, truth = _exchange_upper_bodies(captured, truth, exchanged, torch.randperm(batch, generator=random))
    if config.clean_share:
        is_clean = torch.rand(batch, generator=random) < config.clean_share
        captured = torch.where(is_clean[:, None, None, None], truth, captured)
        scale = draw_scales(config.added_misalignment) * ~is_clean[:, None, None, None]
    else:
        scale = draw_scales(config.added_misalignment)
    faults = scale * torch.randn(batch, 1, BODY_COUNT, 3, generator=random)
    convention = draw_scales(config.convention) * symmetric_misalignment(torch.randn(batch, 1, BODY_COUNT, 3, generator=random))
    shared = from_rotation_vector(convention)
    return RestoreFrames(
        keep_hinges(multiply(captured, multiply(shared, from_rotation_vector(faults)))),
        keep_hinges(multiply(truth[:, ::PATCH_FRAMES], shared)),
        contacts,
        root,
    )


def _exchange_upper_bodies(
    captured: torch.Tensor, truth: torch.Tensor, exchanged: torch.Tensor, partners: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
    """Return windows of which some have the upper body of another one, turned to where their own pelvis faces.

    Somebody can do with arms and trunk whatever the legs do, so this makes many movements of few. The faults go with the bodies.

    Args:
        captured: Captured rotations, shape (B, T, 20, 4).
        truth: True rotations, shape (B, T, 20, 4).
        exchanged: Which windows get another upper body, shape (B,).
        partners: Windows that the upper bodies are from, shape (B,).
    """
    turn = multiply(heading_rotation(truth[:, :, 0]), conjugate(heading_rotation(truth[partners][:, :, 0])))[:, :, None]

    def exchange(rotations: torch.Tensor) -> torch.Tensor:
        others = rotations[partners][:, :, _UPPER]
        mixed = rotations.clone()
        mixed[:, :, _UPPER] = torch.where(exchanged[:, None, None, None], multiply(turn.expand(others.shape), others), mixed[:, :, _UPPER])
        return mixed

    return exchange(captured), exchange(truth)


def symmetric_misalignment(vectors: torch.Tensor) -> torch.Tensor:
    """Return rotation vectors (..., 20, 3) with the right side as the left one's mirror image and pitch alone in the middle."""
    found = vectors.clone()
    found[..., _RIGHT, :] = mirror_vectors(vectors)[..., _RIGHT, :]
    found[..., _MIDDLE, :] = vectors[..., _MIDDLE, :] * vectors.new_tensor([0.0, 1.0, 0.0])
    return found


def _mirror_half(windows: RestoreFrames) -> RestoreFrames:
    """Return windows of which the first half is mirrored."""
    half = len(windows.truth) // 2
    mirrors = (mirror_rotations, mirror_rotations, mirror_contacts, mirror_root)
    return RestoreFrames(*(torch.cat([mirror(track[:half]), track[half:]]) for mirror, track in zip(mirrors, windows, strict=True)))
