"""The console command of the package: ``adapt-mimic clean IN.bvh --out OUT.bvh``, and one word for each other program."""

import argparse
import sys
from importlib import import_module
from typing import NamedTuple


class Command(NamedTuple):
    """A program of the project: the module whose ``main`` runs it, and what it does."""

    module: str
    help: str


COMMANDS = {
    "clean": Command("eval.clean.cli", "clean a BVH file, or a folder of them"),
    "describe": Command("datasets.describe.cli", "say what motion files are, and how well they fit the humanoid"),
    "studio": Command("eval.studio.cli", "clean and correct clips on a page of your browser"),
    "mcp": Command("eval.agent_server.cli", "serve cleaning to agents over the Model Context Protocol"),
    "live": Command("eval.live.cli", "full bodies for head, hand and pelvis trackers, live"),
    "train": Command("trainers.ppo.cli", "train a policy"),
    "report": Command("eval.report.cli", "evaluate a trained policy on clips"),
    "study": Command("eval.study.cli", "repeat the studies behind the tables of the documentation"),
    "benchmark": Command("eval.benchmark.cli", "measure speed"),
}


def main(arguments: list[str] | None = None) -> int:
    """Run the program that the first word names; return its exit code."""
    given = sys.argv[1:] if arguments is None else arguments
    if given and given[0] in COMMANDS:
        program = import_module(COMMANDS[given[0]].module)  # only this one: torch and MuJoCo take seconds
        return program.main(given[1:], prog=f"adapt-mimic {given[0]}")
    parser = argparse.ArgumentParser(
        prog="adapt-mimic",
        description="Turn cheap motion capture into clean animation.",
        epilog="Each command has its own --help, such as: adapt-mimic clean --help",
    )
    words = parser.add_subparsers(metavar="command", required=True)
    for name, command in COMMANDS.items():
        words.add_parser(name, help=command.help, add_help=False)
    parser.parse_args(given)  # prints --help, or that the command is missing or unknown
    return 2


if __name__ == "__main__":
    sys.exit(main())
