"""Mapping files: what they may say, and what is refused."""

from pathlib import Path

import pytest

from configs.errors import InputError
from datasets.performer.reading_options import ReadingOptions, read_mapping


def test_a_mapping_file_says_joints_unit_and_axis(tmp_path: Path) -> None:
    file = tmp_path / "mapping.yaml"
    file.write_text("thigh_l: LeftUpLeg\nunit: 0.0254\nup: -z\n")
    assert read_mapping(file) == ReadingOptions({"thigh_l": "LeftUpLeg"}, 0.0254, "-z")


def test_a_joint_is_called_what_the_file_says_whatever_yaml_takes_it_for(tmp_path: Path) -> None:
    file = tmp_path / "mapping.yaml"
    file.write_text("head: 01\nthigh_l: no\nthigh_r: 2026-01-01\nchest: ~\nspine: '\u982d'\n", encoding="utf-8")
    assert read_mapping(file).joints == {"head": "01", "thigh_l": "no", "thigh_r": "2026-01-01", "chest": "~", "spine": "\u982d"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("thihg_l: LeftUpLeg", "unknown key 'thihg_l', perhaps 'thigh_l'"),
        ("unit: cm", "unit 'cm' should be a positive number"),
        ("unit: -1", "unit '-1' should be a positive number"),
        ("unit: .inf", "unit '.inf' should be a positive number"),
        ("unit: " + 5000 * "9", "'unit' should have one word or name of at most 200"),
        ("head:", "'head' should have one word or name"),
        ("head: [Head, Hips]", "'head' should have one word or name"),
        ('head: "one\\ntwo"', "'head' should have one word or name"),
        ('"one\\ntwo": Head', "unknown key 'one"),
        ("head: " + 5000 * "[", "too deeply nested"),
        ("head: " + 300_000 * "x", "300006 bytes are too long for a mapping file, 262144 are the most"),
        ("head: &a [x, x]\nthigh_l: &b [*a, *a]\nthigh_r: [*b, *b]", "'head' should have one word or name"),
        ("up: north", "up 'north' should be one of x, y, z, -x, -y, -z"),
        ("[1, 2]", "holds lines like"),
        ("a: [", "not a readable mapping file"),
    ],
)
def test_a_bad_mapping_file_is_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "mapping.yaml"
    file.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_mapping(file)
    assert "\n" not in str(caught.value)
    assert str(file) in str(caught.value)
