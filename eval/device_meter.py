"""What a device is called, how much of its memory is taken, and waiting until it has done all that it was told."""

import ctypes
import gc
import os
import platform
import sys
from contextlib import suppress
from pathlib import Path

import torch

from eval.process_family import memory_of


def name_of(device: torch.device) -> str:
    """Return the card's name, or the processor's with its cores."""
    if device.type == "cuda":
        return torch.cuda.get_device_name(device)
    return f"{_processor()}, {os.cpu_count()} cores"


def finish(device: torch.device) -> None:
    """Wait until the device is done: a GPU is told what to do long before it does it."""
    if device.type == "cuda":
        torch.cuda.synchronize(device)


def taken(device: torch.device) -> int:
    """Return how much memory is taken [bytes]: of a card, by torch, by warp and by whoever else uses it; on the CPU by this process."""
    if device.type == "cuda":
        finish(device)
        free, total = torch.cuda.mem_get_info(device)
        return total - free
    return memory_of(os.getpid())


def release(device: torch.device) -> None:
    """Give back what nobody holds any longer, so that it does not hide what comes next."""
    gc.collect()  # physics and its recordings hold each other
    if device.type == "cuda":
        torch.cuda.empty_cache()
    elif sys.platform == "linux":
        with suppress(AttributeError):  # not every C library keeps what is freed, as glibc does
            ctypes.CDLL(None).malloc_trim(0)


def _processor() -> str:
    """Return the processor's name where the system tells it, as Linux does."""
    with suppress(OSError, StopIteration):
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line for line in lines if line.startswith("model name")).partition(": ")[2]
    return platform.processor() or platform.machine()
