"""Specification of a LoBSTr network: encoder, inputs and sizes."""

from dataclasses import dataclass

from configs.errors import require
from datasets.trackers.features import FEATURE_SIZES

WINDOW_FRAMES = 45  # frames that a prediction depends on: a second
RECURRENT = ("gru", "lstm", "rnn")
ENCODERS = (*RECURRENT, "fc", "cnn")


@dataclass(frozen=True)
class LobstrSpec:
    """One variant of the network; sections are the paper's.

    Attributes:
        encoder: "gru", the paper's own, or "lstm", "rnn", "fc" or "cnn", which it is compared with (section 4.1.1).
        inputs: Input features: "velocity", "pose" or "combined" (section 4.1.3).
        hidden: Size of the encoder's state.
        latent: Size of the latent vector.
        autoregressive: Whether the previous pose is an input as well (section 4.1.1).
        upright: Whether thighs are predicted relative to the upright reference frame instead of the pelvis (not in the paper): the
            tilt of the pelvis differs by 30 degrees between performers and recordings, and the network does not see it.
    """

    encoder: str = "gru"
    inputs: str = "velocity"
    hidden: int = 1024
    latent: int = 128
    autoregressive: bool = False
    upright: bool = False

    def __post_init__(self) -> None:
        """Check the values."""
        require(self.encoder in ENCODERS, "model.encoder", f"'{self.encoder}'", f"one of {', '.join(ENCODERS)}")
        require(self.inputs in FEATURE_SIZES, "model.inputs", f"'{self.inputs}'", f"one of {', '.join(FEATURE_SIZES)}")
        for name in ("hidden", "latent"):
            require(getattr(self, name) >= 1, f"model.{name}", getattr(self, name), "1 or more")
        require(not self.autoregressive or self.encoder in RECURRENT, "model.autoregressive", "true", "false without a recurrent encoder")

    @property
    def features(self) -> int:
        """Number of features of a frame."""
        return FEATURE_SIZES[self.inputs]
