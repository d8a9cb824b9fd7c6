"""Root models for one window at a time; Root3D's network runs in NumPy, since PyTorch's overhead dominates such short calls."""

from collections.abc import Callable
from copy import deepcopy
from math import prod

import numpy as np
import torch
from torch import nn

from agents.root.model import RootModel, decode_paths
from agents.root.networks.root3d_unet import CHANNELS, WINDOW_FRAMES, Root3dUnet
from agents.root.networks.temporal_unet import ConvolutionPair

Affine = tuple[np.ndarray, np.ndarray]  # matrix and offset
Predictor = Callable[[np.ndarray], np.ndarray]


def make_window_predictor(model: RootModel) -> Predictor:
    """Return ``RootModel.forward`` for one window: from raw features (W, F) to the path (W, 3) [m].

    Args:
        model: Root model; the current weights of a Root3D network are copied.
    """
    if not isinstance(model.network, Root3dUnet):
        return lambda features: model(torch.from_numpy(features)[None])[0].numpy()
    network = as_numpy_function(model.network)
    parts = (model.feature_mean, model.feature_std, model.target_mean, model.target_std)
    mean, std, target_mean, target_std = (part.cpu().numpy().copy() for part in parts)

    def predict(features: np.ndarray) -> np.ndarray:
        output = network((features - mean) / std)
        return decode_paths(model.spec, features[None], output[None], target_mean, target_std)[0]

    return predict


def as_numpy_function(network: Root3dUnet) -> Predictor:
    """Return a function from a window of normalised features (8, F) to outputs (8, outputs), in single precision.

    A convolution over a few frames is written as one matrix from all its inputs to all its outputs.

    Args:
        network: Network, whose current weights are copied.
    """
    network = deepcopy(network).double().cpu()
    unet, frames = network.unet, [WINDOW_FRAMES >> scale for scale in range(len(network.unet.encoder))]
    first, second = _affine(network.first, network.first.in_features), _affine(network.second, network.second.in_features)
    encoder = [_pair(pair, count) for pair, count in zip(unet.encoder, frames, strict=True)]
    decoder = [_pair(pair, count) for pair, count in zip(unet.decoder, frames[:-1], strict=True)]
    double = nn.Upsample(scale_factor=2.0, mode="linear")
    doubled = [_affine(double, CHANNELS, count)[0] for count in frames[1:]]
    head, bias = _affine(unet.head, CHANNELS, WINDOW_FRAMES)

    def predict(window: np.ndarray) -> np.ndarray:
        x = _apply((first, second), window.ravel())
        skipped = []
        for scale, pair in enumerate(encoder):
            x = _apply(pair, x if scale == 0 else np.maximum(x[::2], x[1::2]))
            skipped.append(x)
        for pair, up, skip in zip(reversed(decoder), reversed(doubled), reversed(skipped[:-1]), strict=True):
            x = _apply(pair, np.concat([skip, up @ x]))
        return (head @ x + bias).reshape(-1, WINDOW_FRAMES).T

    return predict


def _pair(pair: nn.Module, frames: int) -> tuple[Affine, Affine]:
    """Return the matrices and offsets of two consecutive convolutions over ``frames`` frames."""
    assert isinstance(pair, ConvolutionPair)
    return _affine(pair.first, pair.first.in_channels, frames), _affine(pair.second, pair.second.in_channels, frames)


def _affine(layer: nn.Module, *shape: int) -> Affine:
    """Return the matrix and offset of an affine layer on flattened inputs of ``shape``, from its outputs for zero and unit vectors."""
    basis = torch.eye(prod(shape), dtype=torch.float64).view(-1, *shape)
    with torch.no_grad():
        zero = layer(torch.zeros_like(basis[:1]))
        columns = (layer(basis) - zero).flatten(1)
    return np.ascontiguousarray(columns.numpy().T, dtype=np.float32), zero.flatten().numpy().astype(np.float32)


def _apply(layers: tuple[Affine, Affine], x: np.ndarray) -> np.ndarray:
    """Return the output of two layers with ReLU for the input ``x``."""
    for matrix, offset in layers:
        x = np.maximum(matrix @ x + offset, 0.0)
    return x
