"""How feet meet the ground in variants of the model, without a policy and with the package's, and what a control step costs in each."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from rich.table import Table

from agents.weights.pretrained import SHIPPED_POLICY
from datasets.library.motion_library import MotionLibrary
from datasets.library.sources import load_clips
from datasets.motion.clip import BodyMotion
from envs.mimic.spec import MimicSpec
from envs.physics.inverse_dynamics import with_feed_forward
from envs.physics.mujoco_cpu import CpuPhysics
from envs.vector_env import AdaptMimicVectorEnv
from eval.benchmark.contacts.measurement import GroundContact, Watched, measure, watch
from eval.benchmark.contacts.model_variants import BEFORE, CHOSEN, HALVED, STEPS, VARIANTS, ModelVariant
from eval.benchmark.contacts.plot import draw_contacts
from eval.benchmark.timing.interleaved import Contender, Speed, interleave, torch_threads
from eval.recordings import CLIPS
from trainers.algorithms.policy_file import load_policy
from trainers.evaluation.protocol import Act, zero_residual

HELD, POLICY = "held", "policy"
ROOT_FORCE = 0.4  # body weights that lead the root where there is no policy
EACH = 2  # clips of each kind of another source
WORLDS, STEPS_TIMED = 64, 5

Found = dict[str, dict[str, Watched]]  # by variant and mode


def benchmark_contact(motions: str, rounds: int, after_round: Callable[[], None] = lambda: None) -> Speed:
    """Return what every variant of the model does to feet on the ground, and how quick it is.

    Args:
        motions: Folder of real motion that holds ``CLIPS``, or another source, of which two clips of each kind are taken.
        rounds: How many rounds are kept of the timing; a round takes about five seconds, the measuring about two minutes.
        after_round: Called after each round.
    """
    policy, _, spec = load_policy(SHIPPED_POLICY)
    return measure_contact(choose_clips(motions), policy.act, spec, VARIANTS, rounds, after_round)


def choose_clips(motions: str) -> dict[str, list[BodyMotion]]:
    """Return clips by kind of motion; see ``benchmark_contact``."""
    files = {kind: [Path(motions) / name for name in names] for kind, names in CLIPS.items()}
    if all(file.is_file() for each in files.values() for file in each):
        return {kind: [clip for file in each for clip in load_clips(file)] for kind, each in files.items()}
    found: dict[str, list[BodyMotion]] = {}
    for clip in load_clips(motions):
        if len(found.setdefault(clip.kind, [])) < EACH:
            found[clip.kind].append(clip)
    return found


def measure_contact(
    clips: Mapping[str, Sequence[BodyMotion]],
    act: Act,
    spec: MimicSpec,
    variants: Sequence[ModelVariant],
    rounds: int,
    after_round: Callable[[], None] = lambda: None,
) -> Speed:
    """Return the same of clips by kind, a policy for a variant of the task, and variants of the model."""
    library = MotionLibrary.of([clip for each in clips.values() for clip in each])
    library = with_feed_forward(library) if spec.feed_forward else library
    names = [kind for kind, each in clips.items() for _ in each]
    worlds = {kind: np.flatnonzero(np.array(names) == kind) for kind in clips}
    models = {variant.name: variant.build() for variant in variants}
    contenders = [_timed(variant, models[variant.name], library, spec, act) for variant in variants]
    with torch_threads(1):
        rates = interleave(contenders, rounds, after_round)
    plays = {HELD: partial(watch, act=zero_residual(spec), root_force=ROOT_FORCE), POLICY: partial(watch, act=act)}
    found = {name: {mode: play(model, library, spec) for mode, play in plays.items()} for name, model in models.items()}
    return _report(contenders, rates, found, worlds)


def _timed(variant: ModelVariant, model: mujoco.MjModel, library: MotionLibrary, spec: MimicSpec, act: Act) -> Contender:
    """Return the vector env on a model, steps of a policy."""
    env = AdaptMimicVectorEnv(library, WORLDS, spec, physics=lambda worlds, threads: CpuPhysics(worlds, threads, model))
    seen, _ = env.reset(seed=0)

    def run() -> int:
        nonlocal seen
        for _ in range(STEPS_TIMED):
            seen, *_ = env.step(act(seen))
        return WORLDS * STEPS_TIMED

    return Contender(variant.name, variant.what, run, limit="" if variant.name == BEFORE else BEFORE)


def _report(contenders: Sequence[Contender], rates: dict[str, np.ndarray], found: Found, worlds: Mapping[str, np.ndarray]) -> Speed:
    """Return everything as a benchmark's result."""
    everyone = np.concat(list(worlds.values()))
    overall = {name: {mode: measure(one, everyone) for mode, one in modes.items()} for name, modes in found.items()}
    kinds = {name: {kind: measure(found[name][POLICY], of) for kind, of in worlds.items()} for name in (BEFORE, CHOSEN)}
    steps = {step: overall[name] for step, name in STEPS.items()}
    cost = {name: float(np.median(rates[BEFORE] / rates[name])) for name in rates}
    halving = 1.0 - overall[HALVED][HELD].slip / overall[CHOSEN][HELD].slip
    details: dict[str, Any] = {
        "contact": {name: {mode: one._asdict() for mode, one in modes.items()} for name, modes in overall.items()},
        "kinds": {name: {kind: one._asdict() for kind, one in by.items()} for name, by in kinds.items()},
        "cost": cost,
        "halving_changes_slip_by": halving,
    }
    titles = {HELD: "root held, no policy", POLICY: "the package's policy"}
    tables = [_table(titles[mode], {name: modes[mode] for name, modes in overall.items()}, cost) for mode in (HELD, POLICY)]
    tables += [_table(f"{titles[POLICY]}, by kind of motion; {name}", by) for name, by in kinds.items()]
    said = f"Root held, half the time step changes the slip by {halving:.0%}; a control step costs {cost[CHOSEN]:.2f} times that of before."
    picture = draw_contacts(steps, kinds, (BEFORE, CHOSEN))
    return Speed("contact", "control steps/s", contenders, rates, CHOSEN, details=details, notes=(*tables, said), picture=picture)


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
    """Return measures for people, a row for each model or kind of motion, and what a control step costs, times that of before."""
    table = Table(title=title)
    table.add_column("")
    for name in (*(name for name, _ in _COLUMNS.values()), *(("cost",) if cost else ())):
        table.add_column(name, justify="right")
    for name, row in rows.items():
        cells = [f"{getattr(row, field):.{digits}f}" for field, (_, digits) in _COLUMNS.items()]
        table.add_row(name, *cells, *([f"{cost[name]:.2f}"] if cost else []))
    return table
