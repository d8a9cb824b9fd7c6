"""Policies that the two policy studies train, each with its overrides of the config and its row of Table 4.4."""

from dataclasses import dataclass

MIXED, IMU_LARGE, IMU = "IMU + optical", "IMU, large", "IMU"
OPTICAL_LARGE, OPTICAL = "optical, large", "optical"
OURS, DRECON, FULL = "ours (adapt)", "drecon", "full state and action space"
UNTRAINED = "zero residual, no policy"


@dataclass(frozen=True)
class Variant:
    """Row of a study.

    Attributes:
        name: Name of the row.
        uses_all_clips: Whether the policy learns from all clips, else from half of them.
        overrides: Overrides of the config that distinguish the row from the others.
        published: Values of Table 4.4.
    """

    name: str
    uses_all_clips: bool
    overrides: tuple[str, ...]
    published: dict[str, float]


def _table_4_4(*values: float | None) -> dict[str, float]:
    """Return a row of the table by measure, without lost values (docs/errata.md).

    Its root MSE, "per frame in m", is another quantity than eq. 4.12 (docs/errata.md): it keeps a name of its own.
    """
    names = (
        "assets", "frames", "episode_length_ratio", "episode_length_ratio_std", "sr90", "root_mse_as_printed", "root_mse_as_printed_std",
        "max_reward_ratio", "max_reward_ratio_std",
    )  # fmt: skip
    return {name: value for name, value in zip(names, values, strict=True) if value is not None}


_BOTH, _SUITS, _RECORDED = (f"data.suit_share={share}" for share in (0.5, 1.0, 0.0))
_FIRST_ROW = _table_4_4(50, 39270, None, 0.081, 0.889, 5.118e-5, 4.789e-5, 0.400, 0.114)
MIXTURE = (
    Variant(MIXED, False, (_BOTH,), _FIRST_ROW),
    Variant(IMU_LARGE, True, (_SUITS,), _table_4_4(107, 80102, 0.961, 0.120, 0.907, 6.386e-5, 5.639e-5, 0.371, 0.111)),
    Variant(IMU, False, (_SUITS,), _table_4_4(33, 28925, 0.889, 0.191, 0.757, 6.949e-5, 5.882e-5, 0.386, 0.121)),
    Variant(OPTICAL_LARGE, True, (_RECORDED,), _table_4_4(103, 68392, 0.782, 0.248, 0.469, 1.424e-4, 1.107e-4, 0.257, 0.070)),
    Variant(OPTICAL, False, (_RECORDED,), _table_4_4(17, 10345, 0.468, 0.212, 0.017, 2.132e-4, 1.325e-4, 0.329, 0.095)),
)
_CONFIGURED = (
    (OURS, "adapt", _FIRST_ROW),
    (DRECON, "drecon", _table_4_4(None, None, 0.942, 0.141, 0.885, 5.863e-5, 5.598e-5, 0.372, 0.110)),
    (FULL, "full", _table_4_4(None, None, None, 0.168, 0.839, 6.251e-5, 7.980e-5, 0.273, 0.099)),
)
CONFIGURATION = tuple(Variant(name, False, (_BOTH, f"task.configuration={value}"), row) for name, value, row in _CONFIGURED)
