"""Sizes, slices and refusals of the task's variants."""

from itertools import pairwise

import pytest

from datasets.motion.humanoid import BODY_NAMES, HINGES
from envs.mimic.spec import MimicSpec, action_table, observation_table


def test_the_thesis_observes_273_numbers() -> None:
    # Table 4.1: 3 + 3 + 3 + 2 + 2 + 60 + 60 + 60 + 60 + 20.
    spec = MimicSpec()
    assert list(spec.observation_parts.values()) == [3, 3, 3, 2, 2, 60, 60, 60, 60, 20]
    assert (spec.observation_size, spec.action_size) == (273, 20)


def test_slices_follow_each_other() -> None:
    slices = MimicSpec(com_error=True, com_height=True, preview=(1, 3)).observation_slices
    edges = [(part.start, part.stop) for part in slices.values()]
    assert edges[0] == (0, 3)
    assert all(before[1] == after[0] for before, after in pairwise(edges))
    assert slices["body_pos"] == slice(13, 73)
    assert slices["smoothed_action"] == slice(253, 273)
    # 3 numbers of the centre of mass, 2 x 60 of the bodies ahead, 1 height.
    assert slices["com_pos_error"] == slice(273, 276)
    assert slices["preview_body_pos"] == slice(276, 396)
    assert slices["com_height"] == slice(396, 397)


def test_other_configurations() -> None:
    # drecon: six bodies, 13 + 4 x 18 + 20. full: all hinges, 13 + 4 x 60 + 43.
    drecon, full = MimicSpec("drecon"), MimicSpec("full")
    assert (drecon.observation_size, drecon.action_size) == (105, 20)
    assert [BODY_NAMES[b] for b in drecon.observed_bodies] == ["pelvis", "head", "hand_l", "hand_r", "foot_l", "foot_r"]
    assert (full.observation_size, full.action_size) == (296, 43)


def test_residuals_leave_the_spine_alone() -> None:
    # docs/errata.md: thighs 3 + 3, shins 1 + 1, feet 3 + 3, upper arms 3 + 3.
    bodies = [BODY_NAMES[HINGES[h][0]] for h in MimicSpec().residual_hinges]
    counts = {name: bodies.count(f"{name}_l") for name in ("thigh", "shin", "foot", "upper_arm")}
    assert counts == {"thigh": 3, "shin": 1, "foot": 3, "upper_arm": 3}
    assert [b.removesuffix("_l") for b in bodies if b.endswith("_l")] == [b.removesuffix("_r") for b in bodies if b.endswith("_r")]
    assert len(bodies) == 20


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("configuration", "adapd", "configuration is 'adapd', should be one of adapt, drecon, full"),
        ("frame", "body", "frame is 'body', should be world or heading"),
        ("smoothing", 0.0, "smoothing is 0.0, should be above 0 and at most 1"),
        ("smoothing", 1.1, "smoothing is 1.1"),
        ("action_scale", -1.0, "action_scale is -1.0, should be above 0"),
        ("action_scale", float("nan"), "action_scale is nan"),
        ("foot_slip", -0.1, "foot_slip is -0.1, should be 0 or more"),
        ("foot_slip", float("nan"), "foot_slip is nan, should be 0 or more"),
        ("action_rate", -1.0, "action_rate is -1.0, should be 0 or more"),
        ("preview", (1, 0), r"preview is \[1, 0\], should hold positive numbers"),
    ],
)
def test_bad_values_are_refused(field: str, value: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        MimicSpec(**{field: value})  # type: ignore[arg-type]


def test_preview_may_come_as_a_list() -> None:
    assert MimicSpec(preview=[1, 2]).preview == (1, 2)  # type: ignore[arg-type]


def test_tables_name_every_part_and_every_action() -> None:
    rows = observation_table(MimicSpec()).splitlines()
    assert len(rows) == 2 + 10
    assert rows[-1].startswith("| smoothed_action | 253 | 273 | 1 |")
    rows = action_table(MimicSpec(action_scale=3.0)).splitlines()
    assert len(rows) == 2 + 20
    assert rows[2].endswith("| 3 rad |")
