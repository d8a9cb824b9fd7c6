"""Serves cleaning to agents over the Model Context Protocol, on standard input and output: ``adapt-mimic mcp``."""

import argparse

import torch

from configs.errors import InputError
from configs.exit_codes import run_command
from configs.process_pool import available_cores
from eval.agent_server.workshop import Workshop

SDK_PACKAGES = ("anyio", "mcp", "mcp_types")  # that the extra installs and the server imports


def main(arguments: list[str] | None = None, prog: str = "python -m eval.agent_server") -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(
        prog=prog,
        description="Serve cleaning to agents over the Model Context Protocol, on standard input and output: no network.",
    )
    parser.add_argument("--threads", type=int, metavar="N", default=available_cores(), help="cores to use (default: all, %(default)s here)")
    options = parser.parse_args(arguments)
    return run_command(lambda: _run(options))


def _run(options: argparse.Namespace) -> None:
    if options.threads < 1:
        raise InputError(f"--threads {options.threads} should be 1 or more")
    try:
        from eval.agent_server.server import make_server
    except ModuleNotFoundError as error:
        if (error.name or "").split(".")[0] not in SDK_PACKAGES:
            raise
        raise InputError("the MCP server needs the package mcp, which is not installed; pip install 'adapt-mimic[mcp]'") from None
    torch.set_num_threads(options.threads)
    make_server(Workshop(options.threads)).run("stdio")
