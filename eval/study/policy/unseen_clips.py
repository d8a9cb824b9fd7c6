"""Clips of the policy studies: the training sets, and test clips of performers that no training saw."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from configs.errors import InputError
from datasets.library.motion_library import ClipInfo, MotionLibrary
from datasets.library.sources import find_motion_files, unique_names
from datasets.motion.clip import SIMULATED_SUIT
from eval.evaluation_recordings import TEST_FOLDERS, TRAIN_FOLDER
from trainers.data.motion_config import DataConfig
from trainers.data.training_motions import PreparedMotions, prepare_motions
from trainers.evaluation.evaluation_protocol import Rollouts, evaluation_rollouts

Log = Callable[[str], None]


@dataclass(frozen=True)
class UnseenClips:
    """Test clips of one folder, through suits or as recorded.

    Attributes:
        source: "cmu" or "bandai".
        through_suit: Whether the clips go through simulated suits, else they are as recorded.
        library: Library of the clips.
        rollouts: Rollouts of the evaluation protocol.
        too_short: Names of the clips that the protocol leaves out.
    """

    source: str
    through_suit: bool
    library: MotionLibrary
    rollouts: Rollouts
    too_short: tuple[str, ...]


def choose_half(clips: Iterable[ClipInfo]) -> set[str]:
    """Return the names of clips that make up about half of the frames, chosen in turns by performer and name.

    Args:
        clips: Clips as recorded; pieces of one recording count as one, under its name.
    """
    frames: dict[tuple[str, str], int] = {}
    for clip in clips:
        recording = clip.performer, clip.name.partition("#")[0]
        frames[recording] = frames.get(recording, 0) + clip.frames
    seen, taken, names = 0, 0, set()
    for performer, name in sorted(frames):
        count = frames[performer, name]
        seen += count
        if taken + count / 2 <= seen / 2:  # nearer to half with it than without it
            taken += count
            names.add(name)
    return names


def split_half(config: DataConfig, folder: Path, cache: Path, log: Log) -> tuple[str, set[str]]:
    """Link half of the training clips in a folder of their own; return the held-out performer, and all performers.

    Args:
        config: Data configuration of the trainings with all clips.
        folder: Folder of the half.
        cache: Folder of prepared motion.
        log: Called with each line of progress.
    """
    whole = prepare_motions(config, cache, log)
    link_half(whole, Path(config.motions), folder)
    return whole.held_out, {clip.performer for clip in (*whole.training.clips, *whole.holdout.clips)}


def link_half(whole: PreparedMotions, source: Path, folder: Path) -> None:
    """Fill a folder with links to half of the recordings of a folder, and to all of the held-out performer.

    Args:
        whole: Prepared motion of the source.
        source: Folder of recordings.
        folder: Folder of the links.
    """
    wanted = choose_half(clip for clip in whole.training.clips if clip.system != SIMULATED_SUIT)
    wanted |= {clip.name.partition("#")[0] for clip in whole.holdout.clips}
    files = find_motion_files(source)
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    for file, name in zip(files, unique_names(files), strict=True):
        if name in wanted:
            (folder / f"{name.replace('/', '_')}{file.suffix}").symlink_to(file.resolve())


def load_unseen_clips(data: Path, config: DataConfig, performers: set[str], cache: Path, log: Log) -> list[UnseenClips]:
    """Return the clips of the test folders whose performers are in no training set, through simulated suits and as recorded.

    Args:
        data: Folder of real motion.
        config: Data configuration of the trainings, which sets suits and roots.
        performers: Performers of all training clips.
        cache: Folder of prepared motion.
        log: Called with each line of progress.

    Raises:
        InputError: If a folder holds no clip of an unseen performer that is long enough.
    """
    found = []
    for folder in TEST_FOLDERS:
        tested = replace(config, motions=str((data / folder).resolve()), holdout="none")
        library = prepare_motions(tested, cache, log).training
        for suited in (True, False):
            wanted = [clip.performer not in performers and (clip.system == SIMULATED_SUIT) == suited for clip in library.clips]
            if not any(wanted):
                raise InputError(f"{data / folder} holds no clip of a performer who is not in {TRAIN_FOLDER} too")
            chosen = library.select(wanted)
            rollouts, too_short = evaluation_rollouts(chosen)
            if not len(rollouts.clip):
                raise InputError(f"{data / folder} holds no clip that is long enough for the protocol")
            found.append(UnseenClips(Path(folder).parent.name, suited, chosen, rollouts, tuple(too_short)))
    return found
