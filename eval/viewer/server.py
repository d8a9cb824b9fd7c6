"""The server of a page: viser on the loopback alone, which answers nobody but pages of its own."""

import http
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from typing import Any

import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from configs.errors import RunError

LOOPBACK = "127.0.0.1"
_OWN_NAMES = (LOOPBACK, "localhost")
Answer = Callable[[ServerConnection, Request], Any]


def open_server(port: int) -> viser.ViserServer:
    """Start a server on the loopback, on ``port`` or the next one that is free; 0 takes any.

    Raises:
        RunError: If requests cannot be checked, as with another viser than the one that this was written for.
    """
    warnings.filterwarnings("ignore", "Queued a .* on a closed connection", UserWarning)  # a tab may close at any time
    with _checked_requests() as is_checked, redirect_stdout(StringIO()):  # viser prints addresses in a frame of its own
        server = viser.ViserServer(LOOPBACK, port, verbose=False)
    if not is_checked():
        server.stop()
        raise RunError("the page's server cannot check who asks; install the viser that constraints.txt names")
    return server


def is_own_page(request: Request, port: int) -> bool:
    """Return whether a request comes from a page of this server, or from no page at all.

    The name that it was sent to counts as well: another site's name may be made to lead here (DNS rebinding).
    """
    own = {f"{name}:{port}" for name in _OWN_NAMES}
    hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
    return len(hosts) == 1 and hosts[0] in own and len(origins) <= 1 and set(origins) <= {f"http://{name}" for name in own}


@contextmanager
def _checked_requests() -> Iterator[Callable[[], bool]]:
    """Let servers that start meanwhile refuse requests from other pages; viser has no such option, the library below it has.

    Yields:
        Function that returns whether a server has been started so.
    """
    serve, used = websockets.asyncio.server.serve, False

    def guarded(handler: Any, host: str, port: int, *, process_request: Answer, **options: Any) -> Any:
        nonlocal used
        used = True

        def answer(connection: ServerConnection, request: Request) -> Any:
            bound = connection.transport.get_extra_info("sockname")[1]
            return process_request(connection, request) if is_own_page(request, bound) else _refusal()

        return serve(handler, host, port, process_request=answer, **options)

    websockets.asyncio.server.serve = guarded  # type: ignore[assignment]
    try:
        yield lambda: used
    finally:
        websockets.asyncio.server.serve = serve


def _refusal() -> Response:
    """Return what another site's page is told."""
    body = b"Only pages of this server are answered.\n"
    return Response(http.HTTPStatus.FORBIDDEN, "Forbidden", Headers({"Content-Type": "text/plain", "Content-Length": str(len(body))}), body)
