"""Findings of the thesis's section 4.5 that the rows of the policy studies repeat.

``eval.study.framework.seed_comparison`` has the rule.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from eval.study.framework.seed_comparison import Claims, ComparedRows, Finding, as_findings
from eval.study.policy.scores import MEASURES, RECORDED_PREFIX
from eval.study.policy.variants import DRECON, FULL, IMU, IMU_LARGE, MIXED, OPTICAL, OPTICAL_LARGE, OURS

DECIMALS = {"episode_length_ratio": 3, "sr90": 3, "root_mse": 4, "max_reward_ratio": 3}
LENGTH_RATIO, SR90, ROOT_MSE, REWARD_RATIO = MEASURES


def mixture_findings(rows: Sequence[dict[str, Any]]) -> list[Finding]:
    """Return the findings of 4.5.2 with the numbers that decide each."""
    return as_findings(_mixture(ComparedRows(rows, _sign, _text)))


def configuration_findings(rows: Sequence[dict[str, Any]]) -> list[Finding]:
    """Return the findings of 4.5.3 with the numbers that decide each."""
    return as_findings(_configuration(ComparedRows(rows, _sign, _text)))


def _mixture(rows: ComparedRows) -> Claims:
    single, of_optical, with_imu = (IMU_LARGE, IMU, OPTICAL_LARGE, OPTICAL), (OPTICAL, OPTICAL_LARGE), (MIXED, IMU_LARGE, IMU)
    for measure in (LENGTH_RATIO, REWARD_RATIO, ROOT_MSE):
        claim = "IMU + optical is better than every other data set, larger ones included"
        yield rows.claim_better(MIXED, rows.best(single, measure), measure, claim)
    yield rows.claim_better(IMU_LARGE, MIXED, SR90, "by the 90 % survival rate alone, IMU large is slightly better than IMU + optical")
    for large in (IMU_LARGE, OPTICAL_LARGE):
        yield rows.claim_better(MIXED, large, LENGTH_RATIO, "another kind of data is worth more than more of one kind")
    for measure in MEASURES:
        claim = "optical data alone score lowest: the better of the two is worse than every set with IMU data"
        yield rows.claim_better(rows.worst(with_imu, measure), rows.best(of_optical, measure), measure, claim)
    shift = "training on one source and playing on the other is ineffective"
    yield rows.claim_better(IMU_LARGE, OPTICAL_LARGE, LENGTH_RATIO, f"{shift}: through suits, IMU data are the better ones")
    yield rows.claim_better(
        OPTICAL_LARGE, IMU_LARGE, RECORDED_PREFIX + LENGTH_RATIO, f"{shift}: as recorded, optical data are the better ones"
    )
    robust = "data of both kinds make robust to either"
    yield rows.claim_better(MIXED, OPTICAL, LENGTH_RATIO, f"{robust}: through suits, better than optical data")
    yield rows.claim_better(MIXED, IMU, RECORDED_PREFIX + LENGTH_RATIO, f"{robust}: as recorded, better than IMU data")
    for large, small in ((IMU_LARGE, IMU), (OPTICAL_LARGE, OPTICAL)):
        for measure in (LENGTH_RATIO, SR90):
            yield rows.claim_better(large, small, measure, "more data of one kind are better (in Table 4.4, not in its text)")


def _configuration(rows: ComparedRows) -> Claims:
    for other, claim in (
        (DRECON, "to observe all bodies is better than to observe a few (drecon)"),
        (FULL, "to correct key joints is better than to correct all"),
    ):
        for measure in MEASURES:
            yield rows.claim_better(OURS, other, measure, claim)
    for measure in MEASURES:
        yield rows.claim_better(DRECON, FULL, measure, "drecon comes second, before the full state and action space")


def _sign(measure: str) -> float:
    """Return 1 where more of a measure is better, else -1."""
    return -1.0 if measure.removeprefix(RECORDED_PREFIX) == ROOT_MSE else 1.0


def _text(value: Mapping[str, float], measure: str) -> str:
    decimals = DECIMALS[measure.removeprefix(RECORDED_PREFIX)]
    return f"{value['mean']:.{decimals}f} ± {value['std']:.{decimals}f}"
