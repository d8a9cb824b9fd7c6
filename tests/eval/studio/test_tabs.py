"""Tabs: each has its own time and view, all share the clip and its edits, and none takes anything along as it closes."""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import msgspec
import pytest
import viser
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from eval.clean.edits import LEFT, ContactEdit, Edits
from eval.studio.page.tab import Tab
from eval.studio.state.view_options import GHOST, SIDE_BY_SIDE
from eval.studio.studio_server import StudioServer
from tests.eval.studio.studio_parts import workspace, write_clip

SECONDS = 20.0
CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [3.0, 3.0, 3.0], "look_at": [0.0, 0.0, 0.0], "up_direction": [0, 0, 1],
    "fov": 0.7, "near": 0.01, "far": 100.0, "image_width": 1100, "image_height": 700,
}  # fmt: skip


def wait(what: Callable[[], bool]) -> None:
    """Wait until something is true."""
    end = time.monotonic() + SECONDS
    while not what():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.fixture
def studio(tmp_path: Path) -> Iterator[StudioServer]:
    """Yield a studio that shows a clip."""
    with workspace(write_clip(tmp_path), tmp_path / "kept") as opened:
        server = StudioServer(opened, 0)
        yield server
        server.close()


@contextmanager
def tab(server: StudioServer) -> Iterator[Tab]:
    """Open a tab as a browser does, and close it."""
    before, address = set(server.tabs), server.address.removeprefix("http://")
    protocol, origin = Subprotocol(f"viser-v{viser.__version__}"), Origin(server.address)
    with connect(f"ws://{address}", subprotocols=[protocol], origin=origin, max_size=None) as browser:
        browser.send(msgspec.msgpack.encode(CAMERA))
        wait(lambda: bool(set(server.tabs) - before))
        (number,) = set(server.tabs) - before
        made = server.tabs[number]
        wait(lambda: made.project is not None and made.playback.num_frames > 1)
        yield made
    wait(lambda: number not in server.tabs)


def test_two_tabs_do_not_disturb_each_other(studio: StudioServer) -> None:
    with ExitStack() as tabs:
        one, other = (tabs.enter_context(tab(studio)) for _ in range(2))
        assert one.project is other.project
        one.options.comparison = GHOST
        one.seek(1.0)
        one.playback.play(True)
        wait(lambda: one.playback.time_s > 1.1)
        assert (other.playback.time_s, other.playback.is_playing, other.options.comparison) == (0.0, False, SIDE_BY_SIDE)


def test_a_closed_tab_loses_nothing(studio: StudioServer) -> None:
    edits = Edits(contacts=(ContactEdit(LEFT, 0.5, 1.0, False),))
    with tab(studio) as first:
        assert first.project
        first.project.change(edits)
    with tab(studio) as second:
        assert second.project is first.project
        assert second.project
        assert second.project.edits == edits
        second.project.solver.wait()
        assert second.project.result
        assert not second.project.result.contacts[30:60, 0].any()


def test_a_problem_is_one_line_on_the_page_and_the_tab_goes_on(studio: StudioServer, capsys: pytest.CaptureFixture[str]) -> None:
    told: list[str] = []
    with tab(studio) as shown:
        events = shown.events
        events.tell_problem = told.append
        events.run(lambda: shown.receive("evil.bvh", b"no motion"))
        events.run(lambda: shown.receive("evil.exe", b"no motion"))
        events.run(lambda: 1 / 0)  # type: ignore[arg-type]
        assert [line.split(":")[0].split(",")[0] for line in told] == ["evil.bvh", "evil.exe", "That did not work"]
        assert shown.project
        assert shown.project.name == "sway"
    assert "ZeroDivisionError" in capsys.readouterr().err
