"""Small parts for tests of the studio: a clip of two seconds, and a workspace whose physics is small and untrained."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from datasets.formats.bvh import write_bvh
from eval.clean.pipeline import CleaningPipeline
from eval.studio.state.workspace import Workspace
from tests.builders import as_bvh
from tests.eval.clean.clean_parts import simulator, standing

FRAMES = 120  # of the clip, at 60 fps


def small_pipeline() -> CleaningPipeline:
    """Return stages of cleaning that take no time: eight samples along an untrained policy, and no restoring."""
    return CleaningPipeline(simulator(), None)


def write_clip(folder: Path, name: str = "sway.bvh", frames: int = FRAMES) -> Path:
    """Write a clip of somebody who stands and sways; return its path."""
    path = folder / name
    write_bvh(path, as_bvh(standing(frames)))
    return path


@contextmanager
def workspace(source: Path | None, uploads: Path) -> Iterator[Workspace]:
    """Yield a workspace with the small pipeline."""
    made = Workspace(source, uploads, small_pipeline)
    try:
        yield made
    finally:
        made.close()
