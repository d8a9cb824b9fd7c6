"""Damaged files of every format, and mapping files, read and retargeted: a clip or one line, within seconds and a gibibyte."""

import resource
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from configs.errors import InputError
from datasets.formats.bvh import write_bvh
from datasets.performer.performer_clip import load_performer_clip
from datasets.performer.reading_options import ReadingOptions, read_mapping
from datasets.retarget.plausibility import find_implausible
from datasets.retarget.read_as import describe_reading
from datasets.retarget.retarget import retarget
from tests.builders import as_bvh, lively
from tests.datasets.formats.acclaim_files import mutate_acclaim, mutate_numbers, write_person
from tests.datasets.formats.bvh_fuzzer import mutate, mutate_gently
from tests.datasets.formats.mvnx_files import THREE, mutate_mvnx, mvnx_text
from tests.datasets.performer.mapping_fuzzer import mutate_mapping, whole_mapping

MAX_MORE_BYTES, MAX_SECONDS = 2**30, 20.0
MAX_LINE = 2500  # characters: a message may name all joints of a skeleton
Case = Callable[[np.random.Generator], Path | tuple[Path, Path]]  # a mutant's file, or a sound file and a mutant of a mapping file


def bvh_case(folder: Path) -> Case:
    file = folder / "m.bvh"
    write_bvh(file, as_bvh(lively()))
    whole = file.read_bytes()

    def mutant(rng: np.random.Generator) -> Path:
        file.write_bytes(mutate(whole, rng) if rng.integers(3) == 0 else mutate_gently(whole, rng))
        return file

    return mutant


def amc_case(folder: Path) -> Case:
    motion = write_person(folder, {"ltibia": "40"}, frames=60)
    skeleton = folder / "05.asf"
    whole = {file: file.read_bytes() for file in (motion, skeleton)}

    def mutant(rng: np.random.Generator) -> Path:
        chosen = (motion, skeleton)[rng.integers(2)]
        for file, text in whole.items():
            file.write_bytes(text if file != chosen else (mutate_acclaim, mutate_numbers)[rng.integers(2)](text, rng))
        return motion

    return mutant


def mvnx_case(folder: Path) -> Case:
    file, whole = folder / "clip.mvnx", mvnx_text(THREE).encode()

    def mutant(rng: np.random.Generator) -> Path:
        file.write_bytes(mutate_mvnx(whole, rng))
        return file

    return mutant


def mapping_case(folder: Path) -> Case:
    clip, file = folder / "m.bvh", folder / "m.yaml"
    write_bvh(clip, as_bvh(lively()))

    def mutant(rng: np.random.Generator) -> tuple[Path, Path]:
        file.write_bytes(mutate_mapping(whole_mapping(), rng))
        return clip, file

    return mutant


CASES = {"bvh": bvh_case, "amc": amc_case, "mvnx": mvnx_case, "mapping": mapping_case}


@pytest.fixture
def little_memory() -> Iterator[None]:
    """Let the process grow by a gibibyte at most."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MAX_MORE_BYTES, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


def too_late(*_: object) -> None:
    raise TimeoutError(f"a mutant took more than {MAX_SECONDS:g} s")


@pytest.fixture
def little_time() -> Iterator[None]:
    """Let SIGALRM end whatever runs."""
    before = signal.signal(signal.SIGALRM, too_late)
    yield
    signal.signal(signal.SIGALRM, before)


def check_mutant(files: Path | tuple[Path, Path]) -> bool:
    """Read and retarget a mutant; return whether it is a clip, else it was refused in one line."""
    clip, mapping = files if isinstance(files, tuple) else (files, None)
    signal.setitimer(signal.ITIMER_REAL, MAX_SECONDS)
    try:
        retargeted = retarget(load_performer_clip(clip, read_mapping(mapping) if mapping else ReadingOptions()))
        lines = (*retargeted.performer_clip.notices, *find_implausible(retargeted), describe_reading(retargeted))
        assert all(line.isprintable() and len(line) < MAX_LINE for line in lines)
    except InputError as error:
        assert str(error).isprintable()
        assert len(str(error)) < MAX_LINE
        assert str(clip.parent) in str(error)
        return False
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    return True


@pytest.mark.usefixtures("little_memory", "little_time")
@pytest.mark.parametrize("kind", CASES)
def test_forty_mutants(tmp_path: Path, kind: str) -> None:
    mutant = CASES[kind](tmp_path)
    read = sum(check_mutant(mutant(np.random.default_rng(seed))) for seed in range(40))
    assert 0 < read < 40


@pytest.mark.slow
@pytest.mark.usefixtures("little_memory", "little_time")
@pytest.mark.parametrize("kind", CASES)
@pytest.mark.parametrize("first", range(0, 2500, 100))
def test_ten_thousand_mutants(tmp_path: Path, kind: str, first: int) -> None:
    mutant = CASES[kind](tmp_path)
    for seed in range(first, first + 100):
        check_mutant(mutant(np.random.default_rng(seed)))
