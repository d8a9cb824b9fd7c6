"""Benchmark of one PPO update against its own matrix products, and against the same update by other libraries."""

from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import torch

from agents.policy.mlp import HAS_ONEDNN, onednn_linear
from configs.load import CONFIG_DIR, load_config
from datasets.library.motion_library import MotionLibrary
from envs.gym_env import load_motion_library
from eval.benchmark.peers.matmul_limit import MatrixProducts, chosen_product, multiply_by_default
from eval.benchmark.peers.ppo_updates import PeerData, RslLearner, Sb3Learner, peer_data
from eval.benchmark.timing.interleaved import BenchmarkCase, BenchmarkResult, interleave
from trainers.algorithms.ppo_config import PpoConfig
from trainers.algorithms.ppo_learner import PpoLearner
from trainers.algorithms.rollout import Rollout, Step
from trainers.collectors.cpu_collector import CpuCollector

OURS = "ours"
ONEDNN, DEFAULT = "its matrix products, oneDNN", "its matrix products, torch.mm"
# By name of the row: module without which it is left out, class, and differences.
PEERS = {
    "Stable-Baselines3": ("stable_baselines3", Sb3Learner, "PPO.train; observations come normalised, advantages are by minibatch"),
    "rsl_rl": ("rsl_rl", RslLearner, "PPO.update; observations come normalised, one order for all epochs, clips two norms"),
}


def benchmark_learner(motions: str, rounds: int, after_round: Callable[[], None] = lambda: None) -> BenchmarkResult:
    """Return the rates of one update of ``configs/mixed.yaml``'s network on one rollout, ours and others'.

    Args:
        motions: Motion source that the rollout follows.
        rounds: Number of rounds to keep; a round takes about four seconds.
        after_round: Called after each round.
    """
    config = load_config(
        PpoConfig, CONFIG_DIR / "mixed.yaml", ["learner.target_kl=0", "collect.actors=0", "device=cpu"]
    )  # the same for all
    return measure_learner(config, load_motion_library(motions), rounds, after_round)


def measure_learner(
    config: PpoConfig, library: MotionLibrary, rounds: int, after_round: Callable[[], None] = lambda: None
) -> BenchmarkResult:
    """Return the rates for a config and a library."""
    threads = torch.get_num_threads()
    try:
        learner = PpoLearner(config)
        rollout, last_observations = collect_rollout(config, library, learner)
        torch.set_num_threads(config.learner.threads)  # of all
        products = {name: MatrixProducts(config, multiply) for name, multiply in _products().items()}
        peers, missing = _peers(config, learner, peer_data(learner, rollout, last_observations))
        cases = [_ours(learner, rollout), *_limits(products), *peers]
        rates = interleave(cases, rounds, after_round)
    finally:
        torch.set_num_threads(threads)
    per_sample = products[DEFAULT].flops / rollout.samples
    return BenchmarkResult(
        "learner",
        "samples/s",
        cases,
        rates,
        OURS,
        [peer.name for peer in peers],
        details={"gflops": {name: float(np.median(rate)) * per_sample / 1e9 for name, rate in rates.items()}},
        notes=[f"{name} is not installed and left out: pip install '.[benchmark]'" for name in missing],
    )


def _ours(learner: PpoLearner, rollout: Rollout) -> BenchmarkCase:
    begin = learner.get_state()

    def run() -> float:
        learner.update([rollout], 0.0)
        return float(rollout.samples)

    return BenchmarkCase(OURS, "PpoLearner.update, observations as collected", run, lambda: learner.set_state(begin), _chosen_products())


def _products() -> dict[str, Callable[[torch.Tensor, torch.Tensor], torch.Tensor]]:
    """Return the products that are compared, by name of the row."""
    return ({ONEDNN: onednn_linear} if HAS_ONEDNN else {}) | {DEFAULT: multiply_by_default}


def _chosen_products() -> str:
    """Return the name of the products that the policy's networks have chosen on this machine."""
    return ONEDNN if chosen_product() is onednn_linear else DEFAULT


def _limits(products: dict[str, MatrixProducts]) -> list[BenchmarkCase]:
    """Return the cases of the products alone."""
    notes = dict.fromkeys(products, "alone") | {_chosen_products(): "alone; ours multiplies so on this machine"}
    return [BenchmarkCase(name, notes[name], one.run) for name, one in products.items()]


def _peers(config: PpoConfig, learner: PpoLearner, data: PeerData) -> tuple[list[BenchmarkCase], list[str]]:
    """Return the cases of the peers that are installed, and the names of those that are not."""
    cases, missing = [], []
    for name, (module, build, what) in PEERS.items():
        if find_spec(module) is None:
            missing.append(name)
            continue
        peer = build(config, learner, data)
        cases.append(BenchmarkCase(name, what, peer.run, peer.prepare))
    return cases, missing


def collect_rollout(config: PpoConfig, library: MotionLibrary, learner: PpoLearner) -> tuple[Rollout, np.ndarray]:
    """Return a rollout of the learner's policy, and the observations (N, O) after it, which rollouts do not hold."""
    steps = config.collect.horizon
    longer = replace(config, collect=replace(config.collect, horizon=steps + 1))
    actor = CpuCollector(longer, 0, 0, library.clips, library.arrays(), library.fps, np.ones(len(library.clips)))
    found = actor.collect(learner.weights(), config.learner.action_std, 0.0)
    cut = found._replace(steps=Step(*(part[:steps] for part in found.steps)), next_values=found.next_values[:steps])
    return cut, found.steps.observations[steps]
