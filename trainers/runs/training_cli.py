"""Command line of every training: a config, overrides, and whether a run is resumed."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from configs.exit_codes import run_command
from configs.load import load_config
from trainers.runs.run_config import RunConfig

Config = TypeVar("Config", bound=RunConfig)


def run_training(
    program: str,
    description: str,
    example: str,
    config_class: Callable[[Path], type[Config]],
    train: Callable[[Config, bool], object],
    arguments: list[str] | None,
) -> int:
    """Run a training as the command line asks; return the exit code.

    Args:
        program: Name of the program in ``--help``.
        description: Description of the training, for ``--help``.
        example: Config file of the project, for ``--help``.
        config_class: Returns the class of the config that a file holds.
        train: Takes the config, and whether the run is resumed.
        arguments: Arguments of the command line; the process' own if None.
    """
    parser = argparse.ArgumentParser(prog=program, description=description)
    parser.add_argument("--config", type=Path, required=True, help=f"YAML file, such as {example}")
    parser.add_argument("--resume", action="store_true", help="go on from the newest checkpoint of the run")
    parser.add_argument("overrides", nargs="*", metavar="key.sub=value", help="change the config, such as seed=1")
    options = parser.parse_intermixed_args(arguments)
    return run_command(lambda: _run(options, config_class, train))


def _run(options: argparse.Namespace, config_class: Callable[[Path], type[Config]], train: Callable[[Config, bool], object]) -> None:
    config = load_config(config_class(options.config), options.config, options.overrides)
    of_run = Path(config.runs_dir) / config.name / "config.yaml"
    if options.resume and of_run.is_file():  # a run goes on as it began, but for what is typed now
        config = load_config(type(config), of_run, options.overrides)
    train(config, options.resume)
