"""How quickly a clip is cleaned: seconds of clip a second, against the bare simulation of the crowd that performs it.

What is timed begins with a file that was read and ends with one to be written, so without loading the program and its networks. The clip
is what a simulated suit makes of a made-up person who walks, or of the first long clip of a motion source.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from configs.errors import InputError
from datasets.imu.suit_simulation import simulate_suit
from datasets.library.sources import SYNTHETIC, load_clips
from datasets.motion.clip import FPS, BodyMotion
from datasets.retarget.humanoid_bvh import bvh_of
from datasets.retarget.performer_clip import capture
from datasets.retarget.retarget import retarget
from datasets.synthetic.clips import synthetic_clips
from envs.physics.mujoco_cpu import FilmedPhysics
from eval.benchmark.peers.bare_mujoco import BareBatch, Tape
from eval.benchmark.timing.interleaved import Contender, Speed, interleave, torch_threads
from eval.clean.pipeline import Cleaner
from eval.clean.samcon import CROWD, Crowd
from eval.clean.stages import repair

SECONDS = 10  # of the clip
THREADS = 2
KIND = "turn"  # of made-up motion: a walk with two bends, in which nobody leaves the ground
OURS, LIMIT, SEARCH, NO_PHYSICS = "clean", "bare MuJoCo", "crowd alone", "no physics"


class CrowdTape(Tape, FilmedPhysics):
    """Physics of a crowd that notes its controls, its resets and who went on from where whom was."""

    def branch(self, parents: np.ndarray) -> None:
        """Branch and note."""
        super().branch(parents)
        self.resets[len(self.targets)].append((np.arange(len(parents)), self.get_state()))


class BareCrowd(BareBatch):
    """The native batch alone, on a crowd's states and controls."""

    def prepare(self) -> None:
        """Go to where the recording began: a crowd is put in its places before its first step."""
        super().prepare()
        for worlds, states in self._tape.resets[0]:
            self._batch.state[worlds] = states


def benchmark_clean(motions: str, rounds: int, after_round: Callable[[], None] = lambda: None) -> Speed:
    """Return how quickly the package's policy cleans a clip of ten seconds.

    Args:
        motions: Motion source.
        rounds: How many rounds are kept; a round takes about half a minute.
        after_round: Called after each round.

    Raises:
        InputError: If the source holds no clip of ten seconds.
    """
    return measure_clean(Cleaner.load(threads=THREADS), faulty_clip(motions), rounds, after_round)


def faulty_clip(motions: str) -> BodyMotion:
    """Return ten seconds of a simulated suit's recording."""
    if motions == SYNTHETIC:
        clip = next(clip for clip in synthetic_clips(0, 1, SECONDS) if clip.kind == KIND)
    else:
        long = [clip for clip in load_clips(motions) if clip.seconds >= SECONDS]
        if not long:
            raise InputError(f"--motions {motions} holds no clip of {SECONDS} s, which is what is to be cleaned")
        clip = long[0].cut(0, round(SECONDS * FPS))
    return simulate_suit(clip, 0).faulty


def measure_clean(cleaner: Cleaner, clip: BodyMotion, rounds: int, after_round: Callable[[], None] = lambda: None) -> Speed:
    """Return the same of a cleaner and a clip at 60 fps on level ground."""
    bvh = bvh_of(clip)
    repaired = repair(retarget(capture(bvh, clip.name)).motion, [])

    def cleaning(by: Cleaner) -> Callable[[], float]:
        def run() -> float:
            by.clean(bvh, clip.name)
            return clip.seconds

        return run

    def search() -> float:
        _perform(cleaner, repaired)
        return clip.seconds

    plural = f"{cleaner.threads} thread{'s' * (cleaner.threads > 1)}"
    contenders = [
        Contender(OURS, f"ours, {plural}: BVH to BVH, of {clip.seconds:g} s; 1 is real time", cleaning(cleaner), limit=LIMIT),
        Contender(SEARCH, f"the {CROWD} humanoids with policy, observation and choice", search, limit=LIMIT),
        _bare(cleaner, repaired),
        Contender(NO_PHYSICS, "the same cleaning without the simulation", cleaning(replace(cleaner, policy=None))),
    ]
    with torch_threads(cleaner.threads):
        rates = interleave(contenders, rounds, after_round)
    return Speed("clean", "seconds of clip/s", contenders, rates, OURS)


def _perform(cleaner: Cleaner, clip: BodyMotion, physics: FilmedPhysics | None = None) -> None:
    """Let a crowd perform a clip, take after take."""
    assert cleaner.policy is not None
    crowd = Crowd(cleaner.policy, cleaner.spec, clip, cleaner.threads)
    if physics:
        crowd._env.physics = crowd._physics = physics
    for _ in crowd.takes():
        pass


def _bare(cleaner: Cleaner, clip: BodyMotion) -> Contender:
    """Return bare MuJoCo on the way that the crowd goes, recorded once: it is always the same."""
    tape = CrowdTape(CROWD, cleaner.threads)
    _perform(cleaner, clip, tape)
    bare = BareCrowd(tape, CROWD, cleaner.threads)

    def run() -> float:
        bare.run()  # it raises if it ends elsewhere
        return clip.seconds

    return Contender(LIMIT, "mujoco.batch.Batch alone, through the crowd's states and controls", run, bare.prepare)
