"""Devices on which mujoco-warp is tested: its CPU device, and a GPU if there is one."""

import pytest
import torch

DEVICES = pytest.mark.parametrize(
    "device",
    [
        torch.device("cpu"),
        pytest.param(
            torch.device("cuda"),
            marks=[pytest.mark.gpu, pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no GPU")],
        ),
    ],
    ids=str,
)


def assert_same(one: torch.Tensor, other: torch.Tensor) -> None:
    """Check that numbers are the same: to the bit on a processor; a GPU adds them up in another order each time."""
    if one.device.type == "cpu" or not one.dtype.is_floating_point:
        assert torch.equal(one, other)
    else:
        torch.testing.assert_close(one, other, atol=1e-3, rtol=1e-3)
