"""Device of a config, its name and its precision."""

from pathlib import Path

import pytest
import torch

from configs.errors import InputError
from trainers.runs import device
from trainers.runs.device import allow_tf32, device_name, resolve_device

CPU, CUDA = torch.device("cpu"), torch.device("cuda")


def test_what_there_is_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert [resolve_device(name).type for name in ("auto", "cuda", "cpu")] == ["cuda", "cuda", "cpu"]
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert [resolve_device(name).type for name in ("auto", "cpu")] == ["cpu", "cpu"]


def test_a_gpu_that_is_not_there_is_one_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(InputError, match="device is 'cuda', but torch finds no GPU here; should be cpu, or auto"):
        resolve_device("cuda")


def test_tensor_cores_multiply_for_networks_alone() -> None:
    assert torch.get_float32_matmul_precision() == "highest"
    with allow_tf32(CPU):
        assert torch.get_float32_matmul_precision() == "highest"
    with allow_tf32(CUDA):
        assert torch.get_float32_matmul_precision() == "high"
    assert torch.get_float32_matmul_precision() == "highest"
    with pytest.raises(ZeroDivisionError), allow_tf32(CUDA):
        raise ZeroDivisionError
    assert torch.get_float32_matmul_precision() == "highest"


def test_a_card_tells_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.cuda, "get_device_name", lambda of: {CUDA: "a card"}[of])
    assert device_name(CUDA) == "a card"


def test_a_processor_without_a_name_has_its_architecture(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device, "Path", lambda _: Path("/nowhere/cpuinfo"))
    monkeypatch.setattr(device.platform, "processor", lambda: "")
    monkeypatch.setattr(device.platform, "machine", lambda: "riscv64")
    monkeypatch.setattr(device.os, "cpu_count", lambda: 3)
    assert device_name(CPU) == "riscv64, 3 cores"
