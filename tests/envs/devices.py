"""Where mujoco-warp can be tested: on its CPU device, and on a GPU where there is one."""

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
