"""Benchmark of ground contact: slip, depth and noise of feet in variants of the model, and the cost of a control step in each."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from rich.table import Table

from agents.weights.pretrained import PRETRAINED_POLICY
from datasets.library.motion_library import MotionLibrary
from datasets.library.sources import load_clips
from datasets.motion.clip import BodyMotion
from envs.mimic.spec import MimicSpec
from envs.physics.inverse_dynamics import with_feed_forward
from envs.physics.mujoco_cpu import CpuPhysics
from envs.vector_env import AdaptMimicVectorEnv
from eval.benchmark.contacts.measurement import ContactRecording, GroundContact, measure_ground_contact, record_contacts
from eval.benchmark.contacts.model_variants import HALF_TIME_STEP, IN_USE, PREVIOUS, VARIANT_BY_TIME_STEP_S, VARIANTS, ModelVariant
from eval.benchmark.contacts.plot import draw_contacts
from eval.benchmark.timing.interleaved import BenchmarkCase, BenchmarkResult, interleave, torch_threads
from eval.evaluation_recordings import TEST_CLIPS
from trainers.algorithms.policy_file import load_policy
from trainers.evaluation.evaluation_protocol import PolicyFn, zero_residual

ROOT_HELD, POLICY = "held", "policy"
MAX_ROOT_FORCE_BW = 0.4  # largest assist force on the root where there is no policy
CLIPS_PER_KIND = 2  # clips of each kind of another source
NUM_TIMED_WORLDS, NUM_TIMED_STEPS = 64, 5

RecordingsByVariant = dict[str, dict[str, ContactRecording]]  # by variant and mode


def benchmark_contact(motions: str, rounds: int, after_round: Callable[[], None] = lambda: None) -> BenchmarkResult:
    """Return the measures of ground contact in every variant of the model, and its rate.

    Args:
        motions: Folder of real motion that holds ``TEST_CLIPS``, or another source, of which two clips of each kind are taken.
        rounds: Number of rounds of the timing to keep; a round takes about five seconds, the measurement about two minutes.
        after_round: Called after each round.
    """
    policy, _, spec = load_policy(PRETRAINED_POLICY)
    return measure_contact(choose_clips(motions), policy.act, spec, VARIANTS, rounds, after_round)


def choose_clips(motions: str) -> dict[str, list[BodyMotion]]:
    """Return clips by kind of motion; see ``benchmark_contact``."""
    files = {kind: [Path(motions) / name for name in names] for kind, names in TEST_CLIPS.items()}
    if all(file.is_file() for each in files.values() for file in each):
        return {kind: [clip for file in each for clip in load_clips(file)] for kind, each in files.items()}
    found: dict[str, list[BodyMotion]] = {}
    for clip in load_clips(motions):
        if len(found.setdefault(clip.kind, [])) < CLIPS_PER_KIND:
            found[clip.kind].append(clip)
    return found


def measure_contact(
    clips: Mapping[str, Sequence[BodyMotion]],
    act: PolicyFn,
    spec: MimicSpec,
    variants: Sequence[ModelVariant],
    rounds: int,
    after_round: Callable[[], None] = lambda: None,
) -> BenchmarkResult:
    """Return the measures for clips by kind, a policy, its variant of the task, and variants of the model."""
    library = MotionLibrary.from_clips([clip for each in clips.values() for clip in each])
    library = with_feed_forward(library) if spec.feed_forward else library
    names = [kind for kind, each in clips.items() for _ in each]
    worlds = {kind: np.flatnonzero(np.array(names) == kind) for kind in clips}
    models = {variant.name: variant.build() for variant in variants}
    cases = [_timed(variant, models[variant.name], library, spec, act) for variant in variants]
    with torch_threads(1):
        rates = interleave(cases, rounds, after_round)
    recorders = {
        ROOT_HELD: partial(record_contacts, act=zero_residual(spec), root_force=MAX_ROOT_FORCE_BW),
        POLICY: partial(record_contacts, act=act),
    }
    found = {name: {mode: play(model, library, spec) for mode, play in recorders.items()} for name, model in models.items()}
    return _report(cases, rates, found, worlds)


def _timed(variant: ModelVariant, model: mujoco.MjModel, library: MotionLibrary, spec: MimicSpec, act: PolicyFn) -> BenchmarkCase:
    """Return the benchmark case of a policy's steps in the vector env on a model."""
    env = AdaptMimicVectorEnv(library, NUM_TIMED_WORLDS, spec, physics=lambda worlds, threads: CpuPhysics(worlds, threads, model))
    seen, _ = env.reset(seed=0)

    def run() -> int:
        nonlocal seen
        for _ in range(NUM_TIMED_STEPS):
            seen, *_ = env.step(act(seen))
        return NUM_TIMED_WORLDS * NUM_TIMED_STEPS

    return BenchmarkCase(variant.name, variant.description, run, limit="" if variant.name == PREVIOUS else PREVIOUS)


def _report(
    cases: Sequence[BenchmarkCase], rates: dict[str, np.ndarray], found: RecordingsByVariant, worlds: Mapping[str, np.ndarray]
) -> BenchmarkResult:
    """Return everything as a benchmark's result."""
    everyone = np.concat(list(worlds.values()))
    overall = {name: {mode: measure_ground_contact(one, everyone) for mode, one in modes.items()} for name, modes in found.items()}
    kinds = {name: {kind: measure_ground_contact(found[name][POLICY], of) for kind, of in worlds.items()} for name in (PREVIOUS, IN_USE)}
    steps = {step: overall[name] for step, name in VARIANT_BY_TIME_STEP_S.items()}
    cost = {name: float(np.median(rates[PREVIOUS] / rates[name])) for name in rates}
    halving = 1.0 - overall[HALF_TIME_STEP][ROOT_HELD].slip / overall[IN_USE][ROOT_HELD].slip
    details: dict[str, Any] = {
        "contact": {name: {mode: one._asdict() for mode, one in modes.items()} for name, modes in overall.items()},
        "kinds": {name: {kind: one._asdict() for kind, one in by.items()} for name, by in kinds.items()},
        "cost": cost,
        "halving_changes_slip_by": halving,
    }
    titles = {ROOT_HELD: "root held, no policy", POLICY: "the package's policy"}
    tables = [_table(titles[mode], {name: modes[mode] for name, modes in overall.items()}, cost) for mode in (ROOT_HELD, POLICY)]
    tables += [_table(f"{titles[POLICY]}, by kind of motion; {name}", by) for name, by in kinds.items()]
    summary = (
        f"Root held, half the time step changes the slip by {halving:.0%}; a control step costs {cost[IN_USE]:.2f} times that of before."
    )
    plot_png = draw_contacts(steps, kinds, (PREVIOUS, IN_USE))
    return BenchmarkResult("contact", "control steps/s", cases, rates, IN_USE, details=details, notes=(*tables, summary), plot_png=plot_png)


_COLUMNS = {  # of the tables: title and decimals by measure
    "slip": ("slip cm/s", 1),
    "slipping": ("load that slips", 2),
    "depth": ("depth mm", 1),
    "depth_p99": ("99 % mm", 1),
    "noise": ("reversing cm/s", 2),
    "power": ("taken W", 0),
    "contacts": ("contacts", 1),
    "body_error": ("body mm", 0),
    "lasted": ("lasted", 2),
}


def _table(title: str, rows: Mapping[str, GroundContact], cost: Mapping[str, float] | None = None) -> Table:
    """Return a table of measures, a row for each model or kind of motion, with the cost of a control step relative to ``PREVIOUS``."""
    table = Table(title=title)
    table.add_column("")
    for name in (*(name for name, _ in _COLUMNS.values()), *(("cost",) if cost else ())):
        table.add_column(name, justify="right")
    for name, row in rows.items():
        cells = [f"{getattr(row, field):.{digits}f}" for field, (_, digits) in _COLUMNS.items()]
        table.add_row(name, *cells, *([f"{cost[name]:.2f}"] if cost else []))
    return table
