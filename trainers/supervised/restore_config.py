"""Configuration of the training of a restoring network; files in ``configs/`` change the defaults."""

from dataclasses import dataclass, field

from agents.restore.spec import RestoreSpec
from configs.errors import require
from trainers.data.motion_config import SourceConfig
from trainers.runs.run_config import RunConfig


@dataclass(frozen=True, kw_only=True)
class RestoreDataConfig(SourceConfig):
    """Motion that a restoring network learns from.

    Attributes:
        suit_takes: Number of simulated suit recordings of each clip.
        tempo: Largest factor by which all takes but the first are slower or quicker.
        min_severity: Least severity of the suits' faults; each recording has its own.
        max_severity: Largest severity of the suits' faults.
    """

    suit_takes: int = 4
    tempo: float = 1.25
    min_severity: float = 0.4
    max_severity: float = 1.4

    def __post_init__(self) -> None:
        """Check the values."""
        super().__post_init__()
        require(self.suit_takes >= 1, "data.suit_takes", self.suit_takes, "1 or more")
        require(self.tempo >= 1.0, "data.tempo", self.tempo, "1 or more")
        require(self.min_severity >= 0.0, "data.min_severity", self.min_severity, "0 or more")
        require(self.max_severity >= self.min_severity, "data.max_severity", self.max_severity, "data.min_severity or more")


@dataclass(frozen=True)
class RestoreLearnerConfig:
    """Settings of the network's updates.

    Attributes:
        batch: Number of whole windows in a batch; of shorter ones there are as many more.
        learning_rate: Adam's learning rate at the start, after it has risen from zero for the first hundredth of the training.
        final_learning_rate: Adam's learning rate at the end; it falls along half a cosine.
        weight_decay: AdamW's weight decay.
        clean_share: Share of the windows in which the network sees the true clip, which it has to leave as it is.
        added_misalignment: Largest standard deviation of further constant misalignments of each body [rad]; each window draws its own.
        convention: Largest standard deviation of constant rotations of both clips, the same left and right and pitch alone on the
            middle bodies, as skeletons differ in what zero is [rad].
        mirror: Whether half of the windows are mirrored.
        exchange_share: Share of the windows that get their trunk and head, their left or their right arm from another one, each drawn
            on its own.
        sway: Largest standard deviation of slow rotations of the joints above the pelvis, the same of both clips [rad].
        shortest_s: Duration of the shortest pieces [s]; half of the windows hold a piece of a random length from there on.
        position_weight: Weight of the loss of joint positions [1/m].
        velocity_weight: Weight of the loss of joint velocities [s/m].
        rotation_weight: Weight of the loss of rotations [1/rad].
        constant_weight: Weight of the loss of the constant parts of the corrections [1/rad].
        stance_weight: Weight of the loss of the feet's relative velocity while both stand [s/m].
        contact_weight: Weight of the loss of contacts.
        root_weight: Weight of the loss of the root's height [1/m] and velocity [s/m].
        uncertainty_weight: Weight of the loss of standard deviations.
        threads: Number of torch threads.
    """

    batch: int = 24
    learning_rate: float = 1e-3
    final_learning_rate: float = 1e-5
    weight_decay: float = 0.05
    clean_share: float = 0.2
    added_misalignment: float = 0.1
    convention: float = 0.2
    mirror: bool = True
    exchange_share: float = 1.0
    sway: float = 0.15
    shortest_s: float = 1.0
    position_weight: float = 10.0
    velocity_weight: float = 0.5
    rotation_weight: float = 1.0
    constant_weight: float = 1.0
    stance_weight: float = 0.5
    contact_weight: float = 0.8
    root_weight: float = 0.2
    uncertainty_weight: float = 0.02
    threads: int = 1

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ("batch", "threads"):
            require(getattr(self, name) >= 1, f"learner.{name}", getattr(self, name), "1 or more")
        for name in ("learning_rate", "final_learning_rate", "shortest_s"):
            require(getattr(self, name) > 0.0, f"learner.{name}", getattr(self, name), "above 0")
        require(0.0 <= self.clean_share < 1.0, "learner.clean_share", self.clean_share, "from 0 up to but not 1")
        require(0.0 <= self.exchange_share <= 1.0, "learner.exchange_share", self.exchange_share, "from 0 to 1")
        weights = [name for name in vars(self) if name.endswith("_weight")]
        for name in ("weight_decay", "added_misalignment", "convention", "sway", *weights):
            require(getattr(self, name) >= 0.0, f"learner.{name}", getattr(self, name), "0 or more")


@dataclass(frozen=True, kw_only=True)
class RestoreConfig(RunConfig):
    """One training run of a restoring network, whose samples are windows and whose iterations are batches.

    Attributes:
        learns: "restore", which tells this config from others that ``trainers.supervised`` takes.
        device: Device of the learner: "cpu", "cuda", or "auto", the GPU where there is one.
        data: Motion.
        model: Network.
        learner: Updates.
    """

    learns: str = "restore"
    name: str = "restore"
    device: str = "auto"
    data: RestoreDataConfig = field(default_factory=RestoreDataConfig)
    model: RestoreSpec = field(default_factory=RestoreSpec)
    learner: RestoreLearnerConfig = field(default_factory=RestoreLearnerConfig)
    samples: int = 200_000
    evaluate_every: int = 500
    checkpoint_every: int = 500

    def __post_init__(self) -> None:
        """Check the values."""
        require(self.learns == "restore", "learns", f"'{self.learns}'", "restore in a restoring network's config")
        require(self.device in ("auto", "cpu", "cuda"), "device", f"'{self.device}'", "auto, cpu or cuda")
        super().__post_init__()
