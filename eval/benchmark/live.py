"""Benchmark of the live service: rates and answer times of frames, beside the bare network and a network that sees its whole second.

A frame is all that happens between a line that was read and one to be written: decoding, calibration, network, upper body, held feet and
encoding, on one thread. A user sends 45 a second, 20 users need 900. One row goes through sockets to a service in another process.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from itertools import cycle
from pathlib import Path
from time import perf_counter

import numpy as np
import torch

from agents.lower_body.model import MASKS, LowerBodyModel, LowerBodyPrediction
from agents.lower_body.stream import WARM_UP_FRAMES, LowerBodyStream
from agents.weights.pretrained import PRETRAINED_LOWER_BODY
from datasets.library.sources import load_clips
from datasets.motion.clip import BodyMotion
from datasets.trackers.joint_features import FEATURES_PER_JOINT
from datasets.trackers.trackers import ALL_TRACKER_NAMES, TRACKER_NAMES, TRACKER_RATE_HZ, TrackerPoses
from eval.benchmark.timing.interleaved import BenchmarkCase, BenchmarkResult, interleave, torch_threads
from eval.benchmark.timing.live_load import LockstepClients, run_service
from eval.live.messages import LIVE, STATES
from eval.live.solver import CALIBRATION_FRAMES, LiveBodySolver
from eval.live.virtual_user import TrackerReplay, replay_as_trackers
from eval.live.wire_protocol import Codec, TrackerFrame
from eval.study.lobstr.variants import USER_HEIGHTS_CM

USERS = 20
FRAMES_PER_ROUND = 180  # of each user
OURS, LIMIT, WINDOWED = "one user", "network step", "one user, windows"
_WARM_UP_FRAMES = CALIBRATION_FRAMES + WARM_UP_FRAMES + 10  # frames after which everybody is live


class SimulatedUsers:
    """Virtual users who perform a clip again and again, each from another frame on."""

    def __init__(self, clip: BodyMotion, count: int) -> None:
        """Simulate the trackers of ``count`` users on a clip at 45 fps."""
        self.codec = Codec.of("openxr")
        self._done = [replay_as_trackers(clip, USER_HEIGHTS_CM[user % len(USER_HEIGHTS_CM)] / 100.0, user) for user in range(count)]
        self._frames = [_endless(done, user * len(clip) // count) for user, done in enumerate(self._done)]
        self._number = 0

    def lines(self) -> list[bytes]:
        """Return the next frame of each user."""
        self._number += 1
        lines = []
        for done, frames in zip(self._done, self._frames, strict=True):
            frame = next(frames)
            lines.append(self.codec.frame(self._number, TrackerPoses(done.trackers.positions[frame], done.trackers.rotations[frame])))
        return lines


class TimedFrames:
    """Times the answers to users' frames, round by round."""

    def __init__(self, users: SimulatedUsers, answer: Callable[[Sequence[bytes]], Sequence[bytes]]) -> None:
        """Calibrate and warm up, until all users are live."""
        self._users, self._answer = users, answer
        self._lines: list[list[bytes]] = []
        self._waits: list[float] = []
        answers: Sequence[bytes] = ()
        for _ in range(_WARM_UP_FRAMES):
            answers = answer(users.lines())
        if any(f'"{STATES[LIVE]}"'.encode() not in line for line in answers):
            raise RuntimeError("a user is not live after calibration and warm-up: the benchmark would measure something else")

    def prepare(self) -> None:
        """Encode the lines of a round."""
        self._lines = [self._users.lines() for _ in range(FRAMES_PER_ROUND)]

    def run(self) -> float:
        """Answer the lines; return the number of frames."""
        for lines in self._lines:
            begin = perf_counter()
            self._answer(lines)
            self._waits.append(perf_counter() - begin)
        return float(sum(map(len, self._lines)))

    def latencies_s(self) -> np.ndarray:
        """Return the duration of each call [s], without the first round, which warms up."""
        return np.array(self._waits[FRAMES_PER_ROUND:])


class WindowStream(LowerBodyStream):
    """Stream in LoBSTr's way: the network sees the whole last second in every frame; its features are kept."""

    def __init__(self, model: LowerBodyModel, users: int) -> None:
        """Begin the streams of ``users`` users."""
        super().__init__(model, users)
        joints = len(ALL_TRACKER_NAMES)
        self._features = torch.zeros(users, WARM_UP_FRAMES, joints, FEATURES_PER_JOINT)
        self._masks = torch.zeros(users, WARM_UP_FRAMES, joints, MASKS, dtype=torch.bool)

    def _predict(self, users: torch.Tensor, features: torch.Tensor, masks: torch.Tensor) -> LowerBodyPrediction:
        for kept, new in ((self._features, features), (self._masks, masks)):
            kept[users] = torch.cat([kept[users, 1:], new[:, None]], 1)
        return LowerBodyPrediction(*(part[:, -1] for part in self._model(self._features[users], self._masks[users])))


def benchmark_live(motions: str, rounds: int, after_round: Callable[[], None] = lambda: None) -> BenchmarkResult:
    """Return the rates and answer times of the package's network.

    Args:
        motions: Motion source, of whose clips the longest is performed.
        rounds: Number of rounds to keep; a round takes about four seconds.
        after_round: Called after each round.
    """
    return measure_live(PRETRAINED_LOWER_BODY, max(load_clips(motions, fps=TRACKER_RATE_HZ), key=len), rounds, after_round)


def measure_live(
    file: Path, clip: BodyMotion, rounds: int, after_round: Callable[[], None] = lambda: None, users: int = USERS
) -> BenchmarkResult:
    """Return the rates and answer times for a network's file, a clip at 45 fps and a number of users."""
    with torch_threads(1), ExitStack() as stack:
        cases, blocks = _cases(file, clip, users, stack)
        rates = interleave(cases, rounds, after_round)
        latencies_s = {name: block.latencies_s() for name, block in blocks.items()}
        return BenchmarkResult("live", "frames/s", cases, rates, OURS, (WINDOWED,), latencies_s)


def _cases(file: Path, clip: BodyMotion, count: int, stack: ExitStack) -> tuple[list[BenchmarkCase], dict[str, TimedFrames]]:
    """Return the benchmark cases, and the blocks of those with answer times; ``stack`` ends the service."""
    model, one, many = LowerBodyModel.load(file)[0], SimulatedUsers(clip, 1), SimulatedUsers(clip, count)
    windowed = LiveBodySolver(model, 1)
    windowed._stream = WindowStream(model, 1)
    in_step = LockstepClients(stack.enter_context(run_service(file, count)), count, many.codec)
    stack.callback(in_step.close)
    together, limit, needed = (
        f"{count} users",
        f"network step, {count} users",
        f"{count * TRACKER_RATE_HZ:g} frames/s are {TRACKER_RATE_HZ:g} a user",
    )
    blocks = {
        OURS: (TimedFrames(one, _answering(LiveBodySolver(model, 1), one.codec)), "ours: line to line, a frame a call", LIMIT),
        together: (
            TimedFrames(many, _answering(LiveBodySolver(model, count), many.codec)),
            f"ours: a frame of each a call; {needed}",
            limit,
        ),
        f"{together}, sockets": (
            TimedFrames(SimulatedUsers(clip, count), in_step.exchange),
            f"the service in another process; {needed}",
            limit,
        ),
        WINDOWED: (
            TimedFrames(SimulatedUsers(clip, 1), _answering(windowed, one.codec)),
            f"as ours, but {WARM_UP_FRAMES} steps of the network each time",
            LIMIT,
        ),
    }
    cases = [BenchmarkCase(name, what, block.run, block.prepare, bound) for name, (block, what, bound) in blocks.items()]
    cases += [
        BenchmarkCase(LIMIT, "PyTorch's LSTM cells and the layers around them alone", _network(model, 1)),
        BenchmarkCase(limit, f"the same for {count} at once", _network(model, count)),
    ]
    return cases, {name: block for name, (block, _, _) in blocks.items()}


def _answering(bodies: LiveBodySolver, codec: Codec) -> Callable[[Sequence[bytes]], Sequence[bytes]]:
    """Return a function that answers a frame of each user, from lines to lines."""
    rows = np.arange(bodies.users)

    def answer(lines: Sequence[bytes]) -> Sequence[bytes]:
        frames = [frame for line in lines if isinstance(frame := codec.read(line), TrackerFrame)]
        trackers = TrackerPoses(*(np.stack([frame.trackers[part] for frame in frames]) for part in range(2)))
        solved = bodies.step(rows, trackers)
        return [
            codec.answer(frame.number, STATES[int(state)], root, rotations, contacts, float(scale), 0.0)
            for frame, root, rotations, contacts, state, scale in zip(frames, *solved[:5], strict=True)
        ]

    return answer


def _network(model: LowerBodyModel, users: int) -> Callable[[], float]:
    """Return a block of the network's steps alone, states carried."""
    shape = (FRAMES_PER_ROUND, users, len(ALL_TRACKER_NAMES), FEATURES_PER_JOINT)
    features = torch.from_numpy(np.random.default_rng(0).normal(size=shape).astype(np.float32))
    masks = (torch.arange(len(ALL_TRACKER_NAMES)) < len(TRACKER_NAMES))[None, :, None].expand(users, -1, MASKS)

    @torch.inference_mode()
    def run() -> float:
        zero = torch.zeros(users, model.spec.hidden)
        states = [(zero, zero)] * model.spec.layers
        for frame in features:
            _, states = model.step(frame, masks, states)
        return float(FRAMES_PER_ROUND * users)

    return run


def _endless(done: TrackerReplay, start: int) -> Iterator[int]:
    """Yield the frames of a user: T-pose, then the clip from ``start`` on, for ever."""
    clip = range(done.first_clip_frame, len(done.trackers.positions))
    yield from range(done.first_clip_frame)
    yield from cycle([*clip[start:], *clip[:start]])
