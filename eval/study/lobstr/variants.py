"""Networks that the LoBSTr study trains, each with its overrides of the config and the paper's values."""

from dataclasses import dataclass, field

FC, CNN, RNN, LSTM, GRU = "FC-6", "CNN-1D", "RNN", "LSTM", "GRU"
AUTOREGRESSIVE = "GRU, autoregressive"
P, PK = "GRU, losses P", "GRU, losses PK"
POSE, COMBINED = "GRU, position and orientation", "GRU, combined"
UPRIGHT = "GRU, upright"  # beyond the paper
ENCODERS = (FC, CNN, RNN, LSTM, GRU)
REPRESENTATIONS = {"velocity": GRU, "pos-ori": POSE, "combined": COMBINED}  # Table 3's name, and the row that is trained with it
MAJORITY_CLASS, MEAN_POSE, TRUTH = "always the commoner class", "mean pose", "truth"
PRETRAINED = "as shipped"
PERFECT_FEET, LOST_FEET = "six-point", "six-point, feet lost"
POSITIONS_SUFFIX = ", places compensated"  # of rows whose trackers' places are brought to those of the joints
USER_HEIGHTS_CM = (157, 171, 184)  # heights of the virtual users
TABLE_1 = {
    "contact_accuracy": 85.77,
    "rotational_error": 8.53,
    "toe_position_error": 6.63,
}  # measures, and what the paper's own network reaches
CATEGORIES = ("walk", "run", "sit_stand", "carry", "static", "free", "total")  # columns of Table 3


@dataclass(frozen=True)
class Variant:
    """Network of the study.

    Attributes:
        name: Row of the tables.
        overrides: Overrides of the config that distinguish the row from the others.
        published: Values of the paper.
    """

    name: str
    overrides: tuple[str, ...] = ()
    published: dict[str, float] = field(default_factory=dict)


def _table_1(*values: float) -> dict[str, float]:
    return dict(zip(TABLE_1, values, strict=True))


def _table_2(positional: float) -> dict[str, float]:
    return {"toe_position_error": positional}


VARIANTS = (
    Variant(FC, ("model.encoder=fc",), _table_1(84.22, 9.37, 7.2)),
    Variant(CNN, ("model.encoder=cnn",), _table_1(72.33, 13.86, 13.3)),
    Variant(RNN, ("model.encoder=rnn",), _table_1(82.27, 9.43, 7.1)),
    Variant(LSTM, ("model.encoder=lstm",), _table_1(83.85, 8.50, 6.63)),
    Variant(GRU, (), TABLE_1),
    Variant(AUTOREGRESSIVE, ("model.autoregressive=true",), {"frames_until_explosion": 120}),
    Variant(P, ("learner.kinematics_weight=0", "learner.velocity_weight=0"), _table_2(6.95)),
    Variant(PK, ("learner.velocity_weight=0",), _table_2(6.64)),
    Variant(POSE, ("model.inputs=pose",)),
    Variant(COMBINED, ("model.inputs=combined",)),
    Variant(UPRIGHT, ("model.upright=true",)),
)


def _row(*values: float) -> dict[str, float]:
    """Return a row of Table 3 by measure."""
    return {f"toe_distance_{category}": value for category, value in zip(CATEGORIES, values, strict=True)}


TABLE_3 = {
    (157, "velocity"): _row(4.8, 1.6, 3.5, 5.3, 4.0, 9.5, 4.4),
    (157, "pos-ori"): _row(6.9, 4.2, 1.7, 7.5, 0.2, 11.0, 6.0),
    (157, "combined"): _row(17.0, 10.7, 6.3, 13.1, 5.2, 20.5, 13.3),
    (171, "velocity"): _row(3.7, 1.3, 1.3, 8.3, 0.7, 7.5, 4.6),
    (171, "pos-ori"): _row(8.3, 5.3, 2.1, 6.3, 2.3, 7.4, 5.0),
    (171, "combined"): _row(20.8, 12.2, 6.2, 10.6, 1.2, 17.0, 11.9),
    (184, "velocity"): _row(0.03, 1.4, 2.4, 7.0, 9.2, 3.3, 2.1),
    (184, "pos-ori"): _row(2.9, 1.2, 1.6, 7.7, 14.4, 6.4, 5.2),
    (184, "combined"): _row(14.6, 12.9, 9.7, 17.8, 2.3, 16.3, 13.0),
}


def user_row(height: int, how: str) -> str:
    """Return the name of a virtual user's row."""
    return f"{height} cm, {how}"
