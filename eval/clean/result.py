"""What a cleaning left: the clip before and after on the 20 bodies, and what the simulation knows of each frame."""

from dataclasses import dataclass

import numpy as np

from datasets.motion.clip import BodyMotion


@dataclass(frozen=True)
class CleaningResult:
    """A clip before and after; T frames at 60 fps, the same of both.

    Attributes:
        name: Of the clip, for people.
        before: The input, floor-calibrated, with its root.
        after: The output through the same retargeting and calibration.
        contacts: Whether the left and the right foot stand, shape (T, 2): where confidence is at least 0.5, whether each carried 0.05 of
            body weight in the simulation; elsewhere, as they look.
        confidence: In the output, 0 to 1; 0 where the input was kept because physics gave up, shape (T,).
        kept: Which frames keep the input, shape (T,).
        restarts: When the agent began again [s].
        notices: What a person should know.
        truth: The clean clip behind a simulated suit, where it is known.
    """

    name: str
    before: BodyMotion
    after: BodyMotion
    contacts: np.ndarray
    confidence: np.ndarray
    kept: np.ndarray
    restarts: tuple[float, ...]
    notices: tuple[str, ...]
    truth: BodyMotion | None = None

    def __post_init__(self) -> None:
        """Check that everything is of the same frames."""
        shapes = {"contacts": (len(self.before), 2), "confidence": (len(self.before),), "kept": (len(self.before),)}
        for field, shape in shapes.items():
            if getattr(self, field).shape != shape:
                raise ValueError(f"{self.name}: {field} has shape {getattr(self, field).shape}, should be {shape}")
        frames, fps = len(self.before), self.before.fps
        for other in (self.after, *([self.truth] if self.truth else [])):
            if (len(other), other.fps) != (frames, fps):
                raise ValueError(f"{self.name}: {frames} frames at {fps:g} fps before, {len(other)} at {other.fps:g} in {other.name}")
