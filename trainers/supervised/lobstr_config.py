"""What the training of a LoBSTr network is made of; files in ``configs/`` change the defaults, which are the paper's (appendix 3)."""

from dataclasses import dataclass, field

from agents.lobstr.spec import LobstrSpec
from configs.errors import require
from configs.load import formerly


@dataclass(frozen=True)
class LobstrDataConfig:
    """Which motion the network learns from.

    Attributes:
        motions: Motion source: a BVH or MVNX file, a folder of them, or "synthetic".
        mapping: File that names the joints of a skeleton whose joints cannot be found; none if empty.
        synthetic_sets: Sets of made-up people beside the source, of four people each.
        tempo_takes: Performances of each clip; all but the first are at another tempo.
        tempo: How much slower or quicker at most.
        mirror: Whether every performance is there in a mirror as well.
        holdout: Performer of the source kept out of training for model selection; "auto" picks one, "none" selects on training clips.
        seed: Of everything random in the motion.
    """

    motions: str = "synthetic"
    mapping: str = ""
    synthetic_sets: int = formerly("synthetic", 0)
    tempo_takes: int = formerly("takes", 1)
    tempo: float = 1.25
    mirror: bool = False
    holdout: str = "auto"
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the values."""
        require(self.synthetic_sets >= 0, "data.synthetic_sets", self.synthetic_sets, "0 or more")
        require(self.tempo_takes >= 1, "data.tempo_takes", self.tempo_takes, "1 or more")
        require(self.tempo >= 1.0, "data.tempo", self.tempo, "1 or more")


@dataclass(frozen=True)
class LobstrLearnerConfig:
    """How the network is fitted.

    Attributes:
        batch: Pieces of clips in a batch.
        predicted_frames: Frames of each piece that are predicted, each with a second behind it; feet's speeds need 2.
        learning_rate: Of Adam, at the start.
        final_learning_rate: At the end; it falls by the same factor with every batch.
        pose_weight: Weight of the loss of poses (section 3.3).
        kinematics_weight: Weight of that of toe-base positions [1/m].
        velocity_weight: Weight of that of their speeds [frame/m].
        contact_weight: Weight of that of contacts.
        position_noise_m: Standard deviation of how far trackers are off, in each frame anew [m] (appendix 2).
        rotation_noise_deg: Angle by which trackers are turned at most, in each frame anew [deg] (appendix 2).
        placement_std_m: Standard deviation of how far each tracker is from its joint along each axis, the same throughout a piece [m].
        bfloat16: Whether products of matrices are in bfloat16: two to three times as quick where the processor knows it.
        threads: Threads of torch.
    """

    batch: int = 256
    predicted_frames: int = formerly("predicted", 2)
    learning_rate: float = 1e-3
    final_learning_rate: float = 2.2e-4
    pose_weight: float = formerly("pose", 1.0)
    kinematics_weight: float = formerly("kinematics", 0.1)
    velocity_weight: float = formerly("velocity", 0.1)
    contact_weight: float = formerly("contact", 1e-6)
    position_noise_m: float = formerly("noise", 0.01)
    rotation_noise_deg: float = formerly("turned", 1.5)
    placement_std_m: float = formerly("displaced", 0.0)
    bfloat16: bool = formerly("bfloat16", True)
    threads: int = 1

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ("batch", "threads"):
            require(getattr(self, name) >= 1, f"learner.{name}", getattr(self, name), "1 or more")
        require(self.predicted_frames >= 2, "learner.predicted_frames", self.predicted_frames, "2 or more")
        for name in ("learning_rate", "final_learning_rate"):
            require(getattr(self, name) > 0.0, f"learner.{name}", getattr(self, name), "above 0")
        for name in (
            "pose_weight",
            "kinematics_weight",
            "velocity_weight",
            "contact_weight",
            "position_noise_m",
            "rotation_noise_deg",
            "placement_std_m",
        ):
            require(getattr(self, name) >= 0.0, f"learner.{name}", getattr(self, name), "0 or more")


@dataclass(frozen=True)
class LobstrConfig:
    """One training run of a LoBSTr network.

    Attributes:
        learns: "lower_body", which tells this config from a root model's.
        name: The run's folder under ``runs_dir``.
        runs_dir: Folder of all runs.
        data: Which motion.
        model: Which network.
        learner: Updates.
        samples: Predicted frames after which training ends.
        minutes: Wall-clock limit after which it ends; 0 is none.
        evaluate_every: Batches between evaluations on the held-out performer.
        checkpoint_every: Batches between checkpoints.
        seed: Of the network and the order of pieces.
    """

    learns: str = "lower_body"
    name: str = "lobstr"
    runs_dir: str = "runs"
    data: LobstrDataConfig = field(default_factory=LobstrDataConfig)
    model: LobstrSpec = field(default_factory=LobstrSpec)
    learner: LobstrLearnerConfig = field(default_factory=LobstrLearnerConfig)
    samples: int = 10_000_000
    minutes: float = 0.0
    evaluate_every: int = 200
    checkpoint_every: int = 200
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the values."""
        require(self.learns == "lower_body", "learns", f"'{self.learns}'", "lower_body in a LoBSTr network's config")
        for name in ("samples", "evaluate_every", "checkpoint_every"):
            require(getattr(self, name) >= 1, name, getattr(self, name), "1 or more")
        require(self.minutes >= 0.0, "minutes", self.minutes, "0 (no limit) or more")
        require(bool(self.name) and "/" not in self.name, "name", repr(self.name), "a folder's name")
