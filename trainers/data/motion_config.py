"""Which motion a training imitates."""

from dataclasses import dataclass

from configs.errors import require
from configs.load import formerly

RECONSTRUCTED, CLEAN = "reconstructed", "clean"


@dataclass(frozen=True)
class DataConfig:
    """Which motion is imitated.

    Attributes:
        motions: Motion source: a BVH or MVNX file, a folder of them, or "synthetic".
        synthetic_sets: Sets of made-up people beside the source, of four people each.
        mapping: File that names the joints of a skeleton whose joints cannot be found; none if empty.
        suit_clips: How many simulated IMU-suit recordings are made of each clip.
        suit_share: Share of the episodes that follow a simulated suit's clip instead of a clip as recorded.
        suit_severity: How bad the suits are: 0 perfect, 1 as in the literature.
        reward_target: Of a pair, what a simulated suit made of a clip and the clip itself: "observed", the suit's (thesis), or "clean".
        mirror: Whether all clips are there a second time, left and right exchanged.
        root_source: Of suits' clips and of clips without one: "recorded" as suit and file say, or "reconstructed" by the package's models.
        holdout: Performer kept out of training for model selection; "auto" picks one, "none" selects on the training clips.
        seed: Of everything random in the motion.
    """

    motions: str = "synthetic"
    synthetic_sets: int = formerly("synthetic", 0)
    mapping: str = ""
    suit_clips: int = 1
    suit_share: float = 0.5
    suit_severity: float = 1.0
    reward_target: str = formerly("rewarded", "observed")
    mirror: bool = False
    root_source: str = formerly("roots", "recorded")
    holdout: str = "auto"
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the values."""
        require(0.0 <= self.suit_share <= 1.0, "data.suit_share", self.suit_share, "from 0 to 1")
        require(
            self.root_source in ("recorded", RECONSTRUCTED), "data.root_source", f"'{self.root_source}'", f"recorded or {RECONSTRUCTED}"
        )
        require(self.reward_target in ("observed", CLEAN), "data.reward_target", f"'{self.reward_target}'", f"observed or {CLEAN}")
        require(self.synthetic_sets >= 0, "data.synthetic_sets", self.synthetic_sets, "0 or more")
        require(self.suit_clips >= 0, "data.suit_clips", self.suit_clips, "0 or more")
        require(self.suit_severity >= 0.0, "data.suit_severity", self.suit_severity, "0 or more")
