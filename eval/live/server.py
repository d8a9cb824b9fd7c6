"""TCP server of the live service: holds the users' sessions and solves their waiting frames in batches."""

import asyncio
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from configs.errors import InputError
from datasets.trackers.trackers import TRACKER_NAMES, TRACKER_RATE_HZ, TrackerPoses
from eval.live.messages import LIVE, STATES, BodySolver, UserView
from eval.live.rate_limit import ClientLimits
from eval.live.recorder import Recorder
from eval.live.session import LEFT_REASON, Session, TimedFrame

BATCH_WAIT_S = 0.004  # s, for which a frame may wait for those of other users, as a batch costs little more than one frame
ACTIVE_WINDOW_S = 3.0 / TRACKER_RATE_HZ  # s, after which a silent user is no longer waited for
LATENCY_HISTORY_S = 600  # s, of latencies kept, at one user's rate
MAX_UNIDENTIFIED_CONNECTIONS = 32  # that have not said hello


@dataclass
class LiveServer:
    """Live service: accepts connections, solves frames and answers them.

    Attributes:
        solver: Solver, with a slot for each user that may be connected at once.
        recorder: Recorder of live frames; None if they are not recorded.
        log: Called with each line for the terminal.
        limits: Limits of each client.
        views: Last frame of each user, by user number.
        latencies: Latencies of the last frames [ms].
        answered: Number of frames answered so far.
    """

    solver: BodySolver
    recorder: Recorder | None = None
    log: Callable[[str], None] = print
    limits: ClientLimits = field(default_factory=ClientLimits)
    views: dict[int, UserView] = field(default_factory=dict)
    latencies: deque[float] = field(default_factory=lambda: deque(maxlen=round(LATENCY_HISTORY_S * TRACKER_RATE_HZ)))
    answered: int = 0

    def __post_init__(self) -> None:
        """Start with all slots free."""
        self._free_slots = list(range(self.solver.users))[::-1]
        self._sessions: set[Session] = set()
        self._waiting: set[Session] = set()
        self._timer: asyncio.Handle | None = None
        self._server: asyncio.Server | None = None
        self._watch: asyncio.Task[None] | None = None
        self._users = 0

    @property
    def is_crowded(self) -> bool:
        """Whether too many connections have not said hello."""
        return len(self._sessions) - self.users > MAX_UNIDENTIFIED_CONNECTIONS

    @property
    def users(self) -> int:
        """Number of users connected."""
        return self.solver.users - len(self._free_slots)

    async def start(self, host: str, port: int) -> int:
        """Listen on a port; return it."""
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(self._connect, host, port)
        self._watch = loop.create_task(self._watch_idle())
        return self._server.sockets[0].getsockname()[1]

    async def stop(self) -> None:
        """Disconnect all clients and finish the recordings."""
        if self._server:
            self._server.close()
        if self._watch:
            self._watch.cancel()
        try:
            for session in list(self._sessions):
                session.close("the service stops")
        finally:
            if self.recorder:
                await self.recorder.finish()

    def enter(self, session: Session) -> None:
        """Assign a number and a slot to a client that has said hello; InputError if none is free."""
        if not self._free_slots:
            raise InputError(f"all {self.solver.users} places are taken; come back later, or start the service with more --users")
        self._users += 1
        session.user, session.slot = self._users, self._free_slots.pop()
        assert session.codec
        self.solver.reset(np.array([session.slot]), session.codec.worn[None])
        more = [name for name in session.codec.trackers if name not in TRACKER_NAMES]
        self.note(session, f"came, with {', '.join(more)}" if more else "came")

    def leave(self, session: Session, reason: str) -> None:
        """Free the slot of a client that has disconnected."""
        self._sessions.discard(session)
        self._waiting.discard(session)
        self.views.pop(session.user, None)
        if session.slot >= 0:
            self._free_slots.append(session.slot)
            self._close_recording(session)
        if session.slot >= 0 or reason != LEFT_REASON:
            self.note(session, reason)

    def arrived(self, session: Session) -> None:
        """Schedule the solving of a session's frames: at once if no other user's frame is due."""
        self._waiting.add(session)
        now = perf_counter()
        expected = sum(one.slot >= 0 and now - one.last_line < ACTIVE_WINDOW_S for one in self._sessions)
        if len(self._waiting) >= expected:
            self._solve_after(0.0)
        elif self._timer is None:
            self._solve_after(BATCH_WAIT_S)

    def calibrate(self, session: Session) -> None:
        """Restart a user's calibration; frames after it go to another recording."""
        self.solver.reset(np.array([session.slot]))
        self._close_recording(session)
        self.note(session, "calibrates again")

    def note(self, session: Session, text: str) -> None:
        """Log a line about a session."""
        self.log(f"{session.name}: {text}")

    def _connect(self) -> Session:
        """Return the session of a new client."""
        session = Session(self)
        self._sessions.add(session)
        return session

    def _solve_after(self, seconds: float) -> None:
        """Schedule the solving of waiting frames, replacing an earlier schedule."""
        if self._timer:
            self._timer.cancel()
        loop = asyncio.get_running_loop()
        self._timer = loop.call_later(seconds, self._solve) if seconds else loop.call_soon(self._solve)

    def _solve(self) -> None:
        """Answer one frame of each waiting session, in one batch."""
        self._timer = None
        batch = list(self._waiting)
        if not batch:
            return
        taken = [(session, frame) for session in batch if (frame := session.next_frame())]
        self._waiting = {session for session in batch if session.waiting}
        if taken:
            self._answer(taken)
        if self._waiting:
            self._solve_after(0.0)

    def _answer(self, taken: list[tuple[Session, TimedFrame]]) -> None:
        """Solve and answer one frame of each of some users."""
        batch, frames = zip(*taken, strict=True)
        trackers = TrackerPoses(*(np.stack([frame.trackers[part] for frame in frames]) for part in range(2)))
        solved = self.solver.step(np.array([session.slot for session in batch]), trackers)
        numbers = np.concat([solved.root_position, solved.local_rotations.reshape(len(frames), -1)], axis=1)
        lost = np.flatnonzero(~np.isfinite(numbers.sum(axis=1)))
        states, scales = solved.states.tolist(), solved.scales.tolist()
        for index, (session, frame) in enumerate(taken):
            if index in lost:
                self.solver.reset(np.array([session.slot]))
                session.tell_problem(f"no body could be found for frame {frame.number}")
                continue
            pose = solved.root_position[index], solved.local_rotations[index], solved.contacts[index]
            milliseconds = 1e3 * (perf_counter() - frame.time)
            assert session.codec
            line = session.codec.answer(frame.number, STATES[states[index]], *pose, scales[index], milliseconds)
            self.latencies.append(milliseconds)
            self.answered += 1
            self.views[session.user] = UserView(
                session.name, STATES[states[index]], *pose, scales[index], session.rate_limit.fps, milliseconds
            )
            if states[index] == LIVE and self.recorder:
                self.recorder.record(session.user, *pose[:2], scales[index])
            if index in solved.problems:
                session.tell_problem(solved.problems[index])
            session.answer(line)  # last, as it may close the connection

    def _close_recording(self, session: Session) -> None:
        if self.recorder:
            self.recorder.close(session.user)

    async def _watch_idle(self) -> None:
        """Disconnect silent clients."""
        while True:
            await asyncio.sleep(min(1.0, self.limits.max_idle_s / 4))
            now = perf_counter()
            for session in list(self._sessions):
                session.check_idle(now)
