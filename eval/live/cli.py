"""Live service of full bodies for head, hand and pelvis trackers: ``python -m eval.live [--record DIR]``; protocol: docs/live.md."""

import argparse
import asyncio
import gc
import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch
from rich.console import Console
from rich.markup import escape

from agents.lower_body.model import LowerBodyModel
from agents.weights.pretrained import PRETRAINED_LOWER_BODY
from configs.errors import InputError, require
from configs.exit_codes import run_command
from eval.live.messages import BodySolver
from eval.live.page_process import PageProcess
from eval.live.recorder import MAX_RECORDING_MIN, Recorder
from eval.live.server import LiveServer
from eval.live.solver import LiveBodySolver
from eval.live.status_line import StatusLine, summary
from eval.live.wire_protocol import DEFAULT_HOST, DEFAULT_PORT
from trainers.runs.run_log import make_console

DEFAULT_PAGE_PORT = 4546
DEFAULT_MAX_USERS = 20


def main(arguments: list[str] | None = None, prog: str = "python -m eval.live") -> int:
    """Run the command line; return the exit code."""
    made = argparse.ArgumentParser(prog=prog, description="Full bodies for head, hand and pelvis trackers, live.")
    made.add_argument(
        "--host", default=DEFAULT_HOST, help=f"address to listen on (default: {DEFAULT_HOST}, this machine alone: there is no password)"
    )
    made.add_argument("--port", type=int, default=DEFAULT_PORT, help=f"port to listen on, 0 for any that is free (default: {DEFAULT_PORT})")
    made.add_argument(
        "--page-port",
        type=int,
        default=DEFAULT_PAGE_PORT,
        help=f"port of the browser page on this machine, 0 for no page (default: {DEFAULT_PAGE_PORT})",
    )
    made.add_argument("--users", type=int, default=DEFAULT_MAX_USERS, help=f"how many may be there at once (default: {DEFAULT_MAX_USERS})")
    made.add_argument("--record", type=Path, metavar="DIR", help="save what is live there as BVH")
    made.add_argument(
        "--minutes", type=float, default=MAX_RECORDING_MIN, help=f"longest recording, then another begins (default: {MAX_RECORDING_MIN:g})"
    )
    made.add_argument("--model", type=Path, metavar="FILE", default=PRETRAINED_LOWER_BODY, help="another network than the package's")
    options = made.parse_args(arguments)
    return run_command(lambda: _run(options))


def _run(options: argparse.Namespace) -> None:
    _check(options)
    torch.set_num_threads(1)  # a frame is too small to be shared: waiting for threads would cost more than they save
    bodies = LiveBodySolver(LowerBodyModel.load(options.model)[0], options.users)
    asyncio.run(serve(bodies, options, make_console()))


def _check(options: argparse.Namespace) -> None:
    """Raise if an option is out of range, before anything is loaded."""
    for name in ("port", "page_port"):
        value = getattr(options, name)
        require(0 <= value < 65536, f"--{name.replace('_', '-')}", value, "a port, 0 to 65535")
    require(1 <= options.users <= 1000, "--users", options.users, "1 to 1000")
    require(0.0 < options.minutes <= 600.0, "--minutes", options.minutes, "more than 0 and at most 600")


async def serve(solver: BodySolver, options: argparse.Namespace, console: Console) -> None:
    """Serve until SIGINT or SIGTERM, then save what is being recorded.

    Args:
        solver: Solver of the users' bodies.
        options: ``host``, ``port``, ``page_port``, ``record`` and ``minutes`` of the command line.
        console: Terminal that messages go to.

    Raises:
        InputError: If a port is not available or the folder cannot be written to.
    """
    loop, stop, faults = asyncio.get_running_loop(), asyncio.Event(), []

    def log(text: str) -> None:
        console.print(escape(text))

    def fault(_: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Stop on an error of the program, saving the recordings; log errors of the system, such as too many sockets."""
        error = context.get("exception") or RuntimeError(context["message"])
        if isinstance(error, OSError):
            log(f"{context['message']}: {_reason(error)}")
            return
        faults.append(error)
        stop.set()

    server = LiveServer(solver, Recorder(options.record, log, options.minutes) if options.record else None, log)
    page = PageProcess(server.views, log)
    status = StatusLine(server, console)
    try:
        await _listen(server, options, log)
        loop.set_exception_handler(fault)
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, stop.set)
        gc.collect()
        gc.freeze()  # objects loaded so far are never collected again, which would delay a frame
        if options.page_port:
            await _open_page(page, options.page_port, log)
        with status:
            await stop.wait()
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.remove_signal_handler(number)
        await page.stop()
        await server.stop()
    log(summary(server))
    if faults:
        raise faults[0]


async def _listen(server: LiveServer, options: argparse.Namespace, log: Callable[[str], None]) -> None:
    """Open the port for trackers and log the address."""
    try:
        port = await server.start(options.host, options.port)
    except OSError as error:
        raise InputError(f"--host {options.host} --port {options.port}: {_reason(error)}; choose others, 0 takes any free port") from error
    log(f"trackers: {options.host} port {port} (TCP, a JSON object a line, docs/live.md); Ctrl-C stops")
    log(f"no hardware at hand? python -m eval.live_replay CLIP.bvh --port {port}")


async def _open_page(page: PageProcess, port: int, log: Callable[[str], None]) -> None:
    """Start the page and log its address; trackers are served meanwhile."""
    try:
        log(f"page: {await page.start(port)}")
    except OSError as error:
        raise InputError(f"--page-port {port}: {_reason(error)}; choose another, 0 is for no page") from error


def _reason(error: OSError) -> str:
    """Return the system's message, without the words that asyncio adds."""
    return os.strerror(error.errno) if error.errno and error.errno > 0 else str(error.strerror)
