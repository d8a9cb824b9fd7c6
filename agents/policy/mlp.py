"""Multilayer perceptron that multiplies by oneDNN on CPUs with AVX-512, and by PyTorch's default, MKL, on others.

On two AMD processors with AVX-512 oneDNN's products are twice as fast as MKL's, and as fast; on one with AVX2 alone MKL's are a fifth
faster. The choice is not measured: processes of one training have to choose alike, for the rounding of the two differs.
"""

from functools import cache
from itertools import zip_longest
from typing import Any

import torch
from torch import nn
from torch.autograd.function import once_differentiable

# oneDNN's product of float32 matrices is private, made for PyTorch's compiler; builds without oneDNN lack it.
HAS_ONEDNN = torch.backends.mkldnn.is_available() and hasattr(torch.ops.mkldnn, "_linear_pointwise")


@cache
def is_onednn_quicker() -> bool:
    """Return whether oneDNN multiplies quicker here than PyTorch's default, by what the processor can do."""
    return HAS_ONEDNN and torch.backends.cpu.get_cpu_capability() == "AVX512"


class MLP(nn.Sequential):
    """Linear layers with an activation after each but the last; equals ``nn.Sequential`` except for rounding."""

    def forward(self, input: torch.Tensor) -> torch.Tensor:
        """Return the outputs (..., last size) for inputs (..., first size)."""
        if input.device.type != "cpu" or input.dtype != torch.float32 or not is_onednn_quicker():
            return super().forward(input)
        rows = input.reshape(-1, input.shape[-1])
        apply = _Layer.apply if torch.is_grad_enabled() else onednn_linear
        layers = list(self.children())
        for linear, activation in zip_longest(layers[::2], layers[1::2]):
            assert isinstance(linear, nn.Linear)
            tanh = isinstance(activation, nn.Tanh)
            rows = apply(rows, linear.weight, linear.bias, tanh)
            if activation and not tanh:
                rows = activation(rows)
        return rows.reshape(*input.shape[:-1], rows.shape[-1])


class _Layer(torch.autograd.Function):
    """Linear layer of rows (M, I) with weights (O, I) and biases (O,), and optionally tanh in the same pass."""

    @staticmethod
    def forward(ctx: Any, rows: torch.Tensor, weight: torch.Tensor, bias: torch.Tensor, tanh: bool) -> torch.Tensor:
        out = onednn_linear(rows, weight, bias, tanh)
        ctx.save_for_backward(rows, weight, out)
        ctx.tanh = tanh
        return out

    @staticmethod
    @once_differentiable
    def backward(  # type: ignore[override]
        ctx: Any, grad: torch.Tensor
    ) -> tuple[torch.Tensor | None, torch.Tensor, torch.Tensor, None]:
        rows, weight, out = ctx.saved_tensors
        if ctx.tanh:
            grad = torch.ops.aten.tanh_backward(grad, out)
        for_rows = onednn_linear(grad, weight.t()) if ctx.needs_input_grad[0] else None
        return for_rows, onednn_linear(grad.t(), rows.t()), grad.sum(dim=0), None


def onednn_linear(rows: torch.Tensor, columns: torch.Tensor, bias: torch.Tensor | None = None, tanh: bool = False) -> torch.Tensor:
    """Return ``rows @ columns.T + bias`` (M, O) of rows (M, I) and columns (O, I), or the tanh of that."""
    return torch.ops.mkldnn._linear_pointwise(rows, columns, bias, "tanh" if tanh else "none", [], "")
