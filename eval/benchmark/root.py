"""Benchmark of root models, frame by frame and on whole clips, against their bare networks and plainer reconstructions of a root.

The models are built from ``configs/`` and not trained: speed does not depend on the weights. Everything runs on one thread.
Motion at 100 Hz is real time at 100 frames/s.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import repeat

import numpy as np
import torch

from agents.root.model import RootModel
from agents.root.networks.gru import GruNetwork
from agents.root.path import WINDOWS_PER_BATCH, check_length
from agents.root.reconstruct import reconstruct_root
from agents.root.recurrent.patches import PATCH_FRAMES
from agents.root.recurrent.velocity_filter import patch_displacements, patch_steps
from agents.root.recurrent_path import clip_features, patch_motion
from agents.root.recurrent_stream import make_patch_predictor
from agents.root.stream import RootStream
from agents.root.windows import window_features
from configs import load
from datasets.cleanup.stance_root_filter import StanceRootFilter, relative_soles
from datasets.imu.free_acceleration import accelerations_from_pose
from datasets.imu.root_features import ROOT_RATE_HZ, RootFrames, root_frames
from datasets.imu.suit_simulation import track_root
from datasets.library.sources import load_clips
from datasets.motion.clip import BodyMotion
from datasets.motion.kinematics import resample
from eval.benchmark.timing.interleaved import BenchmarkCase, BenchmarkResult, interleave, torch_threads
from trainers.supervised.root_config import RootConfig

OURS = "Root3D stream"
PEERS = ("Root3D in plain PyTorch", "foot contacts")


@dataclass(frozen=True)
class RootTask:
    """Input of all cases.

    Attributes:
        clip: Clip at 100 Hz.
        accelerations: Free accelerations of its sensors [m/s^2], shape (N, 19, 3).
        frames: Number of frames that are streamed in a round; whole-clip cases take all.
    """

    clip: BodyMotion
    accelerations: np.ndarray
    frames: int


def benchmark_root(motions: str, rounds: int, after_round: Callable[[], None] = lambda: None) -> BenchmarkResult:
    """Return the rates of Root3D and of the planar model beside their limits and peers.

    Args:
        motions: Motion source, of whose clips the longest is taken.
        rounds: Number of rounds to keep; a round takes about two seconds.
        after_round: Called after each round.
    """
    clip = resample(max(load_clips(motions), key=lambda clip: clip.seconds), ROOT_RATE_HZ)
    return measure_root(RootTask(clip, accelerations_from_pose(clip), min(200, len(clip))), rounds, after_round)


def measure_root(task: RootTask, rounds: int, after_round: Callable[[], None] = lambda: None) -> BenchmarkResult:
    """Return the rates for a task.

    Raises:
        InputError: If the task is shorter than a window.
    """
    root3d, planar = _untrained("root3d"), _untrained("planar")
    check_length(planar.spec, task.frames)
    cases = [
        *_streams(root3d, planar, task),
        *_whole_clips("Root3D", root3d, task),
        *_whole_clips("planar", planar, task),
        BenchmarkCase(PEERS[0], "a patch a call: root_frames of the last 8, PyTorch's module, the filters", _plainly(root3d, task)),
        BenchmarkCase(PEERS[1], "track_root: standing feet and the pelvis' acceleration, whole clip", _by_contacts(task)),
    ]
    with torch_threads(1):
        rates = interleave(cases, rounds, after_round)
    return BenchmarkResult("root", "frames/s", cases, rates, OURS, PEERS)


def _untrained(name: str) -> RootModel:
    """Return an untrained model of ``configs/<name>.yaml``."""
    spec = load.load_config(RootConfig, load.CONFIG_DIR / f"{name}.yaml").model
    return RootModel(spec).eval()


def _streams(root3d: RootModel, planar: RootModel, task: RootTask) -> list[BenchmarkCase]:
    """Return the cases of both models frame by frame, and of their networks alone on as many patches or windows."""
    alone, planar_alone = "Root3D network, unrolled", "planar network, a window a call"
    real_time = f"ours, a frame a call, all that reconstruct_root does; real time is {ROOT_RATE_HZ:g}"
    return [
        BenchmarkCase(OURS, real_time, _streaming(root3d, task), limit=alone),
        BenchmarkCase(alone, "its matrices alone, a patch of 4 frames a call", _one_by_one(root3d, task)),
        BenchmarkCase("planar stream", real_time, _streaming(planar, task), limit=planar_alone),
        BenchmarkCase(planar_alone, "PyTorch's module alone", _module_alone(planar, task, 1, task.frames)),
    ]


def _whole_clips(name: str, model: RootModel, task: RootTask) -> list[BenchmarkCase]:
    """Return the cases of a model on the whole clip, and of its network alone on all windows."""
    limit = f"{name} network, in batches"

    def run() -> int:
        reconstruct_root(model, task.clip, task.accelerations if model.spec.accelerations else None)
        return len(task.clip)

    return [
        BenchmarkCase(f"{name}, whole clip", f"ours, reconstruct_root; real time is {ROOT_RATE_HZ:g}", run, limit=limit),
        BenchmarkCase(
            limit,
            "PyTorch's module alone" + (f" on all windows, {WINDOWS_PER_BATCH} at a time" if model.spec.is_planar else " on all patches"),
            _module_alone(model, task, WINDOWS_PER_BATCH, len(task.clip)),
        ),
    ]


def _streaming(model: RootModel, task: RootTask) -> Callable[[], int]:
    """Return a block that pushes the frames through a stream."""
    stream = RootStream(model)
    accelerations = task.accelerations if model.spec.accelerations else repeat(None)

    def run() -> int:
        for rotations, measured in zip(task.clip.local_rotations[: task.frames], accelerations, strict=False):
            stream.push(rotations, measured)
        stream.finish()
        return task.frames

    return run


def _one_by_one(model: RootModel, task: RootTask) -> Callable[[], int]:
    """Return a block that puts the patches of the frames through Root3D's network without PyTorch."""
    patches = clip_features(model.spec, root_frames(task.clip, task.accelerations))[: task.frames // PATCH_FRAMES]
    predict = make_patch_predictor(model)

    def run() -> int:
        for patch in patches:
            predict(patch)
        return PATCH_FRAMES * len(patches)

    return run


def _module_alone(model: RootModel, task: RootTask, batch: int, count: int) -> Callable[[], int]:
    """Return a block that puts ``count`` frames of a clip through a network, ``batch`` windows at a time; Root3D's sees all at once."""
    if model.spec.is_recurrent:
        batches = (torch.from_numpy(clip_features(model.spec, root_frames(task.clip, task.accelerations)))[None],)
    else:
        batches = _windows(model, task.clip)[:count].split(batch)

    @torch.inference_mode()
    def run() -> int:
        for windows in batches:
            model.network(windows)
        return count

    return run


def _plainly(model: RootModel, task: RootTask) -> Callable[[], int]:
    """Return a block that predicts Root3D's path patch by patch with the functions for whole clips."""
    network, window = model.network, model.spec.window
    assert isinstance(network, GruNetwork)

    @torch.inference_mode()
    def run() -> int:
        filter_ = StanceRootFilter(ROOT_RATE_HZ, np.zeros(3), relative_soles(task.clip.local_rotations[0]), model.spec.slide_speed)
        remembered, velocity = None, np.zeros((1, 3))
        for first in range(0, task.frames - window + 1, PATCH_FRAMES):
            frames = root_frames(task.clip.cut(first, first + window), task.accelerations[first : first + window])
            seen = torch.from_numpy(clip_features(model.spec, frames))[None]
            outputs, remembered = network.step(model.normalise(seen), remembered)
            steps = patch_steps(outputs[0].numpy().astype(float), patch_motion(frames, np.zeros(1, dtype=int), accelerations=True))
            moved = patch_displacements(steps, velocity)[0]
            velocity = steps.keep * velocity + steps.gained
            for frame, step in enumerate(np.diff(moved, axis=0, prepend=0.0), start=first + 1):
                filter_.step(step, relative_soles(task.clip.local_rotations[frame]))
        return task.frames - window + 1

    return run


def _by_contacts(task: RootTask) -> Callable[[], int]:
    """Return a block that tracks the root by foot contacts, as a suit's software does."""

    def run() -> int:
        return len(track_root(task.clip.local_rotations, task.accelerations[:, 0], 1.0))

    return run


def _windows(model: RootModel, clip: BodyMotion) -> torch.Tensor:
    """Return the features (B, W, F) of all windows of a clip that a planar model sees."""
    frames = RootFrames(*(torch.from_numpy(part) for part in root_frames(clip)))
    return window_features(model.spec, frames, torch.arange(len(clip) - model.spec.window + 1))
