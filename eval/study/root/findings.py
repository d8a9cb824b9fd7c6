"""Which findings of the thesis (2.5, 3.5) the rows of the root study repeat: directions, by more than seeds differ."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from agents.root.path import FULL_ORDER
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
    WALK_CONTACTS,
    WALK_OWN_ROOT,
)

MIN_SPREAD_OVER_MEAN = 5.0  # least standard deviation over mean error: all of Table 2.1 reaches it
MAX_STAIRS_ERROR_CM = 5.0  # cm
Finding = dict[str, Any]


class _Rows:
    """The rows by name, to be asked for values."""

    def __init__(self, rows: list[dict[str, Any]]) -> None:
        self._ours = {row["name"]: row["ours"] for row in rows}
        self.published = {row["name"]: row["published"] for row in rows}

    def __call__(self, name: str, measure: str) -> float:
        """Return the mean of a measure."""
        return self._ours[name][measure]["mean"]

    def spread(self, name: str, measure: str) -> float:
        """Return the standard deviation of a measure over seeds."""
        return self._ours[name][measure]["std"]

    def less(self, name: str, other: str, measure: str) -> bool:
        """Return whether a measure of one row is less than another row's, by more than either one's seeds differ."""
        return self(other, measure) - self(name, measure) > max(self.spread(name, measure), self.spread(other, measure))

    def text(self, name: str, measure: str, decimals: int) -> str:
        """Return mean and standard deviation."""
        return f"{self(name, measure):.{decimals}f} ± {self.spread(name, measure):.{decimals}f}"

    def performers(self, name: str) -> list[str]:
        """Return who is measured one by one."""
        return [key.removeprefix("drift_of_") for key in self._ours[name] if key.startswith("drift_of_")]


def root_findings(rows: list[dict[str, Any]]) -> list[Finding]:
    """Return each finding with the numbers that decide it."""
    ask = _Rows(rows)
    parts = (_networks, _targets, _heights, _data, _poses, _accelerations, _orders, _errors, _performers, _marks, _real_walk)
    return [{"finding": text, "reproduced": bool(reproduced)} for part in parts for text, reproduced in part(ask)]


Claims = Iterator[tuple[str, bool]]


def _networks(ask: _Rows) -> Claims:
    for unet, cnn, what in ((UNET, CNN, "all motion"), (UNET_RWI, CNN_RWI, "run-walk-idle")):
        better = all(ask.less(unet, cnn, f"sigma_{axis}") for axis in "fl")
        numbers = " and ".join(f"{ask(unet, f'sigma_{axis}'):.3f} against {ask(cnn, f'sigma_{axis}'):.3f}" for axis in "fl")
        yield f"{what}: the U-Net's errors per frame spread less than the CNN's, forward and lateral: {numbers} cm", better
        yield (
            f"{what}: the U-Net drifts less than the CNN: {ask.text(unet, 'end_error', 1)} against {ask.text(cnn, 'end_error', 1)} cm "
            "off in the plane at the end of 10 s",
            ask.less(unet, cnn, "end_error"),
        )


def _targets(ask: _Rows) -> Claims:
    yield (
        "the centre of mass is a better target than the root once both are integrated: "
        f"{ask.text(UNET, 'end_error', 1)} against {ask.text(ROOT_TARGET, 'end_error', 1)} cm off in the plane at the end of 10 s "
        "(the thesis, one clip: 1.5 against 58)",
        ask.less(UNET, ROOT_TARGET, "end_error"),
    )


def _heights(ask: _Rows) -> Claims:
    absolute, added = ([ask(name, f"height_error_{half}_half") for half in ("first", "second")] for name in (UNET, DISPLACEMENT))
    yield (
        "an absolute height does not drift, added-up displacements do: error of the height in the first and the second half of long clips "
        f"{absolute[0]:.1f} and {absolute[1]:.1f} cm against {added[0]:.1f} and {added[1]:.1f} cm",
        absolute[1] - absolute[0] < added[1] - added[0] and added[1] > added[0],
    )
    air, ground = ask(UNET, "height_error_in_air"), ask(UNET, "height_error_on_ground")
    yield (
        f"the planar model's height fails in long jumps: {air:.1f} cm off in the air, {ground:.1f} cm on the ground "
        f"(Root3D with optical poses, whose height is added up: {ask(ROOT3D_OPTICAL, 'height_error_in_air'):.1f} and "
        f"{ask(ROOT3D_OPTICAL, 'height_error_on_ground'):.1f} cm)",
        air > ground,
    )


def _data(ask: _Rows) -> Claims:
    for what, better, worse, sentence in (
        ("gaits", UNET_RWI, UNET, "specialised on run, walk and idle, a U-Net is a little better at running and walking"),
        ("dances", UNET, UNET_RWI, "trained on all motion, it is better at dances, which the specialised one never saw"),
    ):
        numbers = f"{ask.text(better, f'e_mse_{what}', 4)} against {ask.text(worse, f'e_mse_{what}', 4)} m²"
        yield f"{sentence}: e_mse {numbers}", ask.less(better, worse, f"e_mse_{what}")
    yield (
        f"over all clips the one of all motion is better: e_mse {ask.text(UNET, 'e_mse', 4)} against {ask.text(UNET_RWI, 'e_mse', 4)} m²",
        ask.less(UNET, UNET_RWI, "e_mse"),
    )


def _poses(ask: _Rows) -> Claims:
    seen, worse = ask(UNET, "e_mse"), ask(UNET, "e_mse_on_imu_poses")
    yield f"a planar model of optical poses is worse on those of suits: e_mse {seen:.4f} against {worse:.4f} m²", seen < worse
    learnt = ask(UNET_IMU, "e_mse")
    yield f"it improves on those when it learns from them (expected in 2.6): e_mse {worse:.4f}, then {learnt:.4f} m²", learnt < worse
    yield (
        f"Root3D is better with optical poses than with those of suits: e_mse {ask.text(ROOT3D_OPTICAL, 'e_mse', 4)} against "
        f"{ask.text(ROOT3D_IMU, 'e_mse', 4)} m² "
        f"(thesis: {ask.published[ROOT3D_OPTICAL]['e_mse']} against {ask.published[ROOT3D_IMU]['e_mse']})",
        ask.less(ROOT3D_OPTICAL, ROOT3D_IMU, "e_mse"),
    )


def _accelerations(ask: _Rows) -> Claims:
    yield (
        "without accelerations trajectories from a suit's poses become clearly worse, by at least a half: e_mse "
        f"{ask.text(ROOT3D_ALONE, 'e_mse', 4)} against {ask.text(ROOT3D_IMU, 'e_mse', 4)} m²",
        ask(ROOT3D_ALONE, "e_mse") > 1.5 * ask(ROOT3D_IMU, "e_mse"),
    )
    without, ratio = ask(ROOT3D_ALONE, "distance_ratio"), ask(ROOT3D_IMU, "distance_ratio")
    yield (
        f"without accelerations they undershoot: {without:.3f} of the true way, with them {ratio:.3f}",
        without < min(1.0, ratio),
    )


def _orders(ask: _Rows) -> Claims:
    for name in (ROOT3D_OPTICAL, ROOT3D_IMU):
        errors = [ask(name, f"e_mse_w{order}") for order in range(FULL_ORDER + 1)]
        numbers = " ".join(f"{error:.5f}" for error in errors)
        yield f"{name}: e_mse falls from w = 0 to w = {FULL_ORDER}: {numbers} m²", errors[-1] < errors[0]
        first, last = ask(name, "e_mse_std_w0"), ask(name, f"e_mse_std_w{FULL_ORDER}")
        yield f"{name}: its spread over windows falls too: {first:.5f} to {last:.5f} m²", last < first


def _errors(ask: _Rows) -> Claims:
    for name in (UNET, ROOT3D_OPTICAL, ROOT3D_IMU):
        ratios = {axis: ask(name, f"sigma_{axis}") / abs(ask(name, f"mu_{axis}")) for axis in AXES}
        numbers = ", ".join(f"{ratio:.0f} {what}" for ratio, what in zip(ratios.values(), ("forward", "lateral", "vertical"), strict=True))
        yield (
            f"{name}: errors per frame are centred, their spread at least {MIN_SPREAD_OVER_MEAN:.0f} times their mean: {numbers}",
            min(ratios.values()) >= MIN_SPREAD_OVER_MEAN,
        )


def _performers(ask: _Rows) -> Claims:
    for name in (ROOT3D_OPTICAL, ROOT3D_IMU):
        people = ask.performers(name)
        rises = [ask(name, f"rise_of_{person}") for person in people]
        between, seeds = float(np.std(rises)), float(np.mean([ask.spread(name, f"rise_of_{person}") for person in people]))
        numbers = ", ".join(
            f"{person} {rise:+.2f} cm/s and {100 * ask(name, f'drift_of_{person}'):.1f} % of the way"
            for person, rise in zip(people, rises, strict=True)
        )
        yield (
            f"{name}: performers have drifts of their own, vertical ones further apart between people ({between:.2f} cm/s) than between "
            f"seeds ({seeds:.2f} cm/s): {numbers}",
            between > seeds,
        )


def _marks(ask: _Rows) -> Claims:
    for name, thesis, measure, what in (
        (ROOT3D_OPTICAL, ROOT3D_OPTICAL, "e_mse", ""),
        (ROOT3D_IMU, ROOT3D_IMU, "e_mse", ""),
        (PRETRAINED_OPTICAL, ROOT3D_OPTICAL, "e_mse_filtered", ", after its filters"),
        (PRETRAINED_IMU, ROOT3D_IMU, "e_mse_filtered", ", after its filters"),
    ):
        mark = ask.published[thesis]["e_mse"]
        yield (
            f"{name}{what}: e_mse is under that of the thesis on its own data: {ask.text(name, measure, 4)} against {mark} m²; "
            f"motionless it is {ask(MOTIONLESS, 'e_mse'):.3f}",
            ask(name, measure) < mark,
        )
        yield (
            f"{name}: stairs are followed within a few centimetres: {ask.text(name, 'stairs_error', 1)} cm off at their end, "
            f"{ask(name, 'stairs_ratio'):.2f} of the true height",
            ask(name, "stairs_error") <= MAX_STAIRS_ERROR_CM,
        )


def _real_walk(ask: _Rows) -> Claims:
    for name, filtered, how in ((ROOT3D_IMU, "", ""), (PRETRAINED_IMU, "_filtered", ", after its filters,")):
        for measure, what, unit, factor, decimals in (
            ("walk_drift", "ends nearer to the truth", "% of the way", 100.0, 1),
            ("walk_e_mse", "stays nearer to the truth (e_mse)", "m²", 1.0, 4),
            ("walk_e_mse_turned", "stays nearer to the truth once paths are turned onto it (e_mse)", "m²", 1.0, 4),
        ):
            ours, own, contacts = (
                factor * ask(who, key) for who, key in ((name, measure + filtered), (WALK_OWN_ROOT, measure), (WALK_CONTACTS, measure))
            )
            yield (
                f"{name}{how} {what} of the real walk than the suit's own root and than foot contacts: {ours:.{decimals}f} against "
                f"{own:.{decimals}f} and {contacts:.{decimals}f} {unit}",
                ours < min(own, contacts),
            )
