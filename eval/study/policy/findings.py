"""Which findings of the thesis's section 4.5 the rows of the policy studies repeat.

``eval.study.protocol.seed_comparison`` says by what rule.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from eval.study.policy.scores import MEASURES, RECORDED
from eval.study.policy.variants import DRECON, FULL, IMU, IMU_LARGE, MIXED, OPTICAL, OPTICAL_LARGE, OURS
from eval.study.protocol.seed_comparison import ComparedRows, Finding, Found, findings

DECIMALS = {"episode_length_ratio": 3, "sr90": 3, "root_mse": 4, "max_reward_ratio": 3}
LENGTH, SR90, ROOT, REWARD = MEASURES


def mixture_findings(rows: Sequence[dict[str, Any]]) -> list[Finding]:
    """Return the findings of 4.5.2 with the numbers that decide each."""
    return findings(_mixture(ComparedRows(rows, _sign, _text)))


def configuration_findings(rows: Sequence[dict[str, Any]]) -> list[Finding]:
    """Return the findings of 4.5.3 with the numbers that decide each."""
    return findings(_configuration(ComparedRows(rows, _sign, _text)))


def _mixture(rows: ComparedRows) -> Found:
    single, of_optical, with_imu = (IMU_LARGE, IMU, OPTICAL_LARGE, OPTICAL), (OPTICAL, OPTICAL_LARGE), (MIXED, IMU_LARGE, IMU)
    for measure in (LENGTH, REWARD, ROOT):
        claim = "IMU + optical is better than every other data set, larger ones included"
        yield rows.better(MIXED, rows.best(single, measure), measure, claim)
    yield rows.better(IMU_LARGE, MIXED, SR90, "by the 90 % survival rate alone, IMU large is slightly better than IMU + optical")
    for large in (IMU_LARGE, OPTICAL_LARGE):
        yield rows.better(MIXED, large, LENGTH, "another kind of data is worth more than more of one kind")
    for measure in MEASURES:
        claim = "optical data alone score lowest: the better of the two is worse than every set with IMU data"
        yield rows.better(rows.worst(with_imu, measure), rows.best(of_optical, measure), measure, claim)
    shift = "training on one source and playing on the other is ineffective"
    yield rows.better(IMU_LARGE, OPTICAL_LARGE, LENGTH, f"{shift}: through suits, IMU data are the better ones")
    yield rows.better(OPTICAL_LARGE, IMU_LARGE, RECORDED + LENGTH, f"{shift}: as recorded, optical data are the better ones")
    robust = "data of both kinds make robust to either"
    yield rows.better(MIXED, OPTICAL, LENGTH, f"{robust}: through suits, better than optical data")
    yield rows.better(MIXED, IMU, RECORDED + LENGTH, f"{robust}: as recorded, better than IMU data")
    for large, small in ((IMU_LARGE, IMU), (OPTICAL_LARGE, OPTICAL)):
        for measure in (LENGTH, SR90):
            yield rows.better(large, small, measure, "more data of one kind are better (in Table 4.4, not in its text)")


def _configuration(rows: ComparedRows) -> Found:
    for other, claim in (
        (DRECON, "to observe all bodies is better than to observe a few (drecon)"),
        (FULL, "to correct key joints is better than to correct all"),
    ):
        for measure in MEASURES:
            yield rows.better(OURS, other, measure, claim)
    for measure in MEASURES:
        yield rows.better(DRECON, FULL, measure, "drecon comes second, before the full state and action space")


def _sign(measure: str) -> float:
    """Return whether more of a measure is better."""
    return -1.0 if measure.removeprefix(RECORDED) == ROOT else 1.0


def _text(value: Mapping[str, float], measure: str) -> str:
    decimals = DECIMALS[measure.removeprefix(RECORDED)]
    return f"{value['mean']:.{decimals}f} ± {value['std']:.{decimals}f}"
