"""Description of motion files, their retargeting and floor calibration: ``python -m datasets.describe PATH``."""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.progress import track
from rich.table import Table
from rich.text import Text

from configs.errors import InputError
from configs.exit_codes import run_command
from datasets.describe.picture import draw
from datasets.formats.motion_file import FORMATS_IN_WORDS
from datasets.joints.joint_mapping import OPTIONAL_BODIES
from datasets.joints.mapping_draft import JointMapError, save_draft
from datasets.library.sources import find_motion_files
from datasets.motion.humanoid import BODY_NAMES
from datasets.performer.performer_clip import PerformerClip, load_performer_clip, name_of_unit
from datasets.performer.reading_arguments import add_reading_options, parse_reading, reading_from_arguments
from datasets.performer.reading_options import ReadingOptions
from datasets.retarget.plausibility import find_implausible
from datasets.retarget.read_as import facing
from datasets.retarget.retarget import Retargeted, retarget
from datasets.retarget.retarget_error import RetargetMetrics, measure_retarget

# Joint name -> program whose skeletons have such a joint; the first that is found counts
FAMILIES = {
    "LHipJoint": "CMU",
    "lButtock": "daz",
    "lbuttock": "MakeHuman",
    "joint_Root": "Bandai",
    "Chest4": "Xsens",
    "Spine3": "Perception Neuron",
    "LeftInHandIndex": "Rokoko",
}
MIN_WIDTH = 200  # characters in a line, where the output is no terminal
CAPTION = """\
unit, up, facing: as read; facing is that of the first frame. ground [m]: height of the ground in the file, found under standing feet.
scale: our leg length over the performer's. lift [cm]: put onto all heights so that standing feet are on the ground.
error [mm]: mean distance of our joints from the performer's scaled ones, hips aligned. world: the same with the lift.
moving: what is left of it without each joint's mean offset, which is proportions. worst body: by error [mm].
lowest foot [cm]: lowest / lowest tenth / median of the frames. jumps: frames in which a body accelerates impossibly."""


@dataclass(frozen=True)
class Description:
    """Description of one file.

    Attributes:
        path: Path of the file.
        retargeted: Clip of the file on the 20 bodies.
        fidelity: Measures of the retargeting.
        warnings: Lines about what was guessed, or cannot be.
    """

    path: Path
    retargeted: Retargeted
    fidelity: RetargetMetrics
    warnings: tuple[str, ...]


def describe(source: Path, reading: ReadingOptions | None = None) -> tuple[list[Description], list[InputError]]:
    """Return descriptions of the files of a source, and what is wrong with those of a folder that were left out.

    Args:
        source: Motion file, or a folder of them.
        reading: Joints, unit, axes and rate of all the files; what it leaves out is detected.

    Returns:
        A description for each file, sorted by path, and errors.

    Raises:
        InputError: If there is no file, or the only one is broken.
    """
    described, broken = [], []
    for path in track(find_motion_files(source), "reading", console=Console(stderr=True), transient=True):
        try:
            retargeted = retarget(load_performer_clip(path, reading))
        except InputError as error:
            if source.is_file():
                raise
            broken.append(error)
            continue
        warnings = (*retargeted.performer_clip.notices, *find_implausible(retargeted))
        described.append(Description(path, retargeted, measure_retarget(retargeted), warnings))
    return described, broken


def table(described: list[Description]) -> Table:
    """Return a table with a row for each clip."""
    rows = Table(title="Clips on the 20 bodies", caption=Text(CAPTION), caption_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in ("clip", "skeleton", "unit, up, facing"):
        rows.add_column(heading, no_wrap=True)
    for heading in ("1/s", "frames", "s", "ground", "scale", "lift", "error", "world", "moving"):
        rows.add_column(heading, justify="right", no_wrap=True)
    for heading in ("worst body", "lowest foot", "notes"):
        rows.add_column(heading, no_wrap=heading != "notes")
    for description in described:
        rows.add_row(*_row(description))
    return rows


def _row(description: Description) -> tuple[str, ...]:
    """Return the cells of a clip's row."""
    retargeted, fidelity = description.retargeted, description.fidelity
    performer_clip, motion = retargeted.performer_clip, retargeted.motion
    worst = int(np.nanargmax(fidelity.error_local))
    low = 100 * np.percentile(fidelity.lowest_foot, [0, 10, 50])
    errors = (fidelity.error_local, fidelity.error_world, fidelity.error_moving)
    return (
        motion.name,
        _skeleton(performer_clip),
        f"{name_of_unit(performer_clip.unit)}, {performer_clip.up_axis}, {facing(retargeted)}",
        f"{motion.fps:g}",
        str(len(motion)),
        f"{motion.seconds:.2f}",
        f"{retargeted.ground:.2f}",
        f"{retargeted.scale:.3f}",
        f"{100 * retargeted.lift:.1f}",
        *(f"{1000 * np.nanmean(error):.0f}" for error in errors),
        f"{BODY_NAMES[worst]} {1000 * fidelity.error_local[worst]:.0f}",
        " / ".join(f"{height:.1f}" for height in low),
        ", ".join(_notes(description)),
    )


def _skeleton(performer_clip: PerformerClip) -> str:
    """Return the number of joints and, if recognised, the program that made the skeleton."""
    names = performer_clip.motion.skeleton.names
    family = next((family for joint, family in FAMILIES.items() if joint in names), "")
    return f"{family} {len(names) - len(performer_clip.edits.added)} joints".strip()


def _notes(description: Description) -> list[str]:
    """Return notes of what is unusual about a clip."""
    retargeted, fidelity = description.retargeted, description.fidelity
    performer_clip, calibration = retargeted.performer_clip, retargeted.calibration
    lacking = [body for body in OPTIONAL_BODIES if body not in performer_clip.joint_map]
    locked = [f"{BODY_NAMES[body]} {share:.1%}" for body, share in enumerate(fidelity.near_lock) if share > 0.005]
    notes = {
        "left and right exchanged": performer_clip.reading.mirror,
        f"T-pose dropped ({performer_clip.dropped_frames} frames)": performer_clip.dropped_frames,
        f"no {', '.join(lacking)}": lacking,
        "rest pose not human": not calibration.rest_is_human,
        "no foot ever stands": not calibration.stance_mask.any(),
        f"{fidelity.jumps} jumps": fidelity.jumps,
        f"near gimbal lock: {', '.join(locked)}": locked,
    }
    return [note for note, holds in notes.items() if holds]


def _draw_all(described: list[Description], folder: Path) -> None:
    """Draw a picture of each clip into a folder, under the file's name, with its folder's in front where two are the same."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made ({error.strerror}); give a folder to write to") from error
    stems = [description.path.stem for description in described]
    for description, stem in track(list(zip(described, stems, strict=True)), "drawing", console=Console(stderr=True), transient=True):
        name = stem if stems.count(stem) == 1 else f"{description.path.parent.name}_{stem}"
        draw(description.retargeted, description.fidelity, folder / f"{name}.png")


def main(arguments: list[str] | None = None, prog: str = "python -m datasets.describe") -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog=prog, description="Say what motion files are and how they retarget.")
    parser.add_argument("path", type=Path, help=f"a {FORMATS_IN_WORDS} file, or a folder of them")
    parser.add_argument("--out", type=Path, help="folder for a picture of each clip")
    add_reading_options(parser)
    options = parse_reading(parser, arguments)
    return run_command(lambda: _run(options))


def _run(options: argparse.Namespace) -> None:
    try:
        described, broken = describe(options.path, reading_from_arguments(options))
    except JointMapError as error:
        raise save_draft(error, error.clip, Path()) from error
    for line in _left_out(broken):
        print(line, file=sys.stderr)
    if not described:
        raise InputError(f"{options.path}: none of {len(broken)} motion files can be read, see above")
    if options.out:
        _draw_all(described, options.out)
    console = Console()
    if not console.is_terminal:
        console = Console(width=max(console.width, MIN_WIDTH))
    console.print(table(described))
    for description in described:
        for warning in description.warnings:
            console.print(Text(f"{description.path.name}: {warning}"), soft_wrap=True)
    if broken:
        total = len(described) + len(broken)
        raise InputError(f"{options.path}: {len(broken)} of {total} files could not be read, see above; the others are described")


def _left_out(broken: list[InputError]) -> Iterator[str]:
    """Yield a line for each file that was left out; a draft of a mapping file is written for each kind of skeleton."""
    drafts = set[str]()
    for error in broken:
        if isinstance(error, JointMapError) and error.draft not in drafts:
            drafts.add(error.draft)
            yield f"{save_draft(error, error.clip, Path())}; left out"
        else:
            yield f"{error}; left out"
