"""Repeats a published or measured comparison: ``python -m eval.study NAME --out DIR``."""

import argparse
import html
import json
import sys
from collections.abc import Callable
from pathlib import Path

from configs.command import exit_code_of
from configs.errors import InputError
from eval.suit_study import suit_study

STUDIES: dict[str, Callable[[Path], dict]] = {"suit": suit_study}
DATA = Path(__file__).parents[2] / "shared" / "data"


def main(arguments: list[str] | None = None) -> int:
    """Run the study that the command line names; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m eval.study", description=__doc__)
    parser.add_argument("name", choices=sorted(STUDIES), help="which study")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for study.json and index.html")
    parser.add_argument("--data", type=Path, default=DATA, metavar="DIR", help="folder of real motion (default: ../shared/data)")
    options = parser.parse_args(arguments)
    return exit_code_of(lambda: _run(options))


def _run(options: argparse.Namespace) -> None:
    study = STUDIES[options.name](options.data)
    try:
        options.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {options.out}: {error.strerror}; should be a folder that can be written to") from None
    (options.out / "study.json").write_text(json.dumps(study, indent=2) + "\n", encoding="utf-8")
    (options.out / "index.html").write_text(_page(study), encoding="utf-8")
    print(_table(study))


def _table(study: dict) -> str:
    """Return the study as text: one block a row, one line a measure, then the findings."""
    lines = []
    for row in study["rows"]:
        lines.append(row["name"])
        for key, value in row["ours"].items():
            published = f"   published {row['published'][key]:.4g}" if key in row["published"] else ""
            lines.append(f"    {key:28s} {value['mean']:10.4g} +- {value['std']:<10.4g} n={value['seeds']}{published}")
    lines += [f"{'yes' if finding['reproduced'] else 'NO '}  {finding['finding']}" for finding in study["findings"]]
    return "\n".join(lines)


def _page(study: dict) -> str:
    """Return the same as a page: a table with one column a measure."""
    title = html.escape(f"Study: {study['study']}")
    return f'<!doctype html><meta charset="utf-8"><title>{title}</title><h1>{title}</h1><pre>{html.escape(_table(study))}</pre>\n'


if __name__ == "__main__":
    sys.exit(main())
