"""How much of a device's memory is taken, and waiting until it has done all that it was told."""

import ctypes
import gc
import os
import sys
from contextlib import suppress

import torch

from eval.benchmark.timing.process_tree import tree_memory_bytes


def synchronize(device: torch.device) -> None:
    """Wait until the device is done: a GPU is told what to do long before it does it."""
    if device.type == "cuda":
        torch.cuda.synchronize(device)


def used_memory_bytes(device: torch.device) -> int:
    """Return how much memory is taken [bytes]: of a card, by torch, by warp and by whoever else uses it; on the CPU by this process."""
    if device.type == "cuda":
        synchronize(device)
        free, total = torch.cuda.mem_get_info(device)
        return total - free
    return tree_memory_bytes(os.getpid())


def release_unused_memory(device: torch.device) -> None:
    """Give back what nobody holds any longer, so that it does not hide what comes next."""
    gc.collect()  # physics and its recordings hold each other
    if device.type == "cuda":
        torch.cuda.empty_cache()
    elif sys.platform == "linux":
        with suppress(AttributeError):  # not every C library keeps what is freed, as glibc does
            ctypes.CDLL(None).malloc_trim(0)
