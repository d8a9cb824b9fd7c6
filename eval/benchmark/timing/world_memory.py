"""Memory of the torch env, by number of worlds."""

from collections.abc import Mapping, Sequence

import numpy as np
import torch
from rich.table import Table

from datasets.library.motion_library import MotionLibrary
from envs.torch_env import AdaptMimicTorchEnv
from eval.benchmark.timing.device_memory import release_unused_memory, used_memory_bytes

SEED = 0
MIB, KIB = 2**20, 2**10


def build_envs_and_measure_memory(
    library: MotionLibrary, counts: Sequence[int], device: torch.device
) -> tuple[list[AdaptMimicTorchEnv], dict[int, float]]:
    """Return envs with the given numbers of worlds, and the memory of each by its worlds [MiB]."""
    _stepped_env(library, 1, device)  # what is loaded once does not count for any world
    envs, memory = [], {}
    for worlds in counts:
        release_unused_memory(device)
        before = used_memory_bytes(device)
        envs.append(_stepped_env(library, worlds, device))
        memory[worlds] = (used_memory_bytes(device) - before) / MIB
    return envs, memory


def memory_table(memory: Mapping[int, float]) -> Table:
    """Return a table of the envs' memory.

    Args:
        memory: Memory of an env by its number of worlds [MiB], ascending.
    """
    table = Table(title="memory of a torch env", caption="MiB: with its copy of the motions\nKiB a world: of those more than above")
    for column in ("worlds", "MiB", "KiB a world"):
        table.add_column(column, justify="right", min_width=12)
    each = ["", *(f"{size:,.0f}" for size in memory_per_world_kib(memory))]
    for (worlds, size), of_world in zip(memory.items(), each, strict=True):
        table.add_row(f"{worlds:,}", f"{size:,.1f}", of_world)
    return table


def memory_per_world_kib(memory: Mapping[int, float]) -> list[float]:
    """Return the memory of one more world from each size to the next [KiB]; the argument is that of ``memory_table``."""
    worlds, sizes = np.array(list(memory)), np.array(list(memory.values()))
    return (np.diff(sizes) * (MIB / KIB) / np.diff(worlds)).tolist()


def _stepped_env(library: MotionLibrary, worlds: int, device: torch.device) -> AdaptMimicTorchEnv:
    """Return an env that has taken a step, and thereby allocated what steps need."""
    env = AdaptMimicTorchEnv(library, worlds, device=device)
    env.reset(seed=SEED)
    env.step(torch.zeros((worlds, env.task.action_size), device=device))
    return env
