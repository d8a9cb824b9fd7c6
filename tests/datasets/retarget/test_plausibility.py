"""What a recording cannot be is told in a line with the option that mends it; what may be is not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.formats.bvh import Bvh
from datasets.performer.performer_clip import performer_clip_from_bvh
from datasets.performer.reading_options import ReadingOptions
from datasets.retarget.plausibility import find_implausible
from datasets.retarget.read_as import describe_reading
from datasets.retarget.retarget import retarget
from tests.builders import STANDING, as_bvh, in_axes, lively, posed

MIRRORED = np.diag([-1.0, 1.0, 1.0])


def told(bvh: Bvh, reading: ReadingOptions | None = None) -> tuple[str, ...]:
    return find_implausible(retarget(performer_clip_from_bvh(bvh, "clip", reading)))


def pitched(degrees: float) -> Bvh:
    clip = posed({})
    local = clip.local_rotations.copy()
    local[:, 0] = Rotation.from_euler("y", degrees, degrees=True).as_quat(scalar_first=True)
    return as_bvh(replace(clip, local_rotations=local))


def test_a_good_clip_is_not_doubted() -> None:
    assert told(as_bvh(lively())) == ()
    assert told(as_bvh(posed({}))) == ()


def test_left_and_right_exchanged() -> None:
    mirrored = in_axes(as_bvh(lively()), MIRRORED)
    (line,) = told(mirrored)
    assert line.startswith("Knees bend forward and toes point backward")
    assert line.endswith("--mirror.")
    assert told(mirrored, ReadingOptions(mirror=True)) == ()
    assert told(as_bvh(lively()), ReadingOptions(mirror=True))[0].endswith("leave out --mirror.")


def test_without_toes_the_way_tells_of_a_mirrored_file() -> None:
    bare = as_bvh(lively(), without=("toe_l", "toe_r"))
    bare = replace(bare, end_sites=((),) * len(bare.names))
    assert told(bare) == ()
    assert told(in_axes(bare, MIRRORED))[0].startswith("Knees bend forward and the way leads backward")


def test_who_walks_backward_is_not_mirrored() -> None:
    clip = lively()
    back = clip.root_position * (-1.0, 1.0, 1.0)
    assert told(as_bvh(replace(clip, root_position=back))) == ()


def test_upside_down_and_lying() -> None:
    (line,) = told(pitched(180.0))
    assert line == "The head is under the pelvis in 100% of the take. If nobody stands on their hands, name the axis: --up -y."
    (line,) = told(pitched(90.0))  # face down, the head ahead: along the file's z
    assert line == "Somebody lies or crawls in 100% of the take. If they stand, name the axis that points up: --up z."
    assert told(pitched(90.0), ReadingOptions(up_axis="y")) == ()
    assert told(pitched(45.0)) == ()


def test_an_animal() -> None:
    bvh = as_bvh(posed({}))
    offsets = bvh.offsets.copy()
    offsets[bvh.names.index("Spine1")] *= 8.0  # a trunk of 0.10 + 1.36 + 0.27 m over legs of 0.83 m: 2.1
    (line,) = told(replace(bvh, offsets=offsets))
    assert line.startswith("No human is so: the trunk 2.1 of the legs' length.")
    assert "head 'Head'" in line
    assert told(replace(bvh, offsets=offsets), ReadingOptions(joints={"head": "Head"})) == ()


@pytest.mark.parametrize(("fps", "says"), [(600.0, "At 600 fps"), (4.0, "4 fps are no capture system's rate"), (120.0, None), (30.0, None)])
def test_rates_that_nobody_can_have(fps: float, says: str | None) -> None:
    """Arms that swing by 30 degrees at 1.2 Hz at 60 fps: hands of 0.68 m reach 0.68 x 0.52 x 7.5 = 2.7 m/s, 27 m/s at 600 fps."""
    time = np.arange(120) / 60.0
    bvh = as_bvh(posed({}, frames=120))
    values = bvh.values.copy()
    for name in ("LeftArm", "RightArm"):
        values[:, 3 + 3 * bvh.names.index(name)] = 30.0 * np.sin(2 * np.pi * 1.2 * time)
    found = told(replace(bvh, values=values, frame_time=1.0 / fps))
    assert [line.startswith(says or "") for line in found] == ([True] if says else [])
    if says:
        assert found[0].endswith("60 fps are likely: --fps 60.")
    assert told(replace(bvh, values=values, frame_time=1.0 / fps), ReadingOptions(fps=60.0)) == ()


def test_the_line_that_says_what_was_taken() -> None:
    sunk = as_bvh(posed({}, height=STANDING - 0.4), up="z", unit=0.001)
    read = describe_reading(retarget(performer_clip_from_bvh(sunk, "clip")))
    assert read == "read as: Z up, mm, 60 fps, facing +X, ground at -0.40 m, joints by name, retargeting error 0 mm"
    said = ReadingOptions({"head": "Head"}, unit=0.001, up_axis="z", fps=50.0, mirror=False, zero_ground=True)
    read = describe_reading(retarget(performer_clip_from_bvh(sunk, "clip", said)))
    assert read == "read as: Z up, mm, 50 fps, facing +X, ground at -0.40 m, put on 0, joints by name and mapping, retargeting error 0 mm"
