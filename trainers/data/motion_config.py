"""Which motion a training imitates."""

from dataclasses import dataclass

from configs.errors import require

RECONSTRUCTED, CLEAN = "reconstructed", "clean"


@dataclass(frozen=True)
class DataConfig:
    """Which motion is imitated.

    Attributes:
        motions: Motion source: a BVH or MVNX file, a folder of them, or "synthetic".
        synthetic: Sets of made-up people beside the source, of four people each.
        mapping: File that names the joints of a skeleton whose joints cannot be found; none if empty.
        suit_clips: How many simulated IMU-suit recordings are made of each clip.
        suit_share: Share of the episodes that follow a simulated suit's clip instead of a clip as recorded.
        suit_severity: How bad the suits are: 0 perfect, 1 as in the literature.
        rewarded: Of a pair, what a simulated suit made of a clip and the clip itself: "observed", the suit's, as in the thesis, or "clean".
        mirror: Whether all clips are there a second time, left and right exchanged.
        roots: Of suits' clips and of clips without one: "recorded" as suit and file say, or "reconstructed" by the shipped root models.
        holdout: Performer kept out of training for model selection; "auto" picks one, "none" selects on the training clips.
        seed: Of everything random in the motion.
    """

    motions: str = "synthetic"
    synthetic: int = 0
    mapping: str = ""
    suit_clips: int = 1
    suit_share: float = 0.5
    suit_severity: float = 1.0
    rewarded: str = "observed"
    mirror: bool = False
    roots: str = "recorded"
    holdout: str = "auto"
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the values."""
        require(0.0 <= self.suit_share <= 1.0, "data.suit_share", self.suit_share, "from 0 to 1")
        require(self.roots in ("recorded", RECONSTRUCTED), "data.roots", f"'{self.roots}'", f"recorded or {RECONSTRUCTED}")
        require(self.rewarded in ("observed", CLEAN), "data.rewarded", f"'{self.rewarded}'", f"observed or {CLEAN}")
        require(self.synthetic >= 0, "data.synthetic", self.synthetic, "0 or more")
        require(self.suit_clips >= 0, "data.suit_clips", self.suit_clips, "0 or more")
        require(self.suit_severity >= 0.0, "data.suit_severity", self.suit_severity, "0 or more")
