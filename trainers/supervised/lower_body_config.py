"""Configuration of the training of a network that predicts a lower body from trackers."""

from dataclasses import dataclass, field

from agents.lower_body.spec import LowerBodySpec
from configs.errors import require
from trainers.runs.run_config import RunConfig
from trainers.supervised.lobstr_config import LobstrDataConfig


@dataclass(frozen=True)
class LowerBodyLearnerConfig:
    """Settings of the network's updates.

    Attributes:
        batch: Number of pieces of clips in a batch.
        frames: Number of frames of a piece; shorter clips are one piece.
        skipped_frames: Number of frames at the beginning of a piece that are not scored, as the network knows next to nothing yet.
        learning_rate: AdamW's highest learning rate.
        final_learning_rate: AdamW's learning rate at the end, to which it falls along half a cosine.
        weight_decay: AdamW's weight decay.
        average: Share of what it was that the average of the weights keeps with each update; it is the network that is scored and kept.
        rotation_weight: Weight of the rotations' loss.
        position_weight: Weight of the loss of the positions of knees, ankles and toe-bases [1/m].
        velocity_weight: Weight of the loss of the velocities of ankles and toe-bases [s/m].
        foot_lock_weight: Weight of the velocities of toe-bases in the world while they stand [s/m].
        contact_weight: Weight of the loss of contacts.
        users: Number of virtual users, whose calibration errors pieces are given.
        perfect_share: Share of the pieces whose joints are exact.
        convention_deg: Standard deviation of a constant pitch of pelvis and head in a piece, as skeletons of other families have it [deg].
        build: Standard deviation of the lengths of trunk and arms of a piece, relative to the standard ones.
        floor_m: Standard deviation of the height of a piece's floor, as people stand on straighter or more bent legs, and clips float [m].
        position_noise_m: Standard deviation of the trackers' noise along each axis, drawn anew in each frame [m].
        rotation_noise_deg: The same about each axis [deg].
        no_pelvis_share: Share of the pieces without a pelvis tracker.
        feet_share: Share of the pieces with trackers on the feet.
        shins_share: Share of the pieces with trackers on the shins.
        imu_share: Share of the trackers on legs that are IMUs, which have no position.
        lost_share: Share of the trackers that are lost for a while in a piece.
        bfloat16: Whether matrices are multiplied in bfloat16: twice as quick where the processor supports it.
        threads: Number of torch threads.
    """

    batch: int = 32
    frames: int = 180
    skipped_frames: int = 20
    learning_rate: float = 2e-3
    final_learning_rate: float = 2e-5
    weight_decay: float = 0.01
    average: float = 0.998
    rotation_weight: float = 1.0
    position_weight: float = 4.0
    velocity_weight: float = 0.25
    foot_lock_weight: float = 0.1
    contact_weight: float = 0.3
    users: int = 1000
    perfect_share: float = 0.3
    convention_deg: float = 4.0
    build: float = 0.03
    floor_m: float = 0.0
    position_noise_m: float = 0.0012
    rotation_noise_deg: float = 0.15
    no_pelvis_share: float = 0.1
    feet_share: float = 0.15
    shins_share: float = 0.15
    imu_share: float = 0.4
    lost_share: float = 0.04
    bfloat16: bool = True
    threads: int = 1

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ("batch", "threads", "users"):
            require(getattr(self, name) >= 1, f"learner.{name}", getattr(self, name), "1 or more")
        require(self.frames >= 2, "learner.frames", self.frames, "2 or more")
        require(
            0 <= self.skipped_frames <= self.frames - 2, "learner.skipped_frames", self.skipped_frames, "from 0 to learner.frames less 2"
        )
        for name in ("learning_rate", "final_learning_rate"):
            require(getattr(self, name) > 0.0, f"learner.{name}", getattr(self, name), "above 0")
        shares = ("average", "perfect_share", "no_pelvis_share", "feet_share", "shins_share", "imu_share", "lost_share")
        for name in shares:
            require(0.0 <= getattr(self, name) <= 1.0, f"learner.{name}", getattr(self, name), "from 0 to 1")
        weights = (f"{name}_weight" for name in ("rotation", "position", "velocity", "foot_lock", "contact"))
        for name in (*weights, "weight_decay", "convention_deg", "build", "floor_m", "position_noise_m", "rotation_noise_deg"):
            require(getattr(self, name) >= 0.0, f"learner.{name}", getattr(self, name), "0 or more")


@dataclass(frozen=True, kw_only=True)
class LowerBodyConfig(RunConfig):
    """One training run, whose samples are frames and whose iterations are batches.

    Attributes:
        learns: "legs", which tells this config from others.
        data: Motion.
        model: Network.
        learner: Updates.
    """

    learns: str = "legs"
    name: str = "lower_body"
    data: LobstrDataConfig = field(default_factory=LobstrDataConfig)
    model: LowerBodySpec = field(default_factory=LowerBodySpec)
    learner: LowerBodyLearnerConfig = field(default_factory=LowerBodyLearnerConfig)
    samples: int = 15_000_000
    evaluate_every: int = 200
    checkpoint_every: int = 200

    def __post_init__(self) -> None:
        """Check the values."""
        require(self.learns == "legs", "learns", f"'{self.learns}'", "legs in the config of a lower-body network")
        super().__post_init__()
