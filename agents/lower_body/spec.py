"""Specification of a network that predicts a lower body from trackers."""

from dataclasses import dataclass

from configs.errors import require


@dataclass(frozen=True)
class LowerBodySpec:
    """Sizes of the network.

    Attributes:
        hidden: Size of each recurrent layer.
        layers: Number of recurrent layers.
        dropout: Share of each layer's outputs that is left out while training.
    """

    hidden: int = 320
    layers: int = 2
    dropout: float = 0.1

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ("hidden", "layers"):
            require(getattr(self, name) >= 1, f"model.{name}", getattr(self, name), "1 or more")
        require(0.0 <= self.dropout < 1.0, "model.dropout", self.dropout, "from 0 to below 1")
