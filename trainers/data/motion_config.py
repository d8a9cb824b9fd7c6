"""Settings of the motion that a training learns from."""

from dataclasses import dataclass

from configs.errors import require
from configs.load import formerly

RECONSTRUCTED, CLEAN = "reconstructed", "clean"


@dataclass(frozen=True, kw_only=True)
class SourceConfig:
    """Motion source and held-out performer, which the ``data`` of every training's config has.

    Attributes:
        motions: Motion source: a motion file, a folder of them, or "synthetic".
        synthetic_sets: Number of sets of synthetic people beside the source, of four people each.
        mapping: File that names the joints of a skeleton whose joints cannot be found; none if empty.
        holdout: Performer kept out of training for model selection; "auto" picks one, "none" selects on the training clips.
        seed: Seed of everything random in the motion.
    """

    motions: str = "synthetic"
    synthetic_sets: int = formerly("synthetic", 0)
    mapping: str = ""
    holdout: str = "auto"
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the values."""
        require(self.synthetic_sets >= 0, "data.synthetic_sets", self.synthetic_sets, "0 or more")


@dataclass(frozen=True, kw_only=True)
class DataConfig(SourceConfig):
    """Motion that a policy imitates.

    Attributes:
        suit_clips: Number of simulated IMU-suit recordings of each clip.
        suit_share: Share of the episodes that follow a simulated suit's clip instead of a clip as recorded.
        suit_severity: Severity of the suits' faults: 0 none, 1 as in the literature.
        reward_target: Clip of a pair (a simulated suit's clip and the clip it was made from) that is rewarded: "observed", the suit's
            (thesis), or "clean".
        mirror: Whether all clips are there a second time, left and right exchanged.
        restore: Whether simulated suits' poses are restored by the package's network, as cleaning does, before they are imitated.
        root_source: Root of suits' clips and of clips without one: "recorded" as suit and file say, or "reconstructed" by the package's
            models.
    """

    suit_clips: int = 1
    suit_share: float = 0.5
    suit_severity: float = 1.0
    reward_target: str = formerly("rewarded", "observed")
    mirror: bool = False
    restore: bool = True
    root_source: str = formerly("roots", "recorded")

    def __post_init__(self) -> None:
        """Check the values."""
        super().__post_init__()
        require(0.0 <= self.suit_share <= 1.0, "data.suit_share", self.suit_share, "from 0 to 1")
        require(
            self.root_source in ("recorded", RECONSTRUCTED), "data.root_source", f"'{self.root_source}'", f"recorded or {RECONSTRUCTED}"
        )
        require(self.reward_target in ("observed", CLEAN), "data.reward_target", f"'{self.reward_target}'", f"observed or {CLEAN}")
        require(self.suit_clips >= 0, "data.suit_clips", self.suit_clips, "0 or more")
        require(self.suit_severity >= 0.0, "data.suit_severity", self.suit_severity, "0 or more")
