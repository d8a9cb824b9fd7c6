"""Benchmark of cleaning: seconds of clip per second, against the bare simulation of the search's samples.

Timing begins with a file that was read and ends with one to be written, without loading the program and its networks. The clip is a
simulated suit's recording of a synthetic walk, or of the first long clip of a motion source.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from configs.errors import InputError
from configs.process_pool import available_cores
from datasets.imu.suit_simulation import simulate_suit
from datasets.library.sources import SYNTHETIC_SOURCE, load_clips
from datasets.motion.clip import FPS, BodyMotion
from datasets.performer.performer_clip import performer_clip_from_bvh
from datasets.retarget.humanoid_bvh import to_humanoid_bvh
from datasets.retarget.retarget import retarget
from datasets.synthetic.clips import synthetic_clips
from envs.physics.mujoco_cpu import RecordingPhysics
from eval.benchmark.peers.bare_mujoco import BareBatch, ControlRecorder
from eval.benchmark.timing.interleaved import BenchmarkCase, BenchmarkResult, interleave, torch_threads
from eval.clean.edits import PHYSICS
from eval.clean.pipeline import CleaningPipeline
from eval.clean.quality import BEST, FAST, GOOD, QUALITIES, SearchSettings, Simulator
from eval.clean.samcon import SamconSearch
from eval.clean.stages import repair_kinematically

CLIP_S = 6  # duration of the clip
SYNTHETIC_KIND = "turn"  # of synthetic motion: a walk with two bends, always on the ground
OURS, LIMIT, SEARCH, NO_PHYSICS = "clean", "bare MuJoCo", "search alone", "no physics"


class SamconRecorder(ControlRecorder, RecordingPhysics):
    """Physics of the search that records its controls, its resets and its branches."""

    def branch(self, parents: np.ndarray) -> None:
        """Branch and record it."""
        super().branch(parents)
        self.resets[len(self.targets)].append((np.arange(len(parents)), self.get_state()))


class BareSamcon(BareBatch):
    """Native batch alone, on the states and controls of a search."""

    def prepare(self) -> None:
        """Restore the initial state of the recording: the samples are reset before their first step."""
        super().prepare()
        for worlds, states in self._recorder.resets[0]:
            self._batch.state[worlds] = states


def benchmark_clean(motions: str, rounds: int, after_round: Callable[[], None] = lambda: None) -> BenchmarkResult:
    """Return the rates at which the package's policy cleans a clip of six seconds.

    Args:
        motions: Motion source.
        rounds: Number of rounds to keep; a round takes two minutes.
        after_round: Called after each round.

    Raises:
        InputError: If the source holds no clip of six seconds.
    """
    return measure_clean(CleaningPipeline.load(available_cores(), search=QUALITIES[FAST]), faulty_clip(motions), rounds, after_round)


def faulty_clip(motions: str) -> BodyMotion:
    """Return six seconds of a simulated suit's recording."""
    if motions == SYNTHETIC_SOURCE:
        clip = next(clip for clip in synthetic_clips(0, 1, CLIP_S) if clip.kind == SYNTHETIC_KIND)
    else:
        long = [clip for clip in load_clips(motions) if clip.seconds >= CLIP_S]
        if not long:
            raise InputError(f"--motions {motions} holds no clip of {CLIP_S} s, which is what is to be cleaned")
        clip = long[0].cut(0, round(CLIP_S * FPS))
    return simulate_suit(clip, 0).faulty


def measure_clean(
    cleaner: CleaningPipeline, clip: BodyMotion, rounds: int, after_round: Callable[[], None] = lambda: None
) -> BenchmarkResult:
    """Return the rates for a cleaning pipeline that searches and a clip at 60 fps on level ground."""
    bvh = to_humanoid_bvh(clip)
    repaired = repair_kinematically(retarget(performer_clip_from_bvh(bvh, clip.name)).motion, [])

    def cleaning(by: CleaningPipeline) -> Callable[[], float]:
        def run() -> float:
            by.clean(bvh, clip.name)
            return clip.seconds

        return run

    simulator = cleaner.simulator
    assert simulator is not None
    settings = simulator.search
    assert isinstance(settings, SearchSettings)

    def search() -> float:
        _search(simulator, settings, repaired)
        return clip.seconds

    def of_quality(quality: str) -> CleaningPipeline:
        return replace(cleaner, simulator=replace(simulator, search=QUALITIES[quality]))

    plural = f"{simulator.threads} thread{'s' * (simulator.threads > 1)}"
    cases = [
        BenchmarkCase(
            OURS, f"--quality {FAST}, {plural}: BVH to BVH, of {clip.seconds:g} s; 1 is real time", cleaning(cleaner), limit=LIMIT
        ),
        BenchmarkCase(SEARCH, f"the {settings.num_samples} humanoids with policy, observation and choice", search, limit=LIMIT),
        _bare(simulator, settings, repaired),
        *(BenchmarkCase(f"quality {quality}", f"--quality {quality}", cleaning(of_quality(quality))) for quality in (GOOD, BEST)),
        BenchmarkCase(NO_PHYSICS, "the same cleaning without the simulation", cleaning(cleaner.without([PHYSICS]))),
    ]
    with torch_threads(simulator.threads):
        rates = interleave(cases, rounds, after_round)
    return BenchmarkResult("clean", "seconds of clip/s", cases, rates, OURS)


def _search(simulator: Simulator, settings: SearchSettings, clip: BodyMotion, physics: RecordingPhysics | None = None) -> None:
    """Run the SAMCON search over a clip, segment by segment."""
    samcon = SamconSearch(simulator, settings, clip)
    if physics:
        samcon._env.physics = samcon._physics = physics
    for _ in samcon.segments():
        pass


def _bare(simulator: Simulator, settings: SearchSettings, clip: BodyMotion) -> BenchmarkCase:
    """Return the case of bare MuJoCo on the search's states and controls, recorded once: they are always the same."""
    size = settings.num_samples, simulator.threads
    recorder = SamconRecorder(*size)
    _search(simulator, settings, clip, recorder)
    bare = BareSamcon(recorder, *size)

    def run() -> float:
        bare.run()  # it raises if it ends elsewhere
        return clip.seconds

    return BenchmarkCase(LIMIT, "mujoco.batch.Batch alone, through the search's states and controls", run, bare.prepare)
