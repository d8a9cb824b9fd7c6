"""Clips, suits and mixture put together into the libraries that a run trains and selects on; prepared once, then cached."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from configs.errors import InputError
from datasets.imu.suit_simulation import simulate_suit
from datasets.library.motion_library import MotionLibrary
from datasets.library.sources import ROUGH_GROUND_KINDS, SYNTHETIC, Recorded, load_clips, load_recordings
from datasets.library.splits import choose_holdout, clip_weights, identity
from datasets.motion.clip import BodyMotion
from datasets.motion.discontinuities import cut_at_jumps
from datasets.motion.mirror import mirrored
from datasets.retarget.joint_mapping import read_mapping
from envs.physics.inverse_dynamics import with_feed_forward
from trainers.data.fingerprint import fingerprint
from trainers.data.motion_cache import read_prepared, write_prepared
from trainers.data.motion_config import CLEAN, RECONSTRUCTED, DataConfig
from trainers.data.root_reconstruction import FAULTY_SYSTEMS, Roots

SHORTEST = 1.0  # s; from less nothing can be learnt


@dataclass(frozen=True)
class PreparedMotions:
    """What a run trains and selects on.

    Attributes:
        training: Clips of all performers but the held-out one, as recorded and through simulated suits.
        weights: How often each training clip is drawn, shape (clips,).
        holdout: Clips of the held-out performer, the same way; the training clips where nobody is held out.
        held_out: The held-out performer, or "none".
    """

    training: MotionLibrary
    weights: np.ndarray
    holdout: MotionLibrary
    held_out: str

    @property
    def identity(self) -> str:
        """What tells this motion from another: a resumed run must go on with the same."""
        return identity((*self.training.clips, *self.holdout.clips))


def prepare_motions(config: DataConfig, cache: Path, say: Callable[[str], None]) -> PreparedMotions:
    """Return the libraries of a run, from the cache where the same were prepared before.

    Args:
        config: Which motion.
        cache: Folder of prepared libraries.
        say: Told in a line what happens.

    Raises:
        InputError: If the source is bad, holds nothing to train on, or the held-out performer is unknown.
    """
    settings = {**asdict(config), "holdout": "", "suit_share": 0}
    path = cache / f"{fingerprint(settings, config.motions, config.mapping, __name__)}.safetensors"
    prepared = read_prepared(path)
    if prepared is None:
        say(f"preparing motion from {config.motions}")
        library = build_library(config, say)
        write_prepared(path, library.clips, library.arrays(), library.fps)
    else:
        say(f"motion from {config.motions} was prepared before: {path}")
        library = MotionLibrary.from_arrays(*prepared)
    say(f"roots of suits and of clips without one: {config.roots}")
    held_out = choose_holdout(library.clips, config.holdout)
    training = library.select([clip.performer != held_out for clip in library.clips])
    holdout = library.select([held_out in ("none", clip.performer) for clip in library.clips])
    return PreparedMotions(training, clip_weights(training.clips, config.suit_share), holdout, held_out)


def build_library(config: DataConfig, say: Callable[[str], None]) -> MotionLibrary:
    """Return all clips of a source with their simulated suit recordings, packed."""
    mapping = read_mapping(config.mapping) if config.mapping else None
    recorded = load_recordings(config.motions, mapping, seed=config.seed)
    for made_up in range(1, config.synthetic + 1):
        recorded += [Recorded(replace(clip, name=f"{clip.name}_{made_up}")) for clip in load_clips(SYNTHETIC, seed=config.seed + made_up)]
    level = [one for one in recorded if one.clip.kind not in ROUGH_GROUND_KINDS and one.clip.seconds >= SHORTEST]
    roots = Roots(config.roots == RECONSTRUCTED, say)
    usable = [part for clip in roots.of_recordings(level)[0] for part in cut_at_jumps(clip) if part.seconds >= SHORTEST]
    if not usable:
        raise InputError(f"data.motions={config.motions} holds no clip of at least {SHORTEST:g} s on flat ground")
    seconds, given = sum(clip.seconds for clip in usable), sum(one.clip.seconds for one in recorded)
    say(
        f"{len(recorded)} clips, {given / 60:.1f} minutes; {seconds / 60:.1f} minutes in {len(usable)} pieces on flat ground, without jumps"
    )
    suited, truths = wear_suits([clip for clip in usable if clip.system not in FAULTY_SYSTEMS], config, roots)
    if suited:
        by = "Root3D" if roots.reconstructed else "the suit's software"
        say(f"{len(suited)} recordings through simulated IMU suits of severity {config.suit_severity:g}, roots by {by}")
    clips, clean = [*usable, *suited], [*usable, *truths]
    if config.mirror:
        twins = [mirrored(clip) for clip in clips]
        clips, clean = [*clips, *twins], [*clean, *twins[: len(usable)], *map(mirrored, truths)]
    return with_feed_forward(MotionLibrary.of(clips, clean, config.rewarded == CLEAN))


def wear_suits(clips: list[BodyMotion], config: DataConfig, roots: Roots) -> tuple[list[BodyMotion], list[BodyMotion]]:
    """Return what simulated suits make of clean clips, and for each of them the clean clip behind it."""
    suited, truths = [], []
    for index, clip in enumerate(clips):
        for take in range(config.suit_clips):
            seed = int(np.random.SeedSequence((config.seed, index, take)).generate_state(1)[0])
            faulty = roots.of_suit(simulate_suit(clip, seed=seed, severity=config.suit_severity))
            suited.append(replace(faulty, name=f"{faulty.name}{take + 1}") if take else faulty)
            truths.append(clip)
    return suited, truths
