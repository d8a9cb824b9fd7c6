"""What the training of a root model is made of; files in ``configs/`` change the defaults."""

from dataclasses import dataclass, field

from agents.root.spec import RootSpec
from configs.errors import require
from configs.load import formerly


@dataclass(frozen=True)
class RootDataConfig:
    """Which motion a root model learns from.

    Attributes:
        motions: Motion source: a BVH or MVNX file, a folder of them, or "synthetic".
        mapping: File that names the joints of a skeleton whose joints cannot be found; none if empty.
        synthetic_sets: Sets of made-up people beside the source, of four people each.
        kinds: Kinds of motion that are kept; all if empty.
        rough_ground: Whether stairs are kept.
        pose_source: "optical" as recorded, "imu" as a simulated suit has them, or "both"; accelerations are the suit's in any case.
        suit_takes: Simulated suit recordings of each clip.
        tempo: All takes but the first are performed slower or quicker by up to this factor.
        suit_severity: How bad the suits are: 0 perfect, 1 as in the literature.
        holdout: Performer of the source kept out of training for model selection; "auto" picks one, "none" selects on training clips.
        test_performers: Performers of the source who are left out of everything, for tests.
        seed: Of everything random in the motion.
    """

    motions: str = "synthetic"
    mapping: str = ""
    synthetic_sets: int = formerly("synthetic", 4)
    kinds: tuple[str, ...] = ()
    rough_ground: bool = True
    pose_source: str = formerly("poses", "both")
    suit_takes: int = formerly("takes", 4)
    tempo: float = 1.5
    suit_severity: float = 1.0
    holdout: str = "auto"
    test_performers: tuple[str, ...] = formerly("test", ())
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the values; OmegaConf hands lists over."""
        object.__setattr__(self, "kinds", tuple(self.kinds))
        object.__setattr__(self, "test", tuple(self.test_performers))
        require(self.synthetic_sets >= 0, "data.synthetic_sets", self.synthetic_sets, "0 or more")
        require(self.pose_source in ("optical", "imu", "both"), "data.pose_source", f"'{self.pose_source}'", "optical, imu or both")
        require(self.suit_takes >= 1, "data.suit_takes", self.suit_takes, "1 or more")
        require(self.tempo >= 1.0, "data.tempo", self.tempo, "1 or more")
        require(self.suit_severity >= 0.0, "data.suit_severity", self.suit_severity, "0 or more")


@dataclass(frozen=True)
class RootLearnerConfig:
    """How a root model is fitted.

    Attributes:
        loss: "l1" or "mse", of predictions in units of their standard deviation.
        batch: Windows in a batch.
        learning_rate: Of Adam, at the start.
        final_learning_rate: At the end; linear in between.
        weight_decay: Of Adam.
        mask_share: Share of the joints and sensors, legs and pelvis left out, that each window hides.
        sequence: Windows that follow one another in a batch; of more than one the drift that they add up to is a loss as well,
            which the thesis misses in its own (3.5.1).
        threads: Threads of torch.
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


@dataclass(frozen=True)
class RootConfig:
    """One training run of a root model.

    Attributes:
        learns: "root", which tells this config from others that ``trainers.supervised`` takes.
        name: The run's folder under ``runs_dir``.
        runs_dir: Folder of all runs.
        data: Which motion.
        model: Which model.
        learner: Updates.
        samples: Windows after which training ends.
        minutes: Wall-clock limit after which it ends; 0 is none.
        evaluate_every: Batches between evaluations on the held-out performer.
        checkpoint_every: Batches between checkpoints.
        seed: Of the network and the order of windows.
    """

    learns: str = "root"
    name: str = "root"
    runs_dir: str = "runs"
    data: RootDataConfig = field(default_factory=RootDataConfig)
    model: RootSpec = field(default_factory=RootSpec)
    learner: RootLearnerConfig = field(default_factory=RootLearnerConfig)
    samples: int = 20_000_000
    minutes: float = 0.0
    evaluate_every: int = 2000
    checkpoint_every: int = 2000
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the values."""
        require(self.learns == "root", "learns", f"'{self.learns}'", "root, or lower_body in a LoBSTr network's config")
        for name in ("samples", "evaluate_every", "checkpoint_every"):
            require(getattr(self, name) >= 1, name, getattr(self, name), "1 or more")
        sequence, batch = self.learner.sequence, self.learner.batch
        if sequence > 1:
            multiple = f"1, or such that learner.batch ({batch}) is a multiple of twice it"
            should = multiple if self.model.predicts_steps_ahead else "1 for planar networks"
            require(self.model.predicts_steps_ahead and batch % (2 * sequence) == 0, "learner.sequence", sequence, should)
        require(self.minutes >= 0.0, "minutes", self.minutes, "0 (no limit) or more")
        require(bool(self.name) and "/" not in self.name, "name", repr(self.name), "a folder's name")
