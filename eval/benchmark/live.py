"""How quickly frames of the live service are answered: beside the bare network, and a network that sees its whole second each time.

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

from agents.lobstr.model import LobstrModel, leg_matrices
from agents.lobstr.spec import WINDOW
from agents.lobstr.stream import LowerBodyStream
from agents.weights.pretrained import SHIPPED_LOBSTR
from datasets.library.sources import load_clips
from datasets.motion.clip import BodyMotion
from datasets.motion.rotation_matrices import quaternions
from datasets.trackers.features import tracker_features
from datasets.trackers.trackers import PELVIS, RATE, TrackerPoses
from eval.benchmark.timing.interleaved import Contender, Speed, interleave, torch_threads
from eval.benchmark.timing.live_load import InStep, service
from eval.live.messages import LIVE, STATES
from eval.live.protocol import Codec, Frame
from eval.live.solver import CALIBRATION_FRAMES, LiveBodies
from eval.live.virtual_user import Performance, perform
from eval.study.lobstr.variants import HEIGHTS

USERS = 20
FRAMES = 180  # of each user in a round
OURS, LIMIT, WINDOWED = "one user", "network step", "one user, windows"
_READY = CALIBRATION_FRAMES + WINDOW + 10  # frames after which everybody is live


class Users:
    """Virtual users who perform a clip again and again, each from somewhere else in it on."""

    def __init__(self, clip: BodyMotion, count: int) -> None:
        """Take a clip at 45 fps."""
        self.codec = Codec.of("openxr")
        self._done = [perform(clip, HEIGHTS[user % len(HEIGHTS)] / 100.0, user) for user in range(count)]
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


class Block:
    """Frames of users, put through something that answers them, round by round."""

    def __init__(self, users: Users, answer: Callable[[Sequence[bytes]], Sequence[bytes]]) -> None:
        """Have everybody live."""
        self._users, self._answer = users, answer
        self._lines: list[list[bytes]] = []
        self._waits: list[float] = []
        answers: Sequence[bytes] = ()
        for _ in range(_READY):
            answers = answer(users.lines())
        if any(f'"{STATES[LIVE]}"'.encode() not in line for line in answers):
            raise RuntimeError("a user is not live after calibration and warm-up: the benchmark would measure something else")

    def prepare(self) -> None:
        """Write the lines of a round."""
        self._lines = [self._users.lines() for _ in range(FRAMES)]

    def run(self) -> float:
        """Have them answered; return how many they were."""
        for lines in self._lines:
            begin = perf_counter()
            self._answer(lines)
            self._waits.append(perf_counter() - begin)
        return float(sum(map(len, self._lines)))

    def waits(self) -> np.ndarray:
        """Return how long each call took [s], but for the first round, which warms up."""
        return np.array(self._waits[FRAMES:])


class WindowStream(LowerBodyStream):
    """The paper's way: the network sees the whole last second of every frame; its features are kept."""

    def __init__(self, model: LobstrModel, users: int) -> None:
        """Follow ``users`` people."""
        super().__init__(model, users)
        self._windows = np.zeros((users, WINDOW, model.spec.features), dtype=np.float32)

    @torch.inference_mode()
    def push(self, rows: np.ndarray, joints: TrackerPoses) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Take the next frame of some users; arguments and result are those of ``LowerBodyStream``."""
        before = TrackerPoses(*(part[rows] if self._seen[rows].all() else new for part, new in zip(self._before, joints, strict=True)))
        for stored, new in zip(self._before, joints, strict=True):
            stored[rows] = new
        windows = np.roll(self._windows[rows], -1, axis=1)
        windows[:, -1] = tracker_features(self._model.spec.inputs, before, joints)
        self._windows[rows] = windows
        self._seen[rows] += 1
        body = self._model(torch.from_numpy(windows))
        legs = leg_matrices(self._model.spec, body.pose[:, 0].numpy().astype(float), joints.rotations[:, PELVIS])
        return quaternions(legs), body.contact[:, 0].numpy().argmax(-1).astype(bool), self._seen[rows] > WINDOW


def benchmark_live(motions: str, rounds: int, after_round: Callable[[], None] = lambda: None) -> Speed:
    """Return how quickly the package's network answers.

    Args:
        motions: Motion source, of whose clips the longest is performed.
        rounds: How many rounds are kept; a round takes about four seconds.
        after_round: Called after each round.
    """
    return measure_live(SHIPPED_LOBSTR, max(load_clips(motions, fps=RATE), key=len), rounds, after_round)


def measure_live(file: Path, clip: BodyMotion, rounds: int, after_round: Callable[[], None] = lambda: None, users: int = USERS) -> Speed:
    """Return the same of a network's file and a clip at 45 fps, with so many users."""
    with torch_threads(1), ExitStack() as stack:
        contenders, blocks = _contenders(file, clip, users, stack)
        rates = interleave(contenders, rounds, after_round)
        waits = {name: block.waits() for name, block in blocks.items()}
        return Speed("live", "frames/s", contenders, rates, OURS, (WINDOWED,), waits)


def _contenders(file: Path, clip: BodyMotion, count: int, stack: ExitStack) -> tuple[list[Contender], dict[str, Block]]:
    """Return what is timed, and the blocks of those that somebody waits for; ``stack`` ends the service."""
    model, one, many = LobstrModel.load(file)[0], Users(clip, 1), Users(clip, count)
    windowed = LiveBodies(model, 1)
    windowed._stream = WindowStream(model, 1)
    in_step = InStep(stack.enter_context(service(file, count)), count, many.codec)
    stack.callback(in_step.close)
    together, limit, needed = f"{count} users", f"network step, {count} users", f"{count * RATE:g} frames/s are {RATE:g} a user"
    blocks = {
        OURS: (Block(one, _answering(LiveBodies(model, 1), one.codec)), "ours: line to line, a frame a call", LIMIT),
        together: (Block(many, _answering(LiveBodies(model, count), many.codec)), f"ours: a frame of each a call; {needed}", limit),
        f"{together}, sockets": (Block(Users(clip, count), in_step.tick), f"the service in another process; {needed}", limit),
        WINDOWED: (Block(Users(clip, 1), _answering(windowed, one.codec)), f"as ours, but {WINDOW} steps of the network each time", LIMIT),
    }
    contenders = [Contender(name, what, block.run, block.prepare, bound) for name, (block, what, bound) in blocks.items()]
    contenders += [
        Contender(LIMIT, "PyTorch's GRU cell and the heads alone", _network(model, 1)),
        Contender(limit, f"the same for {count} at once", _network(model, count)),
    ]
    return contenders, {name: block for name, (block, _, _) in blocks.items()}


def _answering(bodies: LiveBodies, codec: Codec) -> Callable[[Sequence[bytes]], Sequence[bytes]]:
    """Return what answers a frame of each user, from lines to lines."""
    rows = np.arange(bodies.users)

    def answer(lines: Sequence[bytes]) -> Sequence[bytes]:
        frames = [frame for line in lines if isinstance(frame := codec.read(line), Frame)]
        trackers = TrackerPoses(*(np.stack([frame.trackers[part] for frame in frames]) for part in range(2)))
        solved = bodies.step(rows, trackers)
        return [
            codec.answer(frame.number, STATES[int(state)], root, rotations, contacts, float(scale), 0.0)
            for frame, root, rotations, contacts, state, scale in zip(frames, *solved[:5], strict=True)
        ]

    return answer


@torch.inference_mode()
def _network(model: LobstrModel, users: int) -> Callable[[], float]:
    """Return a block of the network's steps alone, states carried."""
    layer = dict(model.encoder.named_parameters())
    weights = [layer[f"layer.{name}_l0"] for name in ("weight_ih", "weight_hh", "bias_ih", "bias_hh")]
    features = torch.from_numpy(np.random.default_rng(0).normal(size=(FRAMES, users, model.spec.features)).astype(np.float32))

    @torch.inference_mode()
    def run() -> float:
        state = torch.zeros(users, model.spec.hidden)
        for seen in features:
            state = torch.gru_cell(model.normalised(seen), state, *weights)
            model.read(state)
        return float(FRAMES * users)

    return run


def _endless(done: Performance, start: int) -> Iterator[int]:
    """Yield the frames of a user: T-pose, then the clip from ``start`` on, for ever."""
    clip = range(done.first, len(done.trackers.positions))
    yield from range(done.first)
    yield from cycle([*clip[start:], *clip[:start]])
