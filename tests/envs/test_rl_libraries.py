"""The examples of docs/rl_libraries.md, as they stand but for fewer steps; a library that is not installed is skipped."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from envs.vector_env import AdaptMimicVectorEnv
from eval.benchmark.peers.library_trainings import LIBRARIES, PAGE, missing_libraries, read_example


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep what libraries write out of the checkout."""
    monkeypatch.chdir(tmp_path)


def run_example(library: str, steps: int) -> dict[str, Any]:
    """Run the example under a heading of the page for about so many steps; return its variables."""
    if library in missing_libraries():
        pytest.skip(f"needs {library}: pip install {LIBRARIES[library][1]}")
    variables: dict[str, Any] = {}
    exec(compile(read_example(library, steps), f"{PAGE.name}, {library}", "exec"), variables)
    return variables


def assert_learnt(parameters: Any) -> None:
    assert all(bool(parameter.isfinite().all()) for parameter in parameters)


def test_stable_baselines3() -> None:
    model = run_example("Stable-Baselines3", 1024)["model"]
    assert model.num_timesteps == 1024
    assert_learnt(model.policy.parameters())


def test_a_single_file_as_cleanrls() -> None:
    found = run_example("CleanRL", 64 * 32 * 2)
    assert_learnt(found["parameters"])
    assert float(found["log_std"].detach().std()) > 0.0  # they began alike


@pytest.mark.filterwarnings("ignore")  # Ray warns of itself
def test_rllib() -> None:
    result = run_example("RLlib", 4000)["result"]
    assert result["num_env_steps_sampled_lifetime"] >= 4096


@pytest.mark.filterwarnings("ignore")  # TorchRL warns of itself
def test_torchrl() -> None:
    assert_learnt(run_example("TorchRL", 2048)["loss"].parameters())


def test_rsl_rl() -> None:
    torch.manual_seed(0)
    env = run_example("rsl_rl", 64 * 32 * 2)["env"]
    assert env.get_observations()["policy"].shape == (64, 273)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # Ray and TorchRL warn of themselves
@pytest.mark.parametrize("library", LIBRARIES)
def test_the_return_rises(library: str, monkeypatch: pytest.MonkeyPatch) -> None:
    ended_at: list[int] = []  # control steps of all worlds
    returns: list[float] = []
    steps = 0
    running: dict[AdaptMimicVectorEnv, np.ndarray] = {}
    step = AdaptMimicVectorEnv.step

    def recorded(env: AdaptMimicVectorEnv, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        nonlocal steps
        result = step(env, actions)
        steps += env.num_envs
        sums = running.setdefault(env, np.zeros(env.num_envs))
        sums += result[1]
        ended = result[2] | result[3]
        returns.extend(sums[ended])
        ended_at.extend(int(ended.sum()) * [steps])
        sums[ended] = 0.0
        return result

    monkeypatch.setattr(AdaptMimicVectorEnv, "step", recorded)
    torch.manual_seed(0)
    run_example(library, 200_000)
    tenth = np.array(ended_at) * 10 // (steps + 1)
    first, last = (float(np.mean(np.array(returns)[tenth == part])) for part in (0, 9))
    print(f"{library}: mean return of the episodes that end in the first tenth of {steps} steps {first:.0f}, in the last {last:.0f}")
    assert last > 1.2 * first
