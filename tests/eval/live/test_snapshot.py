"""Snapshots: what is written is read again."""

import numpy as np

from eval.live.messages import UserView
from eval.live.snapshot import read_snapshot, write_snapshot
from tests.eval.live.page_parts import seen


def test_a_snapshot_is_read_again() -> None:
    views = {7: seen(-1.25, state="calibrating", contacts=(False, True), scale=1.5), 3: seen(0.5, name="user 3 (line\nbreak)")}
    views[7].rotations[6] = [0.5, 0.5, -0.5, 0.5]
    line = write_snapshot(views)
    assert line.count(b"\n") == 1
    read = read_snapshot(line)
    assert list(read) == [3, 7]
    for user, view in views.items():
        for field in UserView.__dataclass_fields__:
            assert np.array_equal(getattr(read[user], field), np.float32(value) if (value := getattr(view, field)) is view.root else value)


def test_nobody_is_a_snapshot_as_well() -> None:
    assert read_snapshot(write_snapshot({})) == {}
