"""Comparison of mujoco-warp with MuJoCo: ``python -m eval.backends [--device cuda]``; docs/gpu.md lists known differences."""

import argparse
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from agents.weights.pretrained import PRETRAINED_POLICY
from configs.exit_codes import run_command
from datasets.library.sources import SYNTHETIC_SOURCE
from envs.gym_env import load_motion_library
from envs.physics.mujoco_warp import import_warp
from eval.backends.episodes import COMPARED_METRICS, STEPS, EpisodePairs, episode_pairs
from eval.backends.steps import CAUSES, StepDifferences, step_differences
from trainers.algorithms.policy_file import load_policy
from trainers.evaluation.evaluation_protocol import zero_residual
from trainers.runs.device import resolve_device


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m eval.backends", description="Compare the CPU's physics with the GPU's.")
    parser.add_argument("--device", default="auto", choices=("auto", "cpu", "cuda"), help="device of mujoco-warp (default: the GPU if any)")
    parser.add_argument("--motions", default=SYNTHETIC_SOURCE, metavar="PATH", help="motion source (default: synthetic)")
    parser.add_argument("--policy", type=Path, default=PRETRAINED_POLICY, metavar="FILE", help="whose episodes (default: the shipped one)")
    parser.add_argument("--worlds", type=int, default=64, help="worlds simulated at once (default: 64)")
    parser.add_argument("--steps", type=int, default=40, help="single steps compared in each world (default: 40)")
    options = parser.parse_args(arguments)
    return run_command(lambda: _run(options))


def _run(options: argparse.Namespace) -> None:
    device, console = resolve_device(options.device), Console()
    import_warp(device)
    policy, _, spec = load_policy(options.policy)
    library = load_motion_library(options.motions)
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task(f"stepping on {device}", total=options.steps + 4 * STEPS)
        steps = step_differences(library, spec, options.worlds, options.steps, device, lambda: progress.advance(task))
        acts = {"the policy": policy.act, "the zero residual": zero_residual(spec)}
        played = {
            name: episode_pairs(act, library, spec, options.worlds, device, lambda: progress.advance(task)) for name, act in acts.items()
        }
    legend = (f"{kind}: {why}" for kind, why in CAUSES.items())
    console.print(steps_table(steps, str(device)), *legend, episodes_table(played, str(device)), sep="\n")


def steps_table(found: StepDifferences, device: str) -> Table:
    """Return the table of the differences of single steps, by cause."""
    table = Table(title=f"one control step from the same states: mujoco-warp on {device} less MuJoCo")
    for column in ("kind", "share", "observation: median", "99 %", "largest", "reward: 99 %", "largest", "ends differ"):
        table.add_column(column, justify="left" if column == "kind" else "right")
    for kind in CAUSES:
        one = found.of(kind)
        if len(one.reward):
            middle, late = np.percentile(one.observation, [50, 99])
            rewards = (np.percentile(one.reward, 99), one.reward.max())
            sizes = (f"{value:.1e}" for value in (middle, late, one.observation.max(), *rewards))
            table.add_row(kind, f"{len(one.reward) / len(found.reward):.1%}", *sizes, str(int(one.ended.sum())))
    return table


def episodes_table(played: dict[str, EpisodePairs], device: str) -> Table:
    """Return the table of the mean metrics of whole episodes by policy, and of their differences."""
    table = Table(title="episodes from the same starts", caption="mean difference and its standard error")
    for column in ("who", "metric", "MuJoCo", f"mujoco-warp on {device}", "difference", "error"):
        table.add_column(column, justify="left" if column in ("who", "metric") else "right")
    for who, pairs in played.items():
        for name in COMPARED_METRICS:
            difference, error = pairs.difference(name)
            means = (f"{metrics[name].mean():.3f}" for metrics in pairs)
            table.add_row(who, name, *means, f"{difference:+.3f}", f"{error:.3f}")
    return table
