"""The learner's benchmark on a tiny network: that everybody does the same work, and what it writes."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from agents.policy.mlp import is_onednn_quicker
from configs.errors import InputError
from datasets.library.motion_library import MotionLibrary
from eval.benchmark import cli as benchmark
from eval.benchmark import learner as benchmark_learner
from eval.benchmark.learner import DEFAULT, ONEDNN, OURS, collect_rollout, measure_learner
from eval.benchmark.peers.matmul_limit import MatrixProducts, multiply_by_default
from eval.benchmark.peers.ppo_updates import RslLearner, Sb3Learner, peer_data
from tests.envs.states import swaying
from trainers.algorithms.ppo_config import CollectConfig, LearnerConfig, NetworkConfig, PpoConfig
from trainers.algorithms.ppo_learner import PpoLearner

PEERS = {"stable_baselines3": Sb3Learner, "rsl_rl": RslLearner}


@pytest.fixture(scope="module")
def library() -> MotionLibrary:
    return MotionLibrary.from_clips([swaying("sway", 60, 0.3), swaying("walk", 90, 0.5)])


@pytest.fixture
def tiny() -> PpoConfig:
    """Return a config with batches of 4 worlds by 10 steps."""
    return PpoConfig(
        network=NetworkConfig(hidden=(8,)),
        collect=CollectConfig(actors=0, envs=4, threads=1, horizon=10),
        learner=LearnerConfig(epochs=2, minibatch=20, learning_rate=1e-3, threads=1),
    )


def test_products_by_hand(tiny: PpoConfig) -> None:
    # 273 observed numbers, 8 hidden, 20 actions and one value. Forward: 273 * 8 + 8 * 20 = 2344 and 273 * 8 + 8 = 2192, 4536 in all;
    # as many for the weights' gradients; the hidden layers' gradients 8 * 20 + 8 = 168. 9240 multiplications a sample, as many additions,
    # 40 samples, 2 epochs: 1,478,400.
    done: list[int] = []

    def counting(rows: torch.Tensor, columns: torch.Tensor) -> torch.Tensor:
        out = multiply_by_default(rows, columns)
        done.append(out.numel() * rows.shape[1])
        return out

    # A minibatch has 2 + 2 products forward, and 2 + 2 and 1 + 1 back; 40 samples are 20 + 20, or 16 + 16 + 8.
    for minibatch, products in ((20, 2 * 2 * 10), (16, 2 * 3 * 10)):
        done.clear()
        bare = MatrixProducts(replace(tiny, learner=replace(tiny.learner, minibatch=minibatch)), counting)
        assert bare.flops == 1_478_400
        assert bare.run() == 40.0
        assert len(done) == products
        assert 2 * sum(done) == 1_478_400


@pytest.mark.parametrize("module", PEERS)
def test_a_peer_learns_the_same_from_one_minibatch(module: str, tiny: PpoConfig, library: MotionLibrary) -> None:
    # With the whole batch as one minibatch no order matters, and gradients are not clipped: three passes must end at the same weights.
    pytest.importorskip(module)
    tiny = replace(tiny, learner=replace(tiny.learner, epochs=3, minibatch=40, max_grad_norm=1e9))
    learner = PpoLearner(tiny)
    rollout, last_observations = collect_rollout(tiny, library, learner)
    peer = PEERS[module](tiny, learner, peer_data(learner, rollout, last_observations))
    before = learner.weights()
    learner.update([rollout], 0.0)
    for _ in range(2):  # the second time as the first
        peer.prepare()
        assert peer.run() == 40.0
        for ours, theirs in ((learner.policy.actor, peer.actor), (learner.policy.critic, peer.critic)):
            for parameter, other in zip(ours.parameters(), theirs.parameters(), strict=True):
                torch.testing.assert_close(parameter, other, rtol=0.0, atol=1e-6)
    moved = np.abs(learner.weights()["actor.0.weight"] - before["actor.0.weight"]).max()
    assert moved == pytest.approx(3e-3, rel=0.1)  # three steps of Adam at a rate of 1e-3


@pytest.mark.parametrize("module", PEERS)
def test_a_peer_makes_as_many_steps(module: str, tiny: PpoConfig, library: MotionLibrary) -> None:
    pytest.importorskip(module)
    learner = PpoLearner(tiny)
    peer = PEERS[module](tiny, learner, peer_data(learner, *collect_rollout(tiny, library, learner)))
    peer.prepare()
    peer.run()
    optimiser = peer.model.optimizer if isinstance(peer, RslLearner) else peer.model.policy.optimizer
    assert {float(state["step"]) for state in optimiser.state.values()} == {4.0}  # two epochs of two minibatches


@pytest.mark.usefixtures("three_threads")
def test_benchmark_writes_its_figures(
    tiny: PpoConfig, library: MotionLibrary, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def small(motions: str, rounds: int, after_round: benchmark.Callable[[], None]) -> benchmark.BenchmarkResult:
        assert motions == "synthetic"
        return measure_learner(tiny, library, rounds, after_round)

    for module in PEERS:
        pytest.importorskip(module)
    monkeypatch.setitem(benchmark.BENCHMARKS, "learner", small)
    threads = torch.get_num_threads()
    assert benchmark.main(["learner", "--rounds", "1", "--json", str(tmp_path / "learner.json")]) == 0
    assert torch.get_num_threads() == threads
    found = json.loads((tmp_path / "learner.json").read_text())
    assert (found["benchmark"], found["unit"], found["rounds"]) == ("learner", "samples/s", 1)
    assert found["ours"] == found["rows"][OURS]["rate"]
    assert found["limit"] == found["rows"][ONEDNN if is_onednn_quicker() else DEFAULT]["rate"]
    assert set(found["peers"]) == {"Stable-Baselines3", "rsl_rl"}
    # 1,478,400 operations for 40 samples are 36,960 a sample.
    assert found["gflops"][OURS] == pytest.approx(found["ours"] * 36_960 / 1e9)
    assert "samples/s" in capsys.readouterr().out


def test_peers_that_are_not_installed_are_left_out_and_said(
    tiny: PpoConfig, library: MotionLibrary, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(benchmark_learner, "find_spec", lambda _: None)
    speed = measure_learner(tiny, library, 1)
    assert not speed.peers
    assert [note for note in speed.notes if "rsl_rl is not installed" in str(note)]


def test_a_motion_source_that_is_not_there() -> None:
    with pytest.raises(InputError, match="no such file or folder"):
        benchmark_learner.benchmark_learner("/nowhere", 1)
