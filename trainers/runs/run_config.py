"""Settings that the configs of all trainings share."""

from dataclasses import dataclass

from configs.errors import require


@dataclass(frozen=True, kw_only=True)
class RunConfig:
    """Folder, length and seed of a run.

    Attributes:
        name: Name of the run's folder under ``runs_dir``.
        runs_dir: Folder of all runs.
        samples: Number of samples after which training ends.
        minutes: Wall-clock limit after which training ends [min]; 0 is none.
        evaluate_every: Iterations between evaluations on the held-out performer.
        checkpoint_every: Iterations between checkpoints.
        seed: Seed of the networks and of everything drawn while they train.
    """

    name: str
    runs_dir: str = "runs"
    samples: int
    minutes: float = 0.0
    evaluate_every: int
    checkpoint_every: int
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ("samples", "evaluate_every", "checkpoint_every"):
            require(getattr(self, name) >= 1, name, getattr(self, name), "1 or more")
        require(self.minutes >= 0.0, "minutes", self.minutes, "0 (no limit) or more")
        require(bool(self.name) and "/" not in self.name, "name", repr(self.name), "a folder's name")
