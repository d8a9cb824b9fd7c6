"""Benchmark of the studio's solver: what a person waits for, of a clip of ten seconds and of one of ten minutes, without physics.

The long clip is the short one there and back. Times are the processor's, on one thread, of one edit after the other in the middle of the
clip; the limit of a preview in ten minutes is the ten seconds alone, solved whole.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np
from rich.table import Table

from configs.errors import InputError
from datasets.formats.bvh import Bvh, write_bvh
from datasets.library.sources import SYNTHETIC_SOURCE
from datasets.performer.performer_clip import read_performer_file
from datasets.retarget.humanoid_bvh import to_humanoid_bvh
from datasets.synthetic.clips import synthetic_clips
from eval.benchmark.timing.interleaved import BenchmarkCase, BenchmarkResult, torch_threads
from eval.benchmark.timing.process_tree import peak_memory_bytes
from eval.clean.edits import ContactEdit, Edits, MisalignmentEdit, SpanEdit
from eval.clean.pipeline import CleaningPipeline
from eval.clean.result import CleaningResult
from eval.clean.session import CleaningSession

SHORT_S, LONG_S = 10.0, 600.0  # durations of the two clips
OPEN, FIRST, PREVIEW, WHOLE = "from the file to the recording", "first version", "the seconds around it", "the whole clip"
CONTACT, SECOND, KEPT, MISALIGNED = "a contact", "another contact", "a kept span", "a misaligned segment"


def benchmark_studio(motions: str, rounds: int, after_round: Callable[[], None] = lambda: None) -> BenchmarkResult:
    """Return the rates at which the studio opens and solves a clip of ten seconds, and the same there and back for ten minutes.

    Args:
        motions: Motion file, of which the first ten seconds are taken, or the word synthetic.
        rounds: Number of rounds to keep; a round takes some minutes.
        after_round: Called after each round.

    Raises:
        InputError: If it is no motion file of ten seconds.
    """
    if motions == SYNTHETIC_SOURCE:
        recorded = to_humanoid_bvh(synthetic_clips(0, 1, round(SHORT_S))[0])
    else:
        recorded = read_performer_file(Path(motions), None)
    frames = round(SHORT_S / recorded.frame_time)
    if len(recorded.values) < frames:
        raise InputError(f"--motions {motions} lasts {len(recorded.values) * recorded.frame_time:.1f} s, should be {SHORT_S:g} or more")
    short = replace(recorded, values=recorded.values[:frames])
    return measure_studio(short, CleaningPipeline.load(1), rounds, after_round)


def there_and_back(clip: Bvh, seconds: float) -> Bvh:
    """Return a clip that goes on backwards, and so on, until it lasts so many seconds."""
    both = np.concat([clip.values, clip.values[::-1]])
    frames = round(seconds / clip.frame_time)
    return replace(clip, values=np.tile(both, (-(-frames // len(both)), 1))[:frames])


def measure_studio(
    short: Bvh, pipeline: CleaningPipeline, rounds: int, after_round: Callable[[], None] = lambda: None, long_s: float = LONG_S
) -> BenchmarkResult:
    """Return the rates for a clip and the same there and back for ``long_s`` seconds."""
    short_s = len(short.values) * short.frame_time
    clips = {f"{short_s:g} s": short, f"{long_s / 60:g} min": there_and_back(short, long_s)}
    seconds: dict[str, list[float]] = {}
    memory: dict[str, int] = {}
    before = peak_memory_bytes()
    with torch_threads(1), TemporaryDirectory() as folder:
        for name, clip in clips.items():
            write_bvh(Path(folder) / f"{name}.bvh", clip)
        _wait_times(Path(folder) / f"{short_s:g} s.bvh", pipeline)  # what is loaded once does not count
        after_round()
        for _ in range(rounds):
            for name in clips:
                for what, taken in _wait_times(Path(folder) / f"{name}.bvh", pipeline).items():
                    seconds.setdefault(f"{name}, {what}", []).append(taken)
                memory.setdefault(name, peak_memory_bytes())  # of the first round: the short clip comes before the long one
            after_round()
    return _result(clips, seconds, {"before": before, **memory})


def _result(clips: dict[str, Bvh], seconds: dict[str, list[float]], memory: dict[str, int]) -> BenchmarkResult:
    """Return the rates of what was timed [s] by clip and step, and a table of the times and of the largest memory [bytes]."""
    short, long = clips
    ours, limit = f"{long}, {CONTACT}, {PREVIEW}", f"{short}, {CONTACT}, {WHOLE}"
    shown_s = len(clips[short].values) * clips[short].frame_time  # a preview shows about as much
    rates, cases = {}, []
    for name, taken in seconds.items():
        clip = clips[name.split(",")[0]]
        length_s = shown_s if name.endswith(PREVIEW) else len(clip.values) * clip.frame_time
        rates[name] = length_s / np.array(taken)
        cases.append(BenchmarkCase(name, f"{np.median(taken):.2f} s of a processor", lambda: 0.0, limit=limit if name == ours else ""))
    caption = (
        f"seconds of one processor; the largest resident memory of the process, {memory['before'] / 1e9:.2f} GB before a clip is opened"
    )
    table = Table(title="what a person waits for", caption=caption)
    for column in ("", *clips):
        table.add_column(column, justify="right" if column else "left")
    for what in (name.removeprefix(f"{long}, ") for name in seconds if name.startswith(f"{long}, ")):
        table.add_row(what, *(f"{np.median(seconds[key]):.2f}" if (key := f"{name}, {what}") in seconds else "-" for name in clips))
    table.add_row("memory", *(f"{memory[name] / 1e9:.2f} GB" for name in clips))
    details = {"seconds": {name: float(np.median(taken)) for name, taken in seconds.items()}, "memory_bytes": memory}
    return BenchmarkResult("studio", "seconds of clip/s", cases, rates, ours, details=details, notes=[table])


def _wait_times(file: Path, pipeline: CleaningPipeline) -> dict[str, float]:
    """Return the processor time of opening a file and of one edit after the other [s]."""
    taken: dict[str, float] = {}

    def timed(what: str, run: Callable[[], CleaningResult | None]) -> CleaningResult | None:
        begin = process_time()
        done = run()
        if done:
            taken[what] = process_time() - begin
        return done

    begin = process_time()
    session = CleaningSession(read_performer_file(file, None), file.stem, pipeline)
    taken[OPEN] = process_time() - begin
    before, middle = Edits(), session.seconds / 2.0
    shown = timed(FIRST, lambda: session.solve(physics=False))
    for what, edits in _edits(middle).items():
        assert shown
        timed(f"{what}, {PREVIEW}", lambda shown=shown, before=before, edits=edits: session.preview(edits, shown, before, middle))
        shown, before = timed(f"{what}, {WHOLE}", lambda edits=edits: session.solve(edits, physics=False)), edits
    return taken


def _edits(middle: float) -> dict[str, Edits]:
    """Return the edits of a person around a time [s], one more each time."""
    contact = Edits((ContactEdit("left", middle - 0.25, middle + 0.25, True),))
    second = replace(contact, contacts=(*contact.contacts, ContactEdit("right", middle + 1.0, middle + 1.5, True)))
    kept = replace(second, spans=(SpanEdit(middle - 2.0, middle - 1.0, keep=True),))
    turned = replace(kept, misalignments=(MisalignmentEdit("head", (0.0, 5.0, 0.0)),))
    return {CONTACT: contact, SECOND: second, KEPT: kept, MISALIGNED: turned}
