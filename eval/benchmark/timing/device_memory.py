"""Memory use of a device, and synchronisation with it."""

import ctypes
import gc
import os
import sys
from contextlib import suppress

import torch

from eval.benchmark.timing.process_tree import tree_memory_bytes


def synchronize(device: torch.device) -> None:
    """Wait until the device is done: a GPU works asynchronously."""
    if device.type == "cuda":
        torch.cuda.synchronize(device)


def used_memory_bytes(device: torch.device) -> int:
    """Return the used memory [bytes]: on a GPU by torch, warp and all other processes, on the CPU by this process."""
    if device.type == "cuda":
        synchronize(device)
        free, total = torch.cuda.mem_get_info(device)
        return total - free
    return tree_memory_bytes(os.getpid())


def release_unused_memory(device: torch.device) -> None:
    """Return unused memory to the system, so that it does not hide later allocations."""
    gc.collect()  # physics and its recordings refer to each other
    if device.type == "cuda":
        torch.cuda.empty_cache()
    elif sys.platform == "linux":
        with suppress(AttributeError):  # C libraries other than glibc
            ctypes.CDLL(None).malloc_trim(0)
