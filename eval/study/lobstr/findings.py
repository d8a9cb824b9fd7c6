"""Findings of the LoBSTr paper (section 4) that the rows of its study repeat.

``eval.study.framework.seed_comparison`` has the rule. A finding that two rows do not differ is reproduced where they are undecided.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from eval.study.framework.seed_comparison import Claims, ComparedRows, Finding, as_findings
from eval.study.lobstr.variants import (
    AUTOREGRESSIVE,
    CNN,
    COMBINED,
    FC,
    GRU,
    LOST_FEET,
    LSTM,
    MAJORITY_CLASS,
    MEAN_POSE,
    PK,
    POSE,
    PRETRAINED,
    RNN,
    TABLE_1,
    UPRIGHT,
    USER_HEIGHTS_CM,
    P,
    user_row,
)

MORE_IS_BETTER = ("contact_accuracy", "body_movement")
UNITS = {"contact_accuracy": "%", "rotational_error": "deg", "body_movement": "deg", "toe_velocity_error": "cm/s"}  # others: cm


def lobstr_findings(rows: Sequence[dict[str, Any]]) -> list[Finding]:
    """Return each finding with the numbers that decide it."""
    ask = ComparedRows(rows, _sign, _text)
    parts = (_encoders, _autoregressive, _losses, _marks, _upright, _representations, _movement, _six_point)
    return as_findings(found for part in parts for found in part(ask))


def _encoders(ask: ComparedRows) -> Claims:
    gated, others = (GRU, LSTM), (FC, CNN, RNN)
    for measure in TABLE_1:
        claim = "LSTM and GRU are the best encoders: the worse of the two is better than all others"
        yield ask.claim_better(ask.worst(gated, measure), ask.best(others, measure), measure, claim)
    for measure in ("rotational_error", "toe_position_error"):  # by contacts it prefers GRU
        yield ask.claim_alike(GRU, LSTM, measure, "between LSTM and GRU the difference is not significant")
    best = ask.best((LSTM, *others), "contact_accuracy")
    yield ask.claim_better(GRU, best, "contact_accuracy", "GRU tells contacts best")
    for measure in TABLE_1:
        yield ask.claim_better(ask.worst((*gated, FC, RNN), measure), CNN, measure, "CNN-1D is the worst encoder")
    jittery, smooth = (FC, CNN), (*gated, RNN)
    steadier, restless = (min(jittery, key=lambda row: ask.mean(row, "body_movement")), ask.best(smooth, "body_movement"))
    claim = "encoders without recurrence jitter: the steadier of the two moves more than all recurrent ones"
    yield ask.claim_better(steadier, restless, "body_movement", claim)


def _autoregressive(ask: ComparedRows) -> Claims:
    share, frames = (ask.mean(AUTOREGRESSIVE, name) for name in ("exploded", "frames_until_explosion"))
    yield (
        f"a GRU that gets its own poses back explodes, in the paper after about 120 frames: with {share:.0%} of the seeds it does, after "
        f"{frames:.0f} frames in the mean (where it never does, those that were tried)",
        share == 1.0,
    )
    yield ask.claim_better(GRU, AUTOREGRESSIVE, "toe_position_error", "running freely it is worse than the GRU alone")


def _losses(ask: ComparedRows) -> Claims:
    position, velocity, angle = "toe_position_error", "toe_velocity_error", "rotational_error"
    for row, terms in ((PK, "the kinematics term lowers"), (GRU, "both terms together lower")):
        yield ask.claim_better(row, P, position, f"{terms} the error of toe-bases")
        yield ask.claim_better(row, P, velocity, f"{terms} the error of their velocities")
    yield ask.claim_better(GRU, PK, velocity, "the velocity term lowers the error of toe-bases' velocities further")
    yield ask.claim_better(GRU, PK, position, "the error of toe-bases is least with all terms")
    for row in (PK, GRU):
        yield ask.claim_alike(row, P, angle, "the terms do not touch the error of joint angles")


def _marks(ask: ComparedRows) -> Claims:
    for row in (GRU, PRETRAINED):
        if row in ask:
            for measure, mark in TABLE_1.items():
                beaten = _sign(measure) * (ask.mean(row, measure) - mark) > 0.0
                yield (
                    f"{row}: beats the paper's mark on its own data, {mark:g} {UNITS.get(measure, 'cm')}: {ask.text(row, measure)}",
                    beaten,
                )
            yield ask.claim_better(row, MAJORITY_CLASS, "contact_accuracy", f"{row}: is better than always the commoner class")
            for measure in ("rotational_error", "toe_position_error"):
                yield ask.claim_better(row, MEAN_POSE, measure, f"{row}: is better than the mean pose")


def _upright(ask: ComparedRows) -> Claims:
    for measure in ("rotational_error", "toe_position_error"):
        claim = "beyond the paper: thighs told against the upright frame, not against a pelvis whose tilt is not seen, are told better"
        yield ask.claim_better(UPRIGHT, GRU, measure, claim)


def _representations(ask: ComparedRows) -> Claims:
    for measure in ("toe_distance_error", "toe_position_error"):
        best = ask.best((GRU, POSE), measure)
        yield ask.claim_better(COMBINED, best, measure, "with perfect trackers the combined representation is the best")
    for height in USER_HEIGHTS_CM:
        velocity, pose, combined = (user_row(height, how) for how in ("velocity", "pos-ori", "combined"))
        total = "toe_distance_total"
        yield ask.claim_better(velocity, pose, total, f"{height} cm, worn trackers: velocities are better than positions and orientations")
        yield ask.claim_better(velocity, combined, total, f"{height} cm, worn trackers: velocities are better than both together")
        yield ask.claim_better(pose, combined, total, f"{height} cm, worn trackers: both together are the worst")
        claim = f"{height} cm: worn trackers and another size cost velocities less than positions and orientations"
        yield ask.claim_better(velocity, pose, "toe_position_growth", claim)
        yield ask.claim_better(velocity, pose, "contact_accuracy", f"{height} cm, worn trackers: velocities tell contacts better")
    yield from _sitting(ask)


def _sitting(ask: ComparedRows) -> Claims:
    """Yield that sitting down is the exception, for two of three users in the paper."""
    measure = "toe_distance_sit_stand"
    if all(measure in ask.measures(user_row(height, "velocity")) for height in USER_HEIGHTS_CM):
        compared = [
            ask.claim_better(user_row(height, "pos-ori"), user_row(height, "velocity"), measure, f"{height} cm")
            for height in USER_HEIGHTS_CM
        ]
        better = sum(reproduced for _, reproduced in compared)
        claim = (
            f"sitting down is the exception: positions and orientations are better for most users (here {better} of {len(USER_HEIGHTS_CM)})"
        )
        yield f"{claim}; {'; '.join(text for text, _ in compared)}", better > len(USER_HEIGHTS_CM) / 2


def _movement(ask: ComparedRows) -> Claims:
    for height in USER_HEIGHTS_CM:
        velocity, pose = (user_row(height, how) for how in ("velocity", "pos-ori"))
        yield ask.claim_better(
            velocity, pose, "body_movement", f"{height} cm: velocities make the body move more than positions and orientations"
        )


def _six_point(ask: ComparedRows) -> Claims:
    for height in USER_HEIGHTS_CM:
        lobstr, lost = user_row(height, "velocity"), user_row(height, LOST_FEET)
        for measure, when in (("toe_position_error_hidden", "while a foot is hidden"), ("toe_position_error", "over all frames")):
            yield ask.claim_better(
                lobstr, lost, measure, f"{height} cm: LoBSTr is more robust than six-point tracking that loses feet, {when}"
            )


def _sign(measure: str) -> float:
    """Return 1 where more of a measure is better, else -1."""
    return 1.0 if _plain(measure) in MORE_IS_BETTER else -1.0


def _plain(measure: str) -> str:
    """Return a measure's name without its suffix."""
    return next((name for name in UNITS if measure.startswith(name)), measure)


def _text(value: Mapping[str, float], measure: str) -> str:
    return f"{value['mean']:.2f} ± {value['std']:.2f} {UNITS.get(_plain(measure), 'cm')}"
