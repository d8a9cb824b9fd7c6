"""Repeats a published or measured comparison: ``python -m eval.study NAME --out DIR``; what was interrupted goes on."""

import argparse
import json
from collections.abc import Callable
from pathlib import Path

from configs.exit_codes import run_command
from configs.source_code import PROJECT_ROOT
from eval.pages.output_files import check_writable, write_whole
from eval.study.clean.study import clean_study
from eval.study.framework.page import Group, Study, study_page, study_text
from eval.study.lobstr.study import lobstr_study
from eval.study.policy.study import configuration_study, mixture_study
from eval.study.restore.study import restore_study
from eval.study.root.study import root_study
from eval.study.search.study import search_study
from eval.study.suit.study import suit_study

STUDIES: dict[str, Callable[[Path, Path], Study]] = {
    "clean": clean_study,
    "configuration": configuration_study,
    "lobstr": lobstr_study,
    "mixture": mixture_study,
    "restore": restore_study,
    "root": root_study,
    "search": search_study,
    "suit": lambda data, out: Study(suit_study(data)),
}
DEFAULT_DATA_DIR = PROJECT_ROOT.parent / "shared" / "data"


def main(arguments: list[str] | None = None, prog: str = "python -m eval.study") -> int:
    """Run the study that the command line names; return the exit code."""
    parser = argparse.ArgumentParser(prog=prog, description=__doc__)
    parser.add_argument("name", choices=sorted(STUDIES), help="which study")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for study.json and index.html")
    parser.add_argument(
        "--data", type=Path, default=DEFAULT_DATA_DIR, metavar="DIR", help="folder of real motion (default: ../shared/data)"
    )
    options = parser.parse_args(arguments)
    return run_command(lambda: _run(options))


def _run(options: argparse.Namespace) -> None:
    check_writable(options.out)
    study = STUDIES[options.name](options.data, options.out)
    text = json.dumps(study.table, indent=2, allow_nan=False)
    options.out.mkdir(parents=True, exist_ok=True)
    write_whole(options.out / "study.json", text + "\n")
    write_whole(options.out / "index.html", study_page(study))
    first = study.groups[0] if study.groups else Group("", "", {})
    print(study_text(study.table, first.measures, first.rows))
    print(f"study: {options.out / 'index.html'} and {options.out / 'study.json'}")
