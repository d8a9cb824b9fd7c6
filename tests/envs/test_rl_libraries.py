"""The examples of docs/rl_libraries.md, as they stand but for fewer steps; a library that is not installed is skipped."""

import re
from typing import Any

import pytest
import torch

from configs.source_code import PROJECT_ROOT

PAGE = PROJECT_ROOT / "docs" / "rl_libraries.md"


def run_example(library: str, steps: int) -> dict[str, Any]:
    """Run the example under a heading of the page for about so many steps; return its variables."""
    section = PAGE.read_text(encoding="utf-8").split(f"\n## {library}\n")[1].split("\n## ")[0]
    (code,) = re.findall(r"```python\n(.*?)```", section, flags=re.DOTALL)
    assert "200_000" in code
    variables: dict[str, Any] = {}
    exec(compile(code.replace("200_000", str(steps)), f"{PAGE.name}, {library}", "exec"), variables)
    return variables


def assert_learnt(parameters: Any) -> None:
    assert all(bool(parameter.isfinite().all()) for parameter in parameters)


def test_stable_baselines3() -> None:
    pytest.importorskip("stable_baselines3", reason="needs Stable-Baselines3: pip install stable-baselines3")
    model = run_example("Stable-Baselines3", 1024)["model"]
    assert model.num_timesteps == 1024
    assert_learnt(model.policy.parameters())


def test_a_single_file_as_cleanrls() -> None:
    found = run_example("CleanRL", 64 * 32 * 2)
    assert_learnt(found["parameters"])
    assert float(found["log_std"].detach().std()) > 0.0  # they began alike


@pytest.mark.filterwarnings("ignore")  # Ray warns of itself
def test_rllib() -> None:
    pytest.importorskip("ray.rllib", reason="needs RLlib: pip install 'ray[rllib]'")
    result = run_example("RLlib", 4000)["result"]
    assert result["num_env_steps_sampled_lifetime"] >= 4096


@pytest.mark.filterwarnings("ignore")  # TorchRL warns of itself
def test_torchrl() -> None:
    pytest.importorskip("torchrl", reason="needs TorchRL: pip install torchrl")
    assert_learnt(run_example("TorchRL", 2048)["loss"].parameters())


def test_rsl_rl() -> None:
    pytest.importorskip("rsl_rl", reason="needs rsl_rl: pip install rsl-rl-lib")
    torch.manual_seed(0)
    env = run_example("rsl_rl", 64 * 32 * 2)["env"]
    assert env.get_observations()["policy"].shape == (64, 273)
