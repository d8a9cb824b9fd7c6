"""The command line of every training: a config, what is changed in it, and whether a run goes on."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from configs.command import run_command
from configs.load import load_config


def run_training(
    program: str,
    description: str,
    example: str,
    config_class: Callable[[Path], type[Any]],
    train: Callable[[Any, bool], object],
    arguments: list[str] | None,
) -> int:
    """Run a training as the command line asks; return the exit code.

    Args:
        program: Name of its module.
        description: What it does, for ``--help``.
        example: Config file of the project, for ``--help``.
        config_class: Returns the class of the config that a file holds; has ``name`` and ``runs_dir``.
        train: Takes the config, and whether the run goes on.
        arguments: Of the command line; the process' own if None.
    """
    parser = argparse.ArgumentParser(prog=f"python -m {program}", description=description)
    parser.add_argument("--config", type=Path, required=True, help=f"YAML file, such as {example}")
    parser.add_argument("--resume", action="store_true", help="go on from the newest checkpoint of the run")
    parser.add_argument("overrides", nargs="*", metavar="key.sub=value", help="change the config, such as seed=1")
    options = parser.parse_intermixed_args(arguments)
    return run_command(lambda: _run(options, config_class, train))


def _run(options: argparse.Namespace, config_class: Callable[[Path], type[Any]], train: Callable[[Any, bool], object]) -> None:
    config = load_config(config_class(options.config), options.config, options.overrides)
    of_run = Path(config.runs_dir) / config.name / "config.yaml"
    if options.resume and of_run.is_file():  # a run goes on as it began, but for what is typed now
        config = load_config(type(config), of_run, options.overrides)
    train(config, options.resume)
