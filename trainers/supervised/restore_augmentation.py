"""Augmentation of a restoring network's windows: further misalignments, other skeletons' conventions, clean clips, mirrored bodies.

B windows of T frames; all rotations are of bodies in the world, wxyz.
"""

import torch

from agents.restore.features import heading_rotation
from agents.restore.kinematics import keep_hinges
from agents.restore.mirror import mirror_contacts, mirror_root, mirror_rotations, mirror_vectors
from agents.restore.spec import PATCH_FRAMES, RESTORE_RATE_HZ
from datasets.motion.humanoid import BODIES, BODY_COUNT, BODY_NAMES, SKELETON
from datasets.motion.mirror import OTHER_SIDE
from datasets.motion.rotation import Constant, conjugate, from_rotation_vector, multiply, rotate
from trainers.supervised.restore_config import RestoreLearnerConfig
from trainers.supervised.restore_data import RestoreFrames

SWAY_HZ = 0.5  # Hz, of the quickest sway
_PITCH = Constant([0.0, 1.0, 0.0])
_RIGHT = [body for body, name in enumerate(BODY_NAMES) if name.endswith("_r")]
_MIDDLE = [body for body, other in enumerate(OTHER_SIDE) if body == other]
_TRUNK = [body for body in _MIDDLE if body]
_ARMS = [[BODY_NAMES.index(f"{part}_{side}") for part in ("collar", "upper_arm", "forearm", "hand")] for side in "lr"]
_UPPER = sorted(_TRUNK + _ARMS[0] + _ARMS[1])
_SWAYING = [body for body in _UPPER if len(BODIES[body].hinges) == 3]


def augment_windows(config: RestoreLearnerConfig, windows: RestoreFrames, random: torch.Generator) -> RestoreFrames:
    """Return windows of (B, T, ...) with random faults, conventions and movements.

    Skeletons differ in what zero is, and a network that has seen one kind takes the others' for faults. A convention is the same left
    and right; what differs, or rolls and yaws the middle, is a fault. So both clips get a convention, which has to stay, and the
    captured one gets misalignments, which have to go.

    Args:
        config: Settings of the learner.
        windows: Windows of prepared motion.
        random: Generator of everything drawn, of the CPU wherever the windows are.

    Returns:
        Windows whose true rotations are those of the network's steps alone, shape (B, S, 20, 4).
    """
    captured, truth, contacts, root = windows
    batch, device = len(truth), truth.device

    def draw_scales(largest: float) -> torch.Tensor:
        return largest * torch.rand(batch, 1, 1, 1, generator=random)

    if config.mirror:
        captured, truth, contacts, root = _mirror_half(windows)
    if config.exchange_share:
        for bodies in (_TRUNK, *_ARMS):
            exchanged = torch.rand(batch, generator=random) < config.exchange_share
            partners = torch.where(exchanged, torch.randperm(batch, generator=random), torch.arange(batch)).to(device)
            captured, truth = _exchange_bodies(captured, truth, bodies, partners)
    if config.sway:
        captured, truth = _sway(captured, truth, draw_scales(config.sway), random)
    if config.clean_share:
        is_clean = torch.rand(batch, 1, 1, 1, generator=random) < config.clean_share
        captured = torch.where(is_clean.to(device), truth, captured)
        scale = draw_scales(config.added_misalignment) * ~is_clean
    else:
        scale = draw_scales(config.added_misalignment)
    faults = scale * torch.randn(batch, 1, BODY_COUNT, 3, generator=random)
    convention = draw_scales(config.convention) * symmetric_misalignment(torch.randn(batch, 1, BODY_COUNT, 3, generator=random))
    shared = from_rotation_vector(convention.to(device))
    return RestoreFrames(
        keep_hinges(multiply(captured, multiply(shared, from_rotation_vector(faults.to(device))))),
        keep_hinges(multiply(truth[:, ::PATCH_FRAMES], shared)),
        contacts,
        root,
    )


def _exchange_bodies(
    captured: torch.Tensor, truth: torch.Tensor, bodies: list[int], partners: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
    """Return windows with some bodies of other ones, turned to where their own pelvis faces.

    Somebody can do with arms and trunk whatever the legs do, so this makes many movements of few. The faults go with the bodies.

    Args:
        captured: Captured rotations, shape (B, T, 20, 4).
        truth: True rotations, shape (B, T, 20, 4).
        bodies: The bodies.
        partners: Windows that these are from, shape (B,).
    """
    heading = heading_rotation(truth[:, :, 0])
    turn = multiply(heading, conjugate(heading[partners]))[:, :, None].expand(*truth.shape[:2], len(bodies), 4)

    def exchange(rotations: torch.Tensor) -> torch.Tensor:
        mixed = rotations.clone()
        mixed[:, :, bodies] = multiply(turn, rotations[:, :, bodies][partners])
        return mixed

    return exchange(captured), exchange(truth)


def _sway(captured: torch.Tensor, truth: torch.Tensor, scale: torch.Tensor, random: torch.Generator) -> tuple[torch.Tensor, torch.Tensor]:
    """Return windows whose joints above the pelvis turn slowly beside what they did, in both clips.

    Args:
        captured: Captured rotations, shape (B, T, 20, 4).
        truth: True rotations, shape (B, T, 20, 4).
        scale: Standard deviation of the turns of each window [rad], shape (B, 1, 1, 1).
        random: Generator of everything drawn.
    """
    batch, frames, device = len(truth), truth.shape[1], truth.device
    shape = (batch, 1, len(_SWAYING), 3)
    cycles = SWAY_HZ / RESTORE_RATE_HZ * torch.rand(shape, generator=random) * torch.arange(frames)[:, None, None]
    turns = (
        2.0**0.5 * scale * torch.randn(shape, generator=random) * torch.sin(2.0 * torch.pi * (cycles + torch.rand(shape, generator=random)))
    )
    parents = [SKELETON.parents[body] for body in _SWAYING]
    own = from_rotation_vector(rotate(truth[:, :, parents], turns.to(device)))
    turned: dict[int, torch.Tensor] = {}  # of each body that turns, in the world
    for body in _UPPER:
        parent = SKELETON.parents[body]
        if body in _SWAYING:
            turn = own[:, :, _SWAYING.index(body)]
            turned[body] = multiply(turned[parent], turn) if parent in turned else turn
        else:  # elbows and wrists stay as they are
            turned[body] = turned[parent]
    upper = torch.stack([turned[body] for body in _UPPER], dim=2)

    def apply(rotations: torch.Tensor) -> torch.Tensor:
        found = rotations.clone()
        found[:, :, _UPPER] = multiply(upper, rotations[:, :, _UPPER])
        return found

    return apply(captured), apply(truth)


def symmetric_misalignment(vectors: torch.Tensor) -> torch.Tensor:
    """Return rotation vectors (..., 20, 3) with the right side as the left one's mirror image and pitch alone in the middle."""
    found = vectors.clone()
    found[..., _RIGHT, :] = mirror_vectors(vectors)[..., _RIGHT, :]
    found[..., _MIDDLE, :] = vectors[..., _MIDDLE, :] * _PITCH.like(vectors)
    return found


def _mirror_half(windows: RestoreFrames) -> RestoreFrames:
    """Return windows of which the first half is mirrored."""
    half = len(windows.truth) // 2
    mirrors = (mirror_rotations, mirror_rotations, mirror_contacts, mirror_root)
    return RestoreFrames(*(torch.cat([mirror(track[:half]), track[half:]]) for mirror, track in zip(mirrors, windows, strict=True)))
