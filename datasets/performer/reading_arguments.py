"""Options of command lines that say what a recording is, where it is detected wrongly or not at all."""

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from configs.errors import InputError
from datasets.formats.bvh_parser import MAX_FRAME_TIME, MIN_FRAME_TIME
from datasets.performer.reading_options import UP_AXES, ReadingOptions, read_mapping


def add_reading_options(parser: argparse.ArgumentParser) -> None:
    """Add the options to a parser."""
    say = parser.add_argument_group("what the recording is, where it is detected wrongly")
    say.add_argument("--mapping", type=Path, metavar="FILE", help="YAML that names joints, unit or up axis, as in 'thigh_l: LeftUpLeg'")
    say.add_argument("--figure", type=int, metavar="N", help="which figure of a file that holds several, counted from 1")
    say.add_argument("--skeleton", type=Path, metavar="FILE", help="ASF file of AMC files, where it is not found beside them")
    say.add_argument("--up", choices=UP_AXES, help="axis of the file that points up")
    say.add_argument("--unit", type=float, metavar="METRES", help="metres in a unit of the file, such as 0.01")
    say.add_argument("--fps", type=float, metavar="N", help="frame rate, where the file's is wrong; the output has it, too")
    say.add_argument("--mirror", action="store_true", help="exchange left and right, of a file from a left-handed program")
    say.add_argument(
        "--ground", choices=("keep", "zero"), default="keep", help="leave the ground at its height, or put it on 0 (default %(default)s)"
    )
    say.add_argument(
        "--jumps",
        choices=("keep", "close"),
        default="keep",
        help="where the root jumps from one frame to the next: jump as well, or join what is before and after (default %(default)s)",
    )


def parse_reading(parser: argparse.ArgumentParser, arguments: Sequence[str] | None) -> argparse.Namespace:
    """Return the parsed arguments, the process's own if None; ``--up -y`` is read like ``--up=-y``, which argparse takes for an option."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    for index in range(len(words) - 2, -1, -1):
        if words[index] == "--up" and words[index + 1] in UP_AXES:
            words[index : index + 2] = [f"--up={words[index + 1]}"]
    return parser.parse_args(words)


def reading_from_arguments(arguments: argparse.Namespace) -> ReadingOptions:
    """Return what the user said, in a mapping file and by options, of which the options count more.

    Raises:
        InputError: If a number is none that could be, or the mapping file is broken.
    """
    if arguments.unit is not None and not 0.0 < arguments.unit < math.inf:
        raise InputError(f"--unit {arguments.unit:g} should be a positive number")
    if arguments.fps is not None and not 1 / MAX_FRAME_TIME <= arguments.fps <= 1 / MIN_FRAME_TIME:
        raise InputError(f"--fps {arguments.fps:g} should be a frame rate from {1 / MAX_FRAME_TIME:g} to {1 / MIN_FRAME_TIME:g}")
    reading = read_mapping(arguments.mapping) if arguments.mapping else ReadingOptions()
    return replace(
        reading,
        unit=arguments.unit or reading.unit,
        up_axis=arguments.up or reading.up_axis,
        fps=arguments.fps,
        figure=arguments.figure,
        skeleton=arguments.skeleton,
        mirror=arguments.mirror,
        zero_ground=arguments.ground == "zero",
        close_jumps=arguments.jumps == "close",
    )
