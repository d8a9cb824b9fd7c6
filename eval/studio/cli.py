"""The studio: ``python -m eval.studio [CLIP or FOLDER]`` opens a page on which clips are cleaned, corrected and saved."""

import argparse
import time
import webbrowser
from pathlib import Path

from rich.markup import escape

from configs.errors import require
from configs.exit_codes import run_command
from datasets.formats.motion_file import FORMATS_IN_WORDS
from eval.studio.state.workspace import Workspace
from eval.studio.studio_server import StudioServer
from trainers.runs.run_log import make_console

DEFAULT_PORT = 4547
DEFAULT_UPLOADS = Path("studio_clips")


def main(arguments: list[str] | None = None, prog: str = "python -m eval.studio") -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog=prog, description="Clean clips on a page: see what was wrong, set it right, take it home.")
    parser.add_argument("source", type=Path, nargs="?", metavar="CLIP or FOLDER", help=f"a {FORMATS_IN_WORDS} file, or a folder of them")
    parser.add_argument("--port", type=int, default=DEFAULT_PORT, help="port of the page, 0 for any that is free (default: %(default)s)")
    parser.add_argument(
        "--uploads",
        type=Path,
        default=DEFAULT_UPLOADS,
        metavar="DIR",
        help="folder for clips that are opened on the page (default: %(default)s)",
    )
    parser.add_argument("--no-browser", action="store_true", help="only print the page's address")
    options = parser.parse_args(arguments)
    return run_command(lambda: _run(options))


def _run(options: argparse.Namespace) -> None:
    require(0 <= options.port < 2**16, "--port", options.port, "a port from 0 to 65535")
    workspace = Workspace(options.source, options.uploads)
    studio, console = StudioServer(workspace, options.port), make_console()
    console.print(f"The studio is at [bold]{studio.address}[/bold], on this machine alone. Ctrl-C ends it.")
    console.print(escape(f"Clips that are opened on the page are kept in {options.uploads.resolve()}, with their edits."))
    if not options.no_browser:
        webbrowser.open(studio.address)
    try:
        while True:
            time.sleep(1.0)
    finally:
        studio.close()
