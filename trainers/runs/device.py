"""Device on which networks learn: its resolution from a config, its precision and its name."""

import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import torch

from configs.errors import InputError


def resolve_device(name: str) -> torch.device:
    """Return the device of a config's "cpu", "cuda", or "auto", the GPU where there is one.

    Raises:
        InputError: If there is no GPU, but one is asked for.
    """
    there = torch.cuda.is_available()
    if name == "cuda" and not there:
        raise InputError("device is 'cuda', but torch finds no GPU here; should be cpu, or auto, which takes what there is")
    return torch.device("cuda" if there and name != "cpu" else "cpu")


@contextmanager
def allow_tf32(device: torch.device) -> Iterator[None]:
    """Multiply matrices on a GPU's tensor cores, several times as quick, with 10 bits of each factor: for networks, nothing else."""
    if device.type != "cuda":
        yield
        return
    torch.set_float32_matmul_precision("high")
    try:
        yield
    finally:
        torch.set_float32_matmul_precision("highest")


def device_name(device: torch.device) -> str:
    """Return the card's name, or the processor's with its cores."""
    if device.type == "cuda":
        return torch.cuda.get_device_name(device)
    return f"{_processor()}, {os.cpu_count()} cores"


def _processor() -> str:
    """Return the processor's name where the system tells it, as Linux does."""
    with suppress(OSError, StopIteration):
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line for line in lines if line.startswith("model name")).partition(": ")[2]
    return platform.processor() or platform.machine()
