"""Restoration of a whole clip by a restoring network: its poses corrected, and what the network says of them."""

from dataclasses import dataclass, replace

import numpy as np
import torch

from agents.restore.kinematics import correct_rotations
from agents.restore.mirror import mirror_prediction, mirror_rotations
from agents.restore.model import RestoreModel, RestorePrediction
from agents.restore.spec import PATCH_FRAMES, RESTORE_RATE_HZ, STEP_RATE_HZ
from datasets.motion.clip import BodyMotion
from datasets.motion.frame_blocks import by_blocks
from datasets.motion.humanoid import SKELETON
from datasets.motion.kinematics import body_poses, resample
from datasets.motion.rotation import conjugate, multiply, normalise
from datasets.motion.smoothing import smooth_motion

BATCH_WINDOWS = 32  # that go through the network at once
# Weight of the variance by which constants are shrunk: a component c of standard deviation s is multiplied by c^2 / (c^2 + SHRINKAGE s^2).
SHRINKAGE = 0.1
_PARENTS = list(SKELETON.parents[1:])


@dataclass(frozen=True)
class Restoration:
    """Corrected clip of T frames, and what the network says of it.

    Attributes:
        motion: The clip with corrected poses; its root path is the clip's own.
        constant: Constant misalignment of each body, as the rotation vector that corrects it in the body's own frame [rad], shape (20, 3);
            shrunk where it is not sure.
        constant_std: Standard deviation of its error [rad], shape (20, 3).
        contacts: Probability that the left and the right foot stand, and heel and toe of each, shape (T, 6).
        root: Height of the pelvis [m] and its velocity ahead and to the left in its heading [m/s], shape (T, 3).
    """

    motion: BodyMotion
    constant: np.ndarray
    constant_std: np.ndarray
    contacts: np.ndarray
    root: np.ndarray


@torch.inference_mode()
def restore_poses(model: RestoreModel, clip: BodyMotion, seen: np.ndarray | None = None) -> Restoration:
    """Return a clip with the faults taken out of its poses.

    A clip longer than the network's window is seen in windows that overlap by half. What they say of the constants is averaged, each with
    the weight of its precision, and shrunk, so that little is done where little can be told; everything else fades from one window to the
    next.

    The network sees the smoothed clip: how much a recording moves above a few hertz tells its capture system, and not its faults.
    The corrections are those of the clip itself, whose quick movements stay.

    Args:
        model: Trained network.
        clip: Clip of any length and rate; its root path is not used.
        seen: Frames that the network is to see, at least one, shape (T,); all if None. In the others no foot stands, and what is found is
            the constants of those that it sees.
    """
    smooth = resample(smooth_motion(clip), RESTORE_RATE_HZ)
    turns = by_blocks(lambda part: (body_poses(smooth.cut(part.start, part.stop))[1].astype(np.float32),), len(smooth))[0]
    rotations = torch.from_numpy(turns.copy())  # one that may be written into, as PyTorch wants it
    frames, window = len(rotations), model.spec.window
    last = max(frames - window, 0) // PATCH_FRAMES * PATCH_FRAMES
    starts = torch.tensor([*range(0, last, window // 2 // PATCH_FRAMES * PATCH_FRAMES or PATCH_FRAMES), last])
    rows = starts[:, None] + torch.arange(window)
    inside = rows.clamp(max=frames - 1)
    mask = (rows < frames) & _seen_frames(seen, clip, frames)[inside]
    rows, inside, mask = (table[mask.any(dim=1)] for table in (rows, inside, mask))
    batches = zip(inside.split(BATCH_WINDOWS), mask.split(BATCH_WINDOWS), strict=True)
    parts = [_predict(model, rotations[some], within) for some, within in batches]
    predicted = RestorePrediction(*(torch.cat(tracks) for tracks in zip(*parts, strict=True)))
    precision = torch.exp(-2.0 * predicted.constant_log_std)
    constant, variance = (predicted.constant * precision).sum(0) / precision.sum(0), 1.0 / precision.mean(0)
    constant = constant**3 / (constant**2 + SHRINKAGE * variance)
    every = slice(None, None, PATCH_FRAMES)
    varying = _fade(predicted.varying, rows[:, every] // PATCH_FRAMES, mask[:, every], (frames - 1) // PATCH_FRAMES + 1)
    correction = _at_frames((constant + varying).double().numpy(), STEP_RATE_HZ, clip)

    return Restoration(
        correct_clip(clip, correction),
        constant.double().numpy(),
        variance.sqrt().double().numpy(),
        _at_frames(_fade(torch.sigmoid(predicted.contacts), rows, mask, frames).double().numpy(), RESTORE_RATE_HZ, clip),
        _at_frames(_fade(predicted.root, rows, mask, frames).double().numpy(), RESTORE_RATE_HZ, clip),
    )


def correct_clip(clip: BodyMotion, correction: np.ndarray) -> BodyMotion:
    """Return a clip whose bodies are turned: those below a turned one stay as they are in the world, knees and elbows stay hinges.

    Args:
        clip: Clip of T frames.
        correction: Rotation vectors by which each body is turned in its own frame [rad], shape (T, 20, 3).
    """

    def corrected(part: slice) -> tuple[np.ndarray, ...]:
        turned = torch.from_numpy(body_poses(clip.cut(part.start, part.stop))[1])
        world = correct_rotations(turned, torch.from_numpy(correction[part])).numpy()
        local = world.copy()
        local[:, 1:] = multiply(conjugate(world[:, _PARENTS]), world[:, 1:])
        return (normalise(local),)

    return replace(clip, local_rotations=by_blocks(corrected, len(clip))[0])


def _predict(model: RestoreModel, rotations: torch.Tensor, mask: torch.Tensor) -> RestorePrediction:
    """Return the mean of what the network says of windows (B, T, 20, 4), and of their mirror images."""
    said, mirrored = model(rotations, mask), mirror_prediction(model(mirror_rotations(rotations), mask))
    return RestorePrediction(*(0.5 * (one + other) for one, other in zip(said, mirrored, strict=True)))


def _seen_frames(seen: np.ndarray | None, clip: BodyMotion, frames: int) -> torch.Tensor:
    """Return which of the clip's ``frames`` at the network's rate are seen, from those of the clip itself (T,)."""
    if seen is None:
        return torch.ones(frames, dtype=torch.bool)
    nearest = np.minimum(np.arange(frames) / RESTORE_RATE_HZ * clip.fps + 0.5, len(clip) - 1).astype(int)
    return torch.from_numpy(seen[nearest])


def _fade(tracks: torch.Tensor, rows: torch.Tensor, mask: torch.Tensor, frames: int) -> torch.Tensor:
    """Return what windows say of each frame, faded from one window to the next; zero of frames that none says anything of.

    Args:
        tracks: What W windows of T frames say, shape (W, T, ...).
        rows: Their frames, shape (W, T).
        mask: Which of these are frames of the clip that are seen, shape (W, T).
        frames: Number of frames of the clip.
    """
    length = rows.shape[1]
    weights = torch.minimum(torch.arange(1, length + 1), torch.arange(length, 0, -1)).expand(rows.shape)[mask].float()
    total = torch.zeros(frames).index_add_(0, rows[mask], weights)
    ends = (1,) * (tracks.ndim - 2)
    summed = torch.zeros(frames, *tracks.shape[2:]).index_add_(0, rows[mask], tracks[mask] * weights.view(-1, *ends))
    return summed / total.clamp(min=1.0).view(-1, *ends)


def _at_frames(track: np.ndarray, rate: float, clip: BodyMotion) -> np.ndarray:
    """Return a track (N, ...) of a rate [Hz] at the frames of a clip, linear in between and as it ends afterwards, shape (T, ...)."""
    at = np.minimum(np.arange(len(clip)) / clip.fps * rate, len(track) - 1)
    before = np.minimum(at.astype(int), max(len(track) - 2, 0))
    share = (at - before).reshape(-1, *(1,) * (track.ndim - 1))
    return track[before] * (1.0 - share) + track[np.minimum(before + 1, len(track) - 1)] * share
