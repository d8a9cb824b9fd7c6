"""One clip that is worked on: its recording, edits with undo, the result of cleaning, and who is told of changes."""

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from configs.errors import InputError
from datasets.formats.bvh import Bvh
from datasets.formats.motion_file import write_motion_file
from datasets.joints.mapping_draft import JointMapError
from datasets.performer.performer_clip import read_performer_file
from datasets.performer.reading_options import ReadingOptions
from eval.clean.edits import PHYSICS, Edits
from eval.clean.edits_file import edits_path, read_edits, write_edits
from eval.clean.pipeline import CleaningPipeline
from eval.clean.progress import COMPARING, SIMULATING, TRANSFERRING, expected_seconds
from eval.clean.quality import GOOD, QUALITIES
from eval.clean.result import CleaningResult
from eval.clean.session import CleaningSession
from eval.studio.state.contact_bars import ContactTrack
from eval.studio.state.edit_history import EditHistory
from eval.studio.state.solver_thread import Request, Solved, SolverThread

_BYTES_PER_SECOND = 5e4  # of a file, by which eval.clean.progress knows how long its clip is


class Project:
    """A clip, its edits and what came of them; shared by all tabs that show it.

    Attributes:
        path: File of the clip.
        pipeline: Stages of the cleaning.
        session: Recording, read as its edits say.
        history: Edits.
        result: Result of the last solving; None before the first.
        problem: Line that says why the last solving failed; "" if it did not.
        shown_s: Time that a tab showed last, around which a change of the whole clip is seen first [s].
        version: Counts the changes of everything that is shown.
    """

    def __init__(self, path: Path, pipeline: CleaningPipeline, reading: ReadingOptions | None = None) -> None:
        """Read a clip and the edits beside it.

        Args:
            path: File of the clip, beside which its edits are kept.
            pipeline: Stages of the cleaning.
            reading: What the user says of the file, if that is not what the edits say.

        Raises:
            InputError: If the file or its edits cannot be read; a ``JointMapError`` if its joints are not found.
        """
        self.path, self.pipeline = path, pipeline
        self.history, self.result, self.problem, self.version, self.shown_s = EditHistory(), None, "", 0, 0.0
        self._result_edits = Edits()
        kept = edits_path(path)
        if kept.is_file():
            self.history.present = read_edits(kept)
        if reading is not None:
            self.history.present = replace(self.history.present, reading=reading)
        self._told: list[Callable[[], None]] = []
        self._lock = threading.RLock()
        self._bvh, self.session = self._read(self.history.present.reading)
        self._solver = SolverThread(self._solved)

    @property
    def name(self) -> str:
        """Name of the clip."""
        return self.path.stem

    @property
    def edits(self) -> Edits:
        """Edits that hold."""
        return self.history.present

    @property
    def is_shown(self) -> bool:
        """Whether a tab shows the clip."""
        return bool(self._told)

    @property
    def track(self) -> ContactTrack | None:
        """Contacts of the result."""
        return ContactTrack(self.result.contacts, self.result.start_s) if self.result else None

    @property
    def solver(self) -> SolverThread:
        """Thread that solves the edits."""
        return self._solver

    def tell(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call ``listener`` after each change; return the function that ends this."""
        self._told.append(listener)
        return lambda: self._told.remove(listener) if listener in self._told else None

    def clean(self, physics: bool) -> None:
        """Solve the edits that hold; without ``physics`` what is kinematic, which takes less than a second for ten."""
        simulated = physics and PHYSICS not in self.edits.without
        search = QUALITIES[self.edits.quality or GOOD] if simulated else None
        threads = self.pipeline.simulator.threads if self.pipeline.simulator else 1
        usual = expected_seconds(round(self.session.seconds * _BYTES_PER_SECOND), search, threads, report=False)
        expected = {stage: usual[stage] for stage in (SIMULATING, TRANSFERRING, COMPARING)}
        shown = (self.result, self._result_edits) if self.result else None
        self._solver.solve(Request(self.session, self.edits, physics, expected, shown, self.shown_s))
        self._changed()

    def solve_wholly(self) -> CleaningResult:
        """Return the result of the edits that hold, physics and all; solve it and wait where there is none yet.

        Raises:
            InputError: If it was stopped, or the clip cannot be solved.
        """
        if self.result is None or self.result.stale or self.result.is_preview or self._solver.is_busy:
            self.clean(physics=True)
            self._solver.wait()
        if self.problem:
            raise InputError(self.problem)
        if self.result is None or self.result.stale or self.result.is_preview:
            raise InputError(f"{self.name}: cleaning was stopped, so there is nothing to save yet; press Clean or save again")
        return self.result

    def stop(self) -> None:
        """Stop solving."""
        self._solver.stop()
        self._changed()

    def change(self, edits: Edits) -> None:
        """Let other edits hold, keep them in their file and solve them.

        Raises:
            InputError: If the clip cannot be read as they say, or they cannot be kept; then nothing changes.
        """
        with self._lock:
            if edits != self.edits:
                self._take(edits, lambda: self.history.change(edits))

    def undo(self) -> None:
        """Let the edits before hold again."""
        with self._lock:
            if self.history.earlier:
                self._take(self.history.earlier[-1], self.history.undo)

    def redo(self) -> None:
        """Let the edits hold that were undone last."""
        with self._lock:
            if self.history.later:
                self._take(self.history.later[-1], self.history.redo)

    def write(self, result: CleaningResult, out: Path) -> tuple[str, ...]:
        """Write a cleaned clip in the format of the suffix; return lines for the user on what of it is not the clip's.

        Raises:
            InputError: If it would replace the recording, or cannot be written.
        """
        if out.resolve() == self.path.resolve():
            raise InputError(f"{out.name} is the recording itself, should be another file's name")
        return write_motion_file(out, self.session.write(result), self.path)

    def move(self, path: Path) -> None:
        """Take note that the file is at ``path`` now, and keep what was said of it beside that."""
        self.path = path
        if self.edits != Edits():
            write_edits(self.edits, edits_path(path))

    def close(self) -> None:
        """Stop solving, and end the thread."""
        self._solver.close()

    def _take(self, edits: Edits, hold: Callable[[], bool]) -> None:
        """Let other edits hold by ``hold`` once the clip is read as they say and they are in their file."""
        if edits.reading != self.edits.reading:
            bvh, session = self._read(edits.reading)
            write_edits(edits, edits_path(self.path))
            self._bvh, self.session, self.result = bvh, session, None
        else:
            write_edits(edits, edits_path(self.path))
        hold()
        self.clean(physics=False)

    def _read(self, reading: ReadingOptions) -> tuple[Bvh, CleaningSession]:
        """Return the contents of the file and a session, read as the user says."""
        try:
            bvh = read_performer_file(self.path, reading)
            return bvh, CleaningSession(bvh, self.name, self.pipeline, reading)
        except JointMapError as error:
            raise JointMapError(f"{self.path.name}: {error}", error.draft, self.name) from error
        except InputError as error:
            raise InputError(str(error).replace(str(self.path), self.path.name)) from error

    def _solved(self, solved: Solved) -> None:
        """Take a result over; called by the solver's thread."""
        with self._lock:
            if solved.request.session is self.session:
                self.problem = solved.problem
                if solved.result:
                    self.result, self._result_edits = solved.result, solved.request.edits
        self._changed()

    def _changed(self) -> None:
        self.version += 1
        for listener in list(self._told):
            listener()
