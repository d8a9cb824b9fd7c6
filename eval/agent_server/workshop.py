"""What agents can ask for: describe a recording, clean it, explain what was wrong with it, undo. No protocol here."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

from configs.errors import InputError
from datasets.formats.motion_file import can_write, check_writer, suffixes_in_words, writable_suffixes, write_motion_file
from datasets.performer.performer_clip import read_performer_file
from eval.agent_server.output_journal import OutputJournal
from eval.clean.edits import EditError, Edits
from eval.clean.edits_file import FORMAT, VERSION, edits_from_json
from eval.clean.event_output import result_numbers
from eval.clean.pipeline import CleaningPipeline
from eval.clean.report_data import collect_report_data
from eval.clean.result import CleaningResult
from eval.clean.session import CleaningSession
from eval.clean.timeline import timeline_notices
from eval.metrics.catalogue import metrics_with_values
from eval.pages.output_files import check_writable, reporting_write_errors

Progress = Callable[[str, float], None]


def _no_progress(_stage: str, _share: float) -> None: ...


class Workshop:
    """Cleans recordings for a caller, and remembers what it wrote."""

    def __init__(self, threads: int, pipeline: CleaningPipeline | None = None) -> None:
        """Begin with no file written.

        Args:
            threads: Native threads of the simulation.
            pipeline: Stages of the cleaning; the package's own, loaded when first needed, if None.
        """
        self._threads, self._given, self._journal = threads, pipeline, OutputJournal()
        self._results: dict[Path, CleaningResult] = {}  # by the file that was written

    @cached_property
    def _pipeline(self) -> CleaningPipeline:
        return self._given or CleaningPipeline.load(self._threads)

    def describe(self, path: str, edits: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Return what a recording was taken for.

        Args:
            path: Motion file.
            edits: Contents of a file of edits, of which only ``reading`` counts.

        Raises:
            InputError: If the file cannot be read or holds no human.
        """
        session = self._session(Path(path), _edits(edits))
        names = session.performer.motion.skeleton.names
        return {
            "path": path,
            "read_as": session.read_as,
            "frames": len(session.bvh.values),
            "fps": session.performer.motion.fps,
            "seconds": session.seconds,
            "start_s": session.start_s,
            "joints": {body: names[joint] for body, joint in session.performer.joint_map.items()},
            "notices": [notice.text for notice in session.notices],
            "writable_as": writable_suffixes(Path(path)),
        }

    def clean(
        self,
        path: str,
        out: str,
        quality: str | None = None,
        without: Sequence[str] = (),
        edits: Mapping[str, Any] | None = None,
        progress: Progress = _no_progress,
        cancelled: Callable[[], bool] = lambda: False,
    ) -> dict[str, Any]:
        """Clean a recording into a file that is not there yet, or that was written by this workshop; return its numbers.

        Args:
            path: Motion file.
            out: File to write.
            quality: "fast", "good" or "best"; that of the edits, or good, if None.
            without: Stages that are left out: "restore", "physics".
            edits: Contents of a file of edits.
            progress: Called with a stage and the share of it that is done.
            cancelled: Asked whether the result is still wanted.

        Raises:
            InputError: If the recording cannot be read, the edits are wrong, or the file cannot be written.
            CleaningCancelled: If the result is no longer wanted.
        """
        source, target, wanted = Path(path), Path(out), _edits(edits)
        wanted = replace(wanted, quality=quality or wanted.quality, without=tuple(dict.fromkeys([*wanted.without, *without])))
        if not can_write(target, source):
            raise InputError(f"out {out} should end in {suffixes_in_words(source)}")
        check_writer(target, source)
        check_writable(target.parent, "out")
        with self._journal.writing(target):
            session = self._session(source, wanted)
            result = _solve(session, wanted, True, progress, cancelled)
            with reporting_write_errors(target):
                target.parent.mkdir(parents=True, exist_ok=True)
                told = write_motion_file(target, session.write(result), source)
        self._results[target.resolve()] = result
        notices = [{"text": one.text, "start_s": one.start_s, "stop_s": one.stop_s} for one in result.notices]
        return {"path": path, "out": out, **result_numbers(result), "notices": notices, "written": list(told)}

    def explain(self, path: str, progress: Progress = _no_progress, cancelled: Callable[[], bool] = lambda: False) -> dict[str, Any]:
        """Return what was wrong with a clip, where, in which seconds, and what cleaning did about it.

        Args:
            path: File that ``clean`` wrote, or a recording, which is then cleaned without physics and not written.
            progress: Called with a stage and the share of it that is done.
            cancelled: Asked whether the answer is still wanted.

        Raises:
            InputError: If the file cannot be read or holds no human.
            CleaningCancelled: If the answer is no longer wanted.
        """
        result = self._results.get(Path(path).resolve())
        cleaned = result is not None
        if result is None:
            session = self._session(Path(path), Edits())
            result = _solve(session, Edits(without=("physics",)), False, progress, cancelled)
        sides = collect_report_data(result)["artefacts"]
        metrics = metrics_with_values(sides["before"], sides["after"])
        return {
            "path": path,
            "cleaned": cleaned,
            "read_as": result.read_as,
            "seconds": result.before.seconds,
            "moments": [{"text": one.text, "start_s": one.start_s, "stop_s": one.stop_s} for one in timeline_notices(result)],
            "notices": [notice.text for notice in result.notices],
            "misalignments": [str(one) for one in result.misalignments],
            "physics_share": float(result.confidence.mean()),
            "measures": [
                {"name": name, "unit": one.unit, "better": one.better, "text": one.text}
                | {side: sides[side].get(name) for side in ("before", "after")}
                for name, one in metrics.items()
            ],
        }

    def undo(self, path: str) -> dict[str, Any]:
        """Take back the last writing of a file: its former contents return, or it is removed.

        Raises:
            InputError: If there is nothing to undo.
        """
        done = self._journal.undo(Path(path))
        self._results.pop(Path(path).resolve(), None)
        return {"path": path, "done": done}

    def _session(self, path: Path, edits: Edits) -> CleaningSession:
        try:
            return CleaningSession(read_performer_file(path, edits.reading), path.stem, self._pipeline, edits.reading)
        except InputError as error:
            raise error if str(path) in str(error) else InputError(f"{path}: {error}") from error


def _solve(session: CleaningSession, edits: Edits, physics: bool, progress: Progress, cancelled: Callable[[], bool]) -> CleaningResult:
    try:
        return session.solve(edits, physics, progress, cancelled)
    except EditError as error:
        raise InputError(f"edits: {error}") from error


def _edits(table: Mapping[str, Any] | None) -> Edits:
    """Return the edits of a caller, who may leave out the format's name and version."""
    try:
        return Edits() if table is None else edits_from_json({"format": FORMAT, "version": VERSION, **table})
    except InputError as error:
        raise InputError(f"edits: {error}") from error
