"""The findings of the root study: each follows from the numbers, and from nothing else."""

import json
from typing import Any

import pytest

from eval.study.framework.page import summarise_seeds
from eval.study.root.findings import root_findings
from eval.study.root.variants import (
    PRETRAINED_IMU,
    PRETRAINED_OPTICAL,
    ROOT3D_ALONE,
    ROOT3D_IMU,
    ROOT_TARGET,
    UNET,
    UNET_IMU,
    UNET_RWI,
    VARIANTS,
)

Rows = list[dict[str, Any]]


def thesis_rows() -> Rows:
    """Return rows in which everything is as the thesis found it."""
    base = {
        **{f"mu_{axis}": 0.01 for axis in "flv"}, **{f"sigma_{axis}": 0.2 for axis in "flv"}, "end_error": 10.0, "e_mse": 0.01,
        "e_mse_filtered": 0.01,
        "e_mse_gaits": 0.02, "e_mse_dances": 0.02, "e_mse_on_imu_poses": 0.05, "distance_ratio": 1.0, "drift": 0.1,
        "height_error_first_half": 2.0, "height_error_second_half": 2.0, "height_error_in_air": 9.0, "height_error_on_ground": 3.0,
        "stairs_error": 2.0, "stairs_ratio": 1.0, "walk_drift": 0.05, "walk_e_mse": 0.1, "walk_e_mse_turned": 0.001,
        "walk_drift_filtered": 0.05, "walk_e_mse_filtered": 0.1, "walk_e_mse_turned_filtered": 0.001,
        "drift_of_ann": 0.1, "drift_of_bob": 0.1, "rise_of_ann": -1.0, "rise_of_bob": 1.0,
        **{f"e_mse_w{w}": 0.01 - 0.001 * w for w in range(8)}, **{f"e_mse_std_w{w}": 0.01 - 0.001 * w for w in range(8)},
    }  # fmt: skip
    changes: dict[str, dict[str, float]] = {
        "u-net, run-walk-idle": {"e_mse_gaits": 0.01, "e_mse_dances": 0.04, "e_mse": 0.02},
        "u-net, root as target": {"end_error": 20.0},
        "u-net, vertical displacement": {"height_error_second_half": 8.0},
        ROOT3D_ALONE: {"e_mse": 0.1, "distance_ratio": 0.6},
        "Root3D, optical poses and accelerations": {"e_mse": 0.004},
        PRETRAINED_OPTICAL: {"e_mse_filtered": 0.004},
        PRETRAINED_IMU: {},
        "motionless root": {"e_mse": 2.0},
        "the real walk, the suit's own root": {"walk_drift": 0.2, "walk_e_mse": 0.2, "walk_e_mse_turned": 0.002},
        "the real walk, foot contacts": {"walk_drift": 0.1, "walk_e_mse": 0.3, "walk_e_mse_turned": 0.003},
        **{f"CNN, {data}": {"end_error": 20.0, "sigma_f": 0.3, "sigma_l": 0.3} for data in ("all", "run-walk-idle")},
    }
    published = {model.name: model.published for model in VARIANTS}
    names = dict.fromkeys([*published, *changes])
    return [
        {"name": name, "ours": summarise_seeds([{**base, **changes.get(name, {})}]), "published": published.get(name, {})} for name in names
    ]


def test_the_thesis_repeats_itself() -> None:
    found = root_findings(thesis_rows())
    assert [one["finding"] for one in found if not one["reproduced"]] == []
    assert len(found) >= 20
    json.dumps(found)


@pytest.mark.parametrize(
    ("row", "measure", "value", "says"),
    [
        (UNET, "sigma_l", 0.4, "errors per frame spread less"),
        (UNET, "end_error", 25.0, "drifts less than the CNN"),
        (UNET, "end_error", 25.0, "better target than the root"),
        (UNET, "height_error_second_half", 9.0, "does not drift"),
        (UNET, "height_error_in_air", 2.0, "fails in long jumps"),
        (UNET_RWI, "e_mse_gaits", 0.03, "a little better at running"),
        (UNET_RWI, "e_mse_dances", 0.001, "better at dances"),
        (ROOT3D_IMU, "e_mse", 0.003, "better with optical poses"),
        (ROOT3D_IMU, "e_mse", 0.03, "under that of the thesis"),
        (ROOT3D_ALONE, "e_mse", 0.014, "without accelerations trajectories"),  # only 1.4 times as much
        (ROOT3D_ALONE, "distance_ratio", 1.1, "undershoot"),
        (ROOT3D_IMU, "e_mse_w7", 0.02, "falls from w = 0"),
        (ROOT3D_IMU, "mu_v", -0.1, "centred"),
        (ROOT3D_IMU, "rise_of_ann", 1.0, "drifts of their own"),
        (ROOT3D_IMU, "stairs_error", 6.0, "few centimetres"),
        (ROOT3D_IMU, "walk_drift", 0.15, "ends nearer to the truth"),
        (ROOT3D_IMU, "walk_e_mse_turned", 0.0025, "turned onto it"),
        (PRETRAINED_IMU, "walk_e_mse_filtered", 0.25, "after its filters, stays nearer"),
        (PRETRAINED_OPTICAL, "e_mse_filtered", 0.005, "after its filters: e_mse is under that of the thesis"),
    ],
)
def test_a_finding_that_the_numbers_contradict_is_not_reproduced(row: str, measure: str, value: float, says: str) -> None:
    rows = thesis_rows()
    next(one for one in rows if one["name"] == row)["ours"][measure]["mean"] = value
    assert any(says in one["finding"] and not one["reproduced"] for one in root_findings(rows))


def reproduced(rows: Rows, says: str) -> list[bool]:
    return [one["reproduced"] for one in root_findings(rows) if says in one["finding"]]


@pytest.mark.parametrize(("spread", "expected"), [((4.0, 5.0), True), ((6.0, 5.0), False), ((0.0, 11.0), False)])
def test_a_difference_counts_where_it_is_more_than_both_deviations_together(spread: tuple[float, float], expected: bool) -> None:
    # 10 against 20 cm off, as the thesis found: more than 4 + 5, less than 6 + 5 though more than the larger of these, less than 11.
    rows = thesis_rows()
    for name, std in zip((UNET, ROOT_TARGET), spread, strict=True):
        next(one for one in rows if one["name"] == name)["ours"]["end_error"]["std"] = std
    assert reproduced(rows, "better target than the root") == [expected]


@pytest.mark.parametrize(
    ("row", "measure", "std", "says", "expected"),
    [
        (UNET_IMU, "e_mse", 0.03, "improves on those", [True]),  # 0.01 against 0.05 of the other model on the same poses: 0.04 apart
        (UNET_IMU, "e_mse", 0.05, "improves on those", [False]),
        (ROOT3D_ALONE, "e_mse", 0.1, "without accelerations trajectories", [False]),  # 0.1 against 0.01: 0.09 apart
        (ROOT3D_ALONE, "distance_ratio", 0.3, "undershoot", [True]),  # 0.6 against 1.0: 0.4 apart
        (ROOT3D_ALONE, "distance_ratio", 0.5, "undershoot", [False]),
        (ROOT3D_IMU, "walk_drift", 0.04, "ends nearer to the truth", [True, True]),  # 0.05 against 0.1 of foot contacts
        (ROOT3D_IMU, "walk_drift", 0.06, "ends nearer to the truth", [False, True]),  # the shipped model is the second
        (ROOT3D_IMU, "e_mse_w7", 0.1, "IMU poses and accelerations: e_mse falls", [True]),  # the same networks: no rows are compared
    ],
)
def test_all_comparisons_of_rows_go_by_the_same_rule(row: str, measure: str, std: float, says: str, expected: list[bool]) -> None:
    rows = thesis_rows()
    next(one for one in rows if one["name"] == row)["ours"][measure]["std"] = std
    assert reproduced(rows, says) == expected
