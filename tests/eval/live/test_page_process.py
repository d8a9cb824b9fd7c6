"""The page's process: started, asked for by browsers, fed with snapshots, and not missed when it is gone."""

import asyncio
import shutil
import socket
import sys
from collections.abc import Mapping
from itertools import islice
from pathlib import Path

import pytest

from configs.errors import RunError
from eval.live.messages import UserView
from eval.live.page_process import PageProcess
from eval.live.wire_protocol import DEFAULT_HOST
from tests.eval.live.live_parts import run
from tests.eval.live.page_parts import seen
from tests.eval.viewer.viewer_parts import UPGRADE, messages, open_tab, status


def follow(address: str, views: dict[int, UserView]) -> None:
    """Look at the page as a tab does, while somebody comes and goes."""
    with open_tab(address) as tab:
        told = messages(tab)
        views[1] = seen()
        next(one for one in told if one["type"] == "BatchedMeshesMessage" and one["name"] == "/world/head")
        next(one for one in told if one["type"] == "SceneNodeUpdateMessage" and one["updates"].get("text") == "user 1 (Ann): live")
        next(one for one in told if one["type"] == "GuiUpdateMessage" and "1 user" in one["updates"].get("content", ""))
        views.clear()
        gone = set(islice((one["name"] for one in told if one["type"] == "RemoveSceneNodeMessage"), 21))
        assert {"/world/label 1", "/world/pelvis", "/world/toe_r"} < gone  # of a label and 20 bodies


def test_users_come_and_go_on_a_page_of_this_machine_alone() -> None:
    async def test() -> None:
        views: dict[int, UserView] = {}
        notes: list[str] = []
        page = PageProcess(views, notes.append)
        address = await page.start(0)
        try:
            port = int(address.strip("/").rpartition(":")[2])
            own = f"Host: 127.0.0.1:{port}\r\n"
            assert address == f"http://127.0.0.1:{port}/"
            assert await asyncio.to_thread(status, port, own) == 200
            for foreign in (f"{own}Origin: http://evil.example\r\n", f"Host: evil.example:{port}\r\n"):
                for upgrade in ("", UPGRADE):
                    assert await asyncio.to_thread(status, port, foreign + upgrade) == 403
            await asyncio.to_thread(follow, address, views)
            assert page._process
            page._process.kill()
            while not notes:
                await asyncio.sleep(0.01)
            assert notes == ["the page has ended; the service goes on without it"]
        finally:
            await page.stop()

    run(test())


async def start(port: int, views: Mapping[int, UserView] | None = None) -> None:
    page = PageProcess(views or {})
    try:
        await page.start(port)
    finally:
        await page.stop()


def test_a_port_that_is_taken_is_told_before_anything_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/nowhere")
    with socket.create_server((DEFAULT_HOST, 0)) as taken, pytest.raises(OSError, match="Address already in use"):
        run(start(taken.getsockname()[1]))


def test_a_page_that_does_not_start_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", shutil.which("false"))
    with pytest.raises(RunError, match="the page did not start"):
        run(start(0))


def test_a_page_that_hangs_is_sent_no_more_than_a_pipe_holds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asking = tmp_path / "asks_and_never_reads"
    asking.write_text("#!/bin/sh\necho http://nowhere/\nexec yes ''\n")
    asking.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(asking))

    async def test() -> None:
        page = PageProcess({user: seen() for user in range(20)})
        await page.start(0)
        try:
            await asyncio.sleep(0.3)
            assert page._process
            assert page._process.stdin
            assert 0 < page._process.stdin.transport.get_write_buffer_size() < 2 * 65536  # asyncio's limit, and a snapshot
        finally:
            await page.stop()

    run(test())
