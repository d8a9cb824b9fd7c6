"""A number of torch's threads that benchmarks have to restore."""

from collections.abc import Iterator

import pytest
import torch


@pytest.fixture
def three_threads() -> Iterator[None]:
    """Let torch use three threads, a number that no benchmark sets: the suite itself may have begun with one or two."""
    threads = torch.get_num_threads()
    torch.set_num_threads(3)
    yield
    torch.set_num_threads(threads)
