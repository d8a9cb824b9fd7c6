"""Work on all cores: results in their order, one thread a process, errors as they are."""

import os
from collections.abc import Iterable, Sequence

import pytest

from configs import process_pool
from configs.errors import InputError
from configs.process_pool import MIN_ITEMS, available_cores, map_on_cores

MANY = list(range(MIN_ITEMS))


def square_and_process(number: int) -> tuple[int, int]:
    """Return the square of a number, and the process that has computed it."""
    return number * number, os.getpid()


def threads_of_process(_: int) -> str:
    """Return how many threads libraries may use here."""
    return os.environ.get("OMP_NUM_THREADS", "any")


def refuse_the_third(number: int) -> int:
    """Return the number, but not 2."""
    if number == 2:
        raise InputError("2 is no good")
    return number


def test_few_items_stay_in_this_process_and_many_leave_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_pool, "available_cores", lambda: 2)
    assert map_on_cores(square_and_process, [3, 4]) == [(9, os.getpid()), (16, os.getpid())]
    found = map_on_cores(square_and_process, MANY)
    assert [square for square, _ in found] == [number * number for number in MANY]
    assert os.getpid() not in {process for _, process in found}
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    assert map_on_cores(threads_of_process, MANY) == ["1"] * MIN_ITEMS


def test_one_core_needs_no_other_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_pool, "available_cores", lambda: 1)
    assert {process for _, process in map_on_cores(square_and_process, MANY)} == {os.getpid()}


@pytest.mark.parametrize("cores", [1, 2])
def test_an_error_is_the_item_s_own(cores: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_pool, "available_cores", lambda: cores)
    with pytest.raises(InputError, match="2 is no good"):
        map_on_cores(refuse_the_third, MANY)


def test_progress_sees_every_item() -> None:
    seen: list[int] = []

    def progress(items: Sequence[int]) -> Iterable[int]:
        for item in items:
            seen.append(item)
            yield item

    assert map_on_cores(refuse_the_third, [0, 1, 3], progress) == [0, 1, 3]
    assert seen == [0, 1, 3]


def test_there_is_at_least_one_core() -> None:
    assert available_cores() >= 1
