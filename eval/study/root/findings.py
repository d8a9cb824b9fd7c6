"""Findings of the thesis (2.5, 3.5) that the rows of the root study repeat.

``eval.study.framework.seed_comparison`` has the rule for all comparisons between rows. Comparisons within a row (orders, halves of clips,
air and ground, two kinds of poses: the same networks on the same seeds) and with fixed marks go by the mean.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from agents.root.path import FULL_ORDER
from eval.study.framework.seed_comparison import Claims, ComparedRows, Finding, as_findings
from eval.study.root.scores import AXES
from eval.study.root.variants import (
    CNN,
    CNN_RWI,
    DISPLACEMENT,
    MOTIONLESS,
    PRETRAINED_IMU,
    PRETRAINED_OPTICAL,
    ROOT3D_ALONE,
    ROOT3D_IMU,
    ROOT3D_OPTICAL,
    ROOT_TARGET,
    UNET,
    UNET_IMU,
    UNET_RWI,
    VARIANTS,
    WALK_CONTACTS,
    WALK_OWN_ROOT,
)

MIN_SPREAD_OVER_MEAN = 5.0  # least standard deviation over mean error: all of Table 2.1 reaches it
MAX_STAIRS_ERROR_CM = 5.0
PUBLISHED = {variant.name: variant.published for variant in VARIANTS}
CM_MEASURES = ("end_error", "stairs_error")  # printed with one decimal, m² with four


def root_findings(rows: list[dict[str, Any]]) -> list[Finding]:
    """Return each finding with the numbers that decide it."""
    ask = ComparedRows(rows, lambda _: -1.0, _text)  # more of a measure is never better here
    parts = (_networks, _targets, _heights, _data, _poses, _accelerations, _orders, _errors, _performers, _marks, _real_walk)
    return as_findings(found for part in parts for found in part(ask))


def _networks(ask: ComparedRows) -> Claims:
    for unet, cnn, what in ((UNET, CNN, "all motion"), (UNET_RWI, CNN_RWI, "run-walk-idle")):
        better = all(ask.is_less(unet, cnn, f"sigma_{axis}") for axis in "fl")
        numbers = " and ".join(f"{ask.mean(unet, f'sigma_{axis}'):.3f} against {ask.mean(cnn, f'sigma_{axis}'):.3f}" for axis in "fl")
        yield f"{what}: the U-Net's errors per frame spread less than the CNN's, forward and lateral: {numbers} cm", better
        yield (
            f"{what}: the U-Net drifts less than the CNN: {ask.text(unet, 'end_error')} against {ask.text(cnn, 'end_error')} cm "
            "off in the plane at the end of 10 s",
            ask.is_less(unet, cnn, "end_error"),
        )


def _targets(ask: ComparedRows) -> Claims:
    yield (
        "the centre of mass is a better target than the root once both are integrated: "
        f"{ask.text(UNET, 'end_error')} against {ask.text(ROOT_TARGET, 'end_error')} cm off in the plane at the end of 10 s "
        "(the thesis, one clip: 1.5 against 58)",
        ask.is_less(UNET, ROOT_TARGET, "end_error"),
    )


def _heights(ask: ComparedRows) -> Claims:
    absolute, added = ([ask.mean(name, f"height_error_{half}_half") for half in ("first", "second")] for name in (UNET, DISPLACEMENT))
    yield (
        "an absolute height does not drift, added-up displacements do: error of the height in the first and the second half of long clips "
        f"{absolute[0]:.1f} and {absolute[1]:.1f} cm against {added[0]:.1f} and {added[1]:.1f} cm",
        absolute[1] - absolute[0] < added[1] - added[0] and added[1] > added[0],
    )
    air, ground = ask.mean(UNET, "height_error_in_air"), ask.mean(UNET, "height_error_on_ground")
    yield (
        f"the planar model's height fails in long jumps: {air:.1f} cm off in the air, {ground:.1f} cm on the ground "
        f"(Root3D with optical poses, whose height is added up: {ask.mean(ROOT3D_OPTICAL, 'height_error_in_air'):.1f} and "
        f"{ask.mean(ROOT3D_OPTICAL, 'height_error_on_ground'):.1f} cm)",
        air > ground,
    )


def _data(ask: ComparedRows) -> Claims:
    for what, better, worse, sentence in (
        ("gaits", UNET_RWI, UNET, "specialised on run, walk and idle, a U-Net is a little better at running and walking"),
        ("dances", UNET, UNET_RWI, "trained on all motion, it is better at dances, which the specialised one never saw"),
    ):
        numbers = f"{ask.text(better, f'e_mse_{what}')} against {ask.text(worse, f'e_mse_{what}')} m²"
        yield f"{sentence}: e_mse {numbers}", ask.is_less(better, worse, f"e_mse_{what}")
    yield (
        f"over all clips the one of all motion is better: e_mse {ask.text(UNET, 'e_mse')} against {ask.text(UNET_RWI, 'e_mse')} m²",
        ask.is_less(UNET, UNET_RWI, "e_mse"),
    )


def _poses(ask: ComparedRows) -> Claims:
    seen, worse = ask.mean(UNET, "e_mse"), ask.mean(UNET, "e_mse_on_imu_poses")
    yield f"a planar model of optical poses is worse on those of suits: e_mse {seen:.4f} against {worse:.4f} m²", seen < worse
    yield (
        f"it improves on those when it learns from them (expected in 2.6): e_mse {worse:.4f}, then {ask.mean(UNET_IMU, 'e_mse'):.4f} m²",
        ask.is_less(UNET_IMU, UNET, "e_mse", "e_mse_on_imu_poses"),
    )
    yield (
        f"Root3D is better with optical poses than with those of suits: e_mse {ask.text(ROOT3D_OPTICAL, 'e_mse')} against "
        f"{ask.text(ROOT3D_IMU, 'e_mse')} m² "
        f"(thesis: {PUBLISHED[ROOT3D_OPTICAL]['e_mse']} against {PUBLISHED[ROOT3D_IMU]['e_mse']})",
        ask.is_less(ROOT3D_OPTICAL, ROOT3D_IMU, "e_mse"),
    )


def _accelerations(ask: ComparedRows) -> Claims:
    yield (
        "without accelerations trajectories from a suit's poses become clearly worse, by at least a half: e_mse "
        f"{ask.text(ROOT3D_ALONE, 'e_mse')} against {ask.text(ROOT3D_IMU, 'e_mse')} m²",
        ask.is_less(ROOT3D_IMU, ROOT3D_ALONE, "e_mse") and ask.mean(ROOT3D_ALONE, "e_mse") > 1.5 * ask.mean(ROOT3D_IMU, "e_mse"),
    )
    without, ratio = ask.mean(ROOT3D_ALONE, "distance_ratio"), ask.mean(ROOT3D_IMU, "distance_ratio")
    yield (
        f"without accelerations they undershoot: {without:.3f} of the true way, with them {ratio:.3f}",
        ask.is_less(ROOT3D_ALONE, ROOT3D_IMU, "distance_ratio") and without < 1.0,
    )


def _orders(ask: ComparedRows) -> Claims:
    for name in (ROOT3D_OPTICAL, ROOT3D_IMU):
        errors = [ask.mean(name, f"e_mse_w{order}") for order in range(FULL_ORDER + 1)]
        numbers = " ".join(f"{error:.5f}" for error in errors)
        yield f"{name}: e_mse falls from w = 0 to w = {FULL_ORDER}: {numbers} m²", errors[-1] < errors[0]
        first, last = ask.mean(name, "e_mse_std_w0"), ask.mean(name, f"e_mse_std_w{FULL_ORDER}")
        yield f"{name}: its spread over windows falls too: {first:.5f} to {last:.5f} m²", last < first


def _errors(ask: ComparedRows) -> Claims:
    for name in (UNET, ROOT3D_OPTICAL, ROOT3D_IMU):
        ratios = {axis: ask.mean(name, f"sigma_{axis}") / abs(ask.mean(name, f"mu_{axis}")) for axis in AXES}
        numbers = ", ".join(f"{ratio:.0f} {what}" for ratio, what in zip(ratios.values(), ("forward", "lateral", "vertical"), strict=True))
        yield (
            f"{name}: errors per frame are centred, their spread at least {MIN_SPREAD_OVER_MEAN:.0f} times their mean: {numbers}",
            min(ratios.values()) >= MIN_SPREAD_OVER_MEAN,
        )


def _performers(ask: ComparedRows) -> Claims:
    for name in (ROOT3D_OPTICAL, ROOT3D_IMU):
        people = [measure.removeprefix("drift_of_") for measure in ask.measures(name) if measure.startswith("drift_of_")]
        rises = [ask.mean(name, f"rise_of_{person}") for person in people]
        between, seeds = float(np.std(rises)), float(np.mean([ask.std(name, f"rise_of_{person}") for person in people]))
        numbers = ", ".join(
            f"{person} {rise:+.2f} cm/s and {100 * ask.mean(name, f'drift_of_{person}'):.1f} % of the way"
            for person, rise in zip(people, rises, strict=True)
        )
        yield (
            f"{name}: performers have drifts of their own, vertical ones further apart between people ({between:.2f} cm/s) than between "
            f"seeds ({seeds:.2f} cm/s): {numbers}",
            between > seeds,
        )


def _marks(ask: ComparedRows) -> Claims:
    for name, thesis, measure, what in (
        (ROOT3D_OPTICAL, ROOT3D_OPTICAL, "e_mse", ""),
        (ROOT3D_IMU, ROOT3D_IMU, "e_mse", ""),
        (PRETRAINED_OPTICAL, ROOT3D_OPTICAL, "e_mse_filtered", ", after its filters"),
        (PRETRAINED_IMU, ROOT3D_IMU, "e_mse_filtered", ", after its filters"),
    ):
        mark = PUBLISHED[thesis]["e_mse"]
        yield (
            f"{name}{what}: e_mse is under that of the thesis on its own data: {ask.text(name, measure)} against {mark} m²; "
            f"motionless it is {ask.mean(MOTIONLESS, 'e_mse'):.3f}",
            ask.mean(name, measure) < mark,
        )
        yield (
            f"{name}: stairs are followed within a few centimetres: {ask.text(name, 'stairs_error')} cm off at their end, "
            f"{ask.mean(name, 'stairs_ratio'):.2f} of the true height",
            ask.mean(name, "stairs_error") <= MAX_STAIRS_ERROR_CM,
        )


def _real_walk(ask: ComparedRows) -> Claims:
    for name, filtered, how in ((ROOT3D_IMU, "", ""), (PRETRAINED_IMU, "_filtered", ", after its filters,")):
        for measure, what, unit, factor, decimals in (
            ("walk_drift", "ends nearer to the truth", "% of the way", 100.0, 1),
            ("walk_e_mse", "stays nearer to the truth (e_mse)", "m²", 1.0, 4),
            ("walk_e_mse_turned", "stays nearer to the truth once paths are turned onto it (e_mse)", "m²", 1.0, 4),
        ):
            ours, own, contacts = (
                factor * ask.mean(who, key) for who, key in ((name, measure + filtered), (WALK_OWN_ROOT, measure), (WALK_CONTACTS, measure))
            )
            yield (
                f"{name}{how} {what} of the real walk than the suit's own root and than foot contacts: {ours:.{decimals}f} against "
                f"{own:.{decimals}f} and {contacts:.{decimals}f} {unit}",
                all(ask.is_less(name, other, measure + filtered, measure) for other in (WALK_OWN_ROOT, WALK_CONTACTS)),
            )


def _text(value: Mapping[str, float], measure: str) -> str:
    decimals = 1 if measure in CM_MEASURES else 4
    return f"{value['mean']:.{decimals}f} ± {value['std']:.{decimals}f}"
