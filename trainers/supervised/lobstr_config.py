"""Configuration of the training of a LoBSTr network; files in ``configs/`` change the defaults, which are the paper's (appendix 3)."""

from dataclasses import dataclass, field

from agents.lobstr.spec import LobstrSpec
from configs.errors import require
from configs.load import formerly
from trainers.data.motion_config import SourceConfig
from trainers.runs.run_config import RunConfig


@dataclass(frozen=True, kw_only=True)
class LobstrDataConfig(SourceConfig):
    """Motion that the network learns from.

    Attributes:
        tempo_takes: Number of takes of each clip; all but the first are at another tempo.
        tempo: Largest factor by which takes are slower or quicker.
        mirror: Whether all takes are there a second time, left and right exchanged.
    """

    tempo_takes: int = formerly("takes", 1)
    tempo: float = 1.25
    mirror: bool = False

    def __post_init__(self) -> None:
        """Check the values."""
        super().__post_init__()
        require(self.tempo_takes >= 1, "data.tempo_takes", self.tempo_takes, "1 or more")
        require(self.tempo >= 1.0, "data.tempo", self.tempo, "1 or more")


@dataclass(frozen=True)
class LobstrLearnerConfig:
    """Settings of the network's updates.

    Attributes:
        batch: Number of pieces of clips in a batch.
        predicted_frames: Number of frames of each piece that are predicted, each with a second behind it; feet's velocities need 2.
        learning_rate: Adam's learning rate at the start.
        final_learning_rate: Adam's learning rate at the end; it falls by the same factor with every batch.
        pose_weight: Weight of the loss of poses (section 3.3).
        kinematics_weight: Weight of the loss of toe-base positions [1/m].
        velocity_weight: Weight of the loss of toe-base velocities [frame/m].
        contact_weight: Weight of the loss of contacts.
        position_noise_m: Standard deviation of the trackers' position noise, drawn anew in each frame [m] (appendix 2).
        rotation_noise_deg: Largest angle of the trackers' rotation noise, drawn anew in each frame [deg] (appendix 2).
        placement_std_m: Standard deviation of each tracker's offset from its joint along each axis, the same throughout a piece [m].
        bfloat16: Whether matrices are multiplied in bfloat16: two to three times as quick where the processor supports it.
        threads: Number of torch threads.
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
    bfloat16: bool = True
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


@dataclass(frozen=True, kw_only=True)
class LobstrConfig(RunConfig):
    """One training run of a LoBSTr network, whose samples are predicted frames and whose iterations are batches.

    Attributes:
        learns: "lower_body", which tells this config from a root model's.
        data: Motion.
        model: Network.
        learner: Updates.
    """

    learns: str = "lower_body"
    name: str = "lobstr"
    data: LobstrDataConfig = field(default_factory=LobstrDataConfig)
    model: LobstrSpec = field(default_factory=LobstrSpec)
    learner: LobstrLearnerConfig = field(default_factory=LobstrLearnerConfig)
    samples: int = 10_000_000
    evaluate_every: int = 200
    checkpoint_every: int = 200

    def __post_init__(self) -> None:
        """Check the values."""
        require(self.learns == "lower_body", "learns", f"'{self.learns}'", "lower_body in a LoBSTr network's config")
        super().__post_init__()
