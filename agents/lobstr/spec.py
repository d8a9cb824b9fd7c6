"""Which LoBSTr network: how it remembers what it saw, and what it is shown."""

from dataclasses import dataclass

from configs.errors import require
from datasets.trackers.features import FEATURE_SIZES

WINDOW_FRAMES = 45  # frames that a prediction looks back on, a second
RECURRENT = ("gru", "lstm", "rnn")
ENCODERS = (*RECURRENT, "fc", "cnn")


@dataclass(frozen=True)
class LobstrSpec:
    """Which network.

    Attributes:
        encoder: "gru" is the paper's own; "lstm", "rnn", "fc" and "cnn" are what it is compared with (section 4.1.1).
        inputs: "velocity", "pose" or "combined" (section 4.1.3).
        hidden: Size of the encoder's state.
        latent: Size of the latent vector.
        autoregressive: Whether the pose before is an input as well (section 4.1.1).
        upright: Whether thighs are predicted against the upright reference frame and not against the pelvis (beyond the paper): how a
            pelvis is tilted differs by 30 degrees between performers and recordings, and the network does not see it.
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
        """Numbers that are seen of a frame."""
        return FEATURE_SIZES[self.inputs]
