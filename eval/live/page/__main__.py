"""The page's process: ``python -m eval.live.page PORT``, started by the service (``eval.live.page_process``) and of no use without it.

Standard output carries the page's address, then an empty line for each snapshot that is asked for; snapshots come by standard input.
"""

import os
import sys
from typing import BinaryIO

from eval.live.page.live_page import LivePage
from eval.live.snapshot import read_snapshot

NICENESS = 5  # trackers are answered first where processors are few


def main(port: int, asks: BinaryIO, answers: BinaryIO) -> None:
    """Serve the page until the service is gone.

    Args:
        port: Port of this machine.
        asks: Pipe to the service.
        answers: Pipe from it.
    """
    page = LivePage(port)
    asks.write(page.address.encode() + b"\n")
    while line := _ask(asks, answers):
        page.show(read_snapshot(line))
        page.wait()


def _ask(asks: BinaryIO, answers: BinaryIO) -> bytes:
    """Return a snapshot, nothing if the service is gone."""
    try:
        asks.write(b"\n")
    except BrokenPipeError:
        return b""
    return answers.readline()


if __name__ == "__main__":
    if hasattr(os, "nice"):  # not on Windows
        os.nice(NICENESS)
    pipe = os.fdopen(os.dup(sys.stdout.fileno()), "wb", buffering=0)
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # whatever libraries print is no request
    main(int(sys.argv[1]), pipe, sys.stdin.buffer)
