"""Configuration of the training of a root model; files in ``configs/`` change the defaults."""

from dataclasses import dataclass, field

from agents.root.spec import RootSpec
from configs.errors import require
from configs.load import formerly
from trainers.data.motion_config import SourceConfig
from trainers.runs.run_config import RunConfig


@dataclass(frozen=True, kw_only=True)
class RootDataConfig(SourceConfig):
    """Motion that a root model learns from.

    Attributes:
        kinds: Kinds of motion that are kept; all if empty.
        rough_ground: Whether stairs are kept.
        pose_source: Source of the poses: "optical" as recorded, "imu" as a simulated suit has them, or "both"; accelerations are the
            suit's in any case.
        restored_share: Share of the simulated suits' recordings whose poses the package's network restores, as cleaning does first of all.
        rough_motions: Further motion source, of real stairs; none if empty.
        suit_takes: Number of simulated suit recordings of each clip.
        tempo: Largest factor by which all takes but the first are slower or quicker.
        suit_severity: Severity of the suits' faults: 0 none, 1 as in the literature.
        test_performers: Performers of the source who are left out of everything, for tests.
    """

    synthetic_sets: int = formerly("synthetic", 4)
    kinds: tuple[str, ...] = ()
    rough_ground: bool = True
    pose_source: str = formerly("poses", "both")
    restored_share: float = 0.0
    rough_motions: str = ""
    suit_takes: int = formerly("takes", 4)
    tempo: float = 1.5
    suit_severity: float = 1.0
    test_performers: tuple[str, ...] = formerly("test", ())

    def __post_init__(self) -> None:
        """Check the values; OmegaConf passes lists instead of tuples."""
        super().__post_init__()
        object.__setattr__(self, "kinds", tuple(self.kinds))
        object.__setattr__(self, "test_performers", tuple(self.test_performers))
        require(self.pose_source in ("optical", "imu", "both"), "data.pose_source", f"'{self.pose_source}'", "optical, imu or both")
        require(0.0 <= self.restored_share <= 1.0, "data.restored_share", self.restored_share, "from 0 to 1")
        require(self.suit_takes >= 1, "data.suit_takes", self.suit_takes, "1 or more")
        require(self.tempo >= 1.0, "data.tempo", self.tempo, "1 or more")
        require(self.suit_severity >= 0.0, "data.suit_severity", self.suit_severity, "0 or more")


@dataclass(frozen=True)
class RootLearnerConfig:
    """Settings of a root model's updates.

    Attributes:
        loss: Loss of predictions in units of their standard deviation, "l1" or "mse"; the recurrent model has one of its own.
        batch: Number of windows in a batch.
        learning_rate: Adam's learning rate at the start.
        final_learning_rate: Adam's learning rate at the end; linear in between.
        weight_decay: Adam's weight decay.
        mask_share: Share of the joints and sensors that each window hides; legs and pelvis are never hidden.
        sequence: Number of consecutive windows in a batch, of patches that a recurrent model sees one after the other; of more than one
            the drift that they add up to is a loss as well, which the thesis misses in its own (3.5.1).
        threads: Number of torch threads.
    """

    loss: str = "l1"
    batch: int = 256
    learning_rate: float = 1e-3
    final_learning_rate: float = 1e-3
    weight_decay: float = 0.0
    mask_share: float = formerly("hidden", 0.0)
    sequence: int = 1
    threads: int = 1

    def __post_init__(self) -> None:
        """Check the values."""
        require(self.loss in ("l1", "mse"), "learner.loss", f"'{self.loss}'", "l1 or mse")
        for name in ("batch", "threads"):
            require(getattr(self, name) >= 1, f"learner.{name}", getattr(self, name), "1 or more")
        for name in ("learning_rate", "final_learning_rate"):
            require(getattr(self, name) > 0.0, f"learner.{name}", getattr(self, name), "above 0")
        require(self.weight_decay >= 0.0, "learner.weight_decay", self.weight_decay, "0 or more")
        require(1 <= self.sequence <= self.batch, "learner.sequence", self.sequence, "from 1 to learner.batch")
        require(0.0 <= self.mask_share < 1.0, "learner.mask_share", self.mask_share, "from 0 up to but not 1")


@dataclass(frozen=True, kw_only=True)
class RootConfig(RunConfig):
    """One training run of a root model, whose samples are windows and whose iterations are batches.

    Attributes:
        learns: "root", which tells this config from others that ``trainers.supervised`` takes.
        data: Motion.
        model: Model.
        learner: Updates.
    """

    learns: str = "root"
    name: str = "root"
    data: RootDataConfig = field(default_factory=RootDataConfig)
    model: RootSpec = field(default_factory=RootSpec)
    learner: RootLearnerConfig = field(default_factory=RootLearnerConfig)
    samples: int = 20_000_000
    evaluate_every: int = 2000
    checkpoint_every: int = 2000

    def __post_init__(self) -> None:
        """Check the values."""
        require(self.learns == "root", "learns", f"'{self.learns}'", "root, or lower_body in a LoBSTr network's config")
        super().__post_init__()
        sequence, batch = self.learner.sequence, self.learner.batch
        if sequence > 1:
            multiple = f"1, or such that learner.batch ({batch}) is a multiple of twice it"
            should = "1 for planar networks" if self.model.is_planar else multiple
            require(not self.model.is_planar and batch % (2 * sequence) == 0, "learner.sequence", sequence, should)
