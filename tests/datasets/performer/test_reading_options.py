"""Mapping files: what they may say, and what is refused."""

from pathlib import Path

import pytest

from configs.errors import InputError
from datasets.performer.reading_options import ReadingOptions, read_mapping


def test_a_mapping_file_says_joints_unit_and_axis(tmp_path: Path) -> None:
    file = tmp_path / "mapping.yaml"
    file.write_text("thigh_l: LeftUpLeg\nunit: 0.0254\nup: -z\n")
    assert read_mapping(file) == ReadingOptions({"thigh_l": "LeftUpLeg"}, 0.0254, "-z")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("thihg_l: LeftUpLeg", "unknown key 'thihg_l', perhaps 'thigh_l'"),
        ("unit: cm", "unit 'cm' should be a positive number"),
        ("unit: -1", "unit '-1' should be a positive number"),
        ("unit: .inf", "unit 'inf' should be a positive number"),
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
