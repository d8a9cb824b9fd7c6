"""What tests keep in other processes: a list of words."""

import os
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def words_of(*first: str) -> Iterator[list[str]]:
    """Yield a list that begins with these."""
    yield [*first]


def add(word: str, to: list[str]) -> list[str]:
    """Put a word at the end; return all."""
    to.append(word)
    return to


def fill(size: int, _: list[str]) -> int:
    """Hold so many bytes for a while; return how many lines they have."""
    held = bytearray(b"x") * size
    return sum(held.count(b"\n") for _ in range(20))


def die(_: list[str]) -> None:
    """End the process at once."""
    os._exit(3)
