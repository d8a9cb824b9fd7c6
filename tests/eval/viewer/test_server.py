"""The page's server: answers its own pages on the loopback, and nobody else."""

import socket
from collections.abc import Iterator

import pytest
import viser

from eval.viewer.server import open_server
from tests.eval.viewer.viewer_parts import UPGRADE, status


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    """Yield the port of a server."""
    server = open_server(0)
    yield server.get_port()
    server.stop()


def test_its_own_page_is_answered(port: int) -> None:
    for host in (f"127.0.0.1:{port}", f"localhost:{port}"):
        assert status(port, f"Host: {host}\r\n") == 200
        assert status(port, f"Host: {host}\r\nOrigin: http://{host}\r\n{UPGRADE}") == 101


@pytest.mark.parametrize("upgrade", ["", UPGRADE])
def test_other_pages_are_refused(port: int, upgrade: str) -> None:
    own = f"127.0.0.1:{port}"
    for head in (
        f"Host: {own}\r\nOrigin: http://evil.example\r\n",
        f"Host: {own}\r\nOrigin: http://127.0.0.1:{port + 1}\r\n",  # another page of this machine
        f"Host: {own}\r\nOrigin: https://{own}\r\n",
        f"Host: {own}\r\nOrigin: null\r\n",  # a page in a sandbox, or a file
        f"Host: evil.example:{port}\r\n",  # a name that was made to lead here
        f"Host: evil.example:{port}\r\nOrigin: http://evil.example:{port}\r\n",
        f"Host: {own}\r\nHost: evil.example\r\n",
        f"Host: {own}\r\nOrigin: http://{own}\r\nOrigin: http://evil.example\r\n",
        "Host: 127.0.0.1\r\n",
        "",
    ):
        assert status(port, head + upgrade) in (400, 403), head


def test_only_this_machine_is_listened_to(port: int) -> None:
    others = {str(info[4][0]) for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)}
    for address in others - {one for one in others if one.startswith("127.")}:
        with pytest.raises(OSError):
            socket.create_connection((address, port), timeout=1.0).close()


def test_a_viewer_whose_requests_cannot_be_checked_is_not_started(monkeypatch: pytest.MonkeyPatch) -> None:
    class Unchecked:
        def __init__(self, *_: object, **__: object) -> None:
            self.is_stopped = False

        def stop(self) -> None:
            stopped.append(self)

    stopped: list[Unchecked] = []
    monkeypatch.setattr(viser, "ViserServer", Unchecked)
    with pytest.raises(RuntimeError, match="cannot check who asks"):
        open_server(0)
    assert len(stopped) == 1
