"""ASF/AMC: poses are those that the format means, the skeleton is found, what lacks is said, bad files get one clear line."""

import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from configs.errors import InputError
from datasets.formats.asf_amc import read_asf_amc
from datasets.formats.bvh import Bvh, local_pose, read_bvh, write_bvh
from datasets.library.sources import load_clips
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses
from datasets.motion.skeleton import forward_kinematics
from datasets.performer.performer_clip import load_performer_clip
from datasets.performer.reading_options import ReadingOptions
from datasets.retarget.retarget import retarget
from tests.datasets.formats.acclaim_files import ARM, STILL, mutate_acclaim, rows, write_arm, write_person


def ends(bvh: Bvh, frame: int = 0) -> np.ndarray:
    """Return where the root, the upper and the lower bone begin, and where the lower one ends, shape (4, 3)."""
    positions, rotations = forward_kinematics(bvh.parents, *local_pose(bvh))
    (tip,) = bvh.end_sites[2]
    x, y, z, w = rotations[frame, 2, 1], rotations[frame, 2, 2], rotations[frame, 2, 3], rotations[frame, 2, 0]
    turn = np.array(  # of the unit quaternion, from the textbook
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    return np.concat([positions[frame], [positions[frame, 2] + turn @ tip]])


def test_everything_the_files_say(tmp_path: Path) -> None:
    bvh = read_asf_amc(write_arm(tmp_path, rows((1, 2, 3, *STILL[3:]), STILL)))
    assert bvh.names == ("root", "upper", "lower")
    assert bvh.parents == (-1, 0, 1)
    assert [len(channels) for channels in bvh.channels] == [6, 3, 3]
    assert bvh.frame_time == pytest.approx(1 / 120)
    assert bvh.stated.unit == pytest.approx(0.056444, abs=1e-6)  # an inch over 0.45
    # Where nothing turns, the bones lie along x, two and then three long.
    np.testing.assert_allclose(ends(bvh, 1), [[0, 0, 0], [0, 0, 0], [2, 0, 0], [5, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(ends(bvh, 0), [[1, 2, 3], [1, 2, 3], [3, 2, 3], [6, 2, 3]], atol=1e-12)


def test_bones_turn_about_their_own_axes(tmp_path: Path) -> None:
    # Their axes are a quarter turn about z from the skeleton's: their x is the skeleton's y, about which a quarter turn takes x to -z.
    upper, both = (*STILL[:6], 90, 0, 0, 0), (*STILL[:6], 90, 0, 0, 90)
    bvh = read_asf_amc(write_arm(tmp_path, rows(upper, both)))
    np.testing.assert_allclose(ends(bvh, 0), [[0, 0, 0], [0, 0, 0], [0, 0, -2], [0, 0, -5]], atol=1e-9)
    # Two quarter turns about y take the lower bone's x to -x.
    np.testing.assert_allclose(ends(bvh, 1), [[0, 0, 0], [0, 0, 0], [0, 0, -2], [-3, 0, -2]], atol=1e-9)


def test_two_bones_by_hand(tmp_path: Path) -> None:
    """The plane arm of every textbook: all of it turns about z, the root by a, the upper bone by b and the lower by c."""
    skeleton = ARM.replace("dof rx\n", "dof rz\n")  # their z is the skeleton's
    a, b, c = 20.0, 35.0, -50.0
    bvh = read_asf_amc(write_arm(tmp_path, rows((4, 5, 6, 0, 0, a, 0, 0, b, c)), skeleton))
    one, two = np.radians(a + b), np.radians(a + b + c)
    elbow = (4 + 2 * np.cos(one), 5 + 2 * np.sin(one), 6)
    hand = (elbow[0] + 3 * np.cos(two), elbow[1] + 3 * np.sin(two), 6)
    np.testing.assert_allclose(ends(bvh), [[4, 5, 6], [4, 5, 6], elbow, hand], atol=1e-9)


@pytest.mark.parametrize(
    ("axis", "freedom", "turns", "direction", "expected"),
    [
        # Turns are about fixed axes in the order of the file: x first takes y to z, which the turn about z leaves.
        ("0 0 0 XYZ", "rx ry rz", (90, 0, 90), "0 1 0", (0, 0, 2)),
        # z first takes y to -x, which the turn about x leaves.
        ("0 0 0 XYZ", "rz ry rx", (90, 0, 90), "0 1 0", (-2, 0, 0)),
        # So are the axes': x first takes their z to -y, then z takes that to x; a quarter turn about x takes y to z.
        ("90 0 90 XYZ", "rx ry rz", (0, 0, 90), "0 1 0", (0, 0, 2)),
        # z first leaves their z, then x takes it to -y; a quarter turn about -y takes x to z.
        ("90 0 90 ZYX", "rx ry rz", (0, 0, 90), "1 0 0", (0, 0, 2)),
    ],
)
def test_orders_of_axes(tmp_path: Path, axis: str, freedom: str, turns: tuple[int, ...], direction: str, expected: tuple[int, ...]) -> None:
    skeleton = ARM.replace("0 0 90 XYZ", axis, 1).replace("rx ry rz", freedom).replace("direction 1 0 0", f"direction {direction}", 1)
    bvh = read_asf_amc(write_arm(tmp_path, rows((*STILL[:6], *turns, 0)), skeleton))
    np.testing.assert_allclose(ends(bvh)[2], expected, atol=1e-9)


def test_radians_presets_and_the_order_of_the_root(tmp_path: Path) -> None:
    quarter, ordered = np.pi / 2, ARM.replace("TX TY TZ RX RY RZ", "RZ TX TZ TY RX RY")
    skeleton = ordered.replace("angle deg", "angle rad").replace("0 0 90 XYZ", f"0 0 {quarter} XYZ")
    motion = rows((quarter, 1, 3, 2, 0, 0, quarter, 0, 0, 0)).replace(":DEGREES\n", "")
    bvh = read_asf_amc(write_arm(tmp_path, motion, skeleton.replace("position 0 0 0", "position 10 0 0")))
    # The arm points to -z, as above; the root's quarter turn about z leaves that. Its preset position counts, too.
    np.testing.assert_allclose(ends(bvh), [[11, 2, 3], [11, 2, 3], [11, 2, 1], [11, 2, -2]], atol=1e-9)
    with_header = read_asf_amc(
        write_arm(tmp_path, motion.replace(":FULLY", ":RADIANS\n:FULLY"), ARM.replace("TX TY TZ RX RY RZ", "RZ TX TZ TY RX RY"))
    )
    np.testing.assert_allclose(ends(with_header)[2], [1, 2, 1], atol=1e-9)


def test_curves_go_on_beyond_half_a_turn(tmp_path: Path) -> None:
    frames = [(*STILL[:5], turn, *STILL[6:]) for turn in range(0, 720, 30)]
    bvh = read_asf_amc(write_arm(tmp_path, rows(*frames)))
    np.testing.assert_allclose(bvh.values[:, 3], range(0, 720, 30), atol=1e-6)  # Zrotation of the root


def test_what_was_read_is_written_as_bvh(tmp_path: Path) -> None:
    bvh = read_asf_amc(write_arm(tmp_path, rows((1, 2, 3, 4, 5, 6, 7, 8, 9, 10), STILL)))
    write_bvh(tmp_path / "out.bvh", bvh)
    again = read_bvh(tmp_path / "out.bvh")
    np.testing.assert_array_equal(again.values, bvh.values)
    assert (again.names, again.end_sites) == (bvh.names, bvh.end_sites)


@pytest.mark.parametrize(
    ("name", "given", "header", "fps", "told"),
    [
        ("arm_01", None, "", 120, "120 fps was taken, the rate of the CMU and HDM05 databases"),
        ("60_01", None, "", 60, "60 fps was taken, the rate of this subject of CMU"),
        ("61_12", None, "", 60, "60 fps was taken"),
        ("6_01", None, "", 120, "120 fps was taken"),
        ("60_01", 90.0, "", 90, ""),
        ("arm_01", None, ":SAMPLES-PER-SECOND 100\n", 100, ""),
    ],
)
def test_the_frame_rate(tmp_path: Path, name: str, given: float | None, header: str, fps: float, told: str) -> None:
    bvh = read_asf_amc(write_arm(tmp_path, header + rows(STILL), name=name), fps=given)
    assert bvh.frame_time == pytest.approx(1 / fps)
    said = [line for line in bvh.notices if "fps" in line]
    assert [told in line for line in said] == ([True] if told else [])


def test_the_skeleton_is_that_of_the_subject(tmp_path: Path) -> None:
    write_arm(tmp_path, rows(STILL), name="hdm_bd_cartwheel_120")
    motion = tmp_path / "hdm_bd_cartwheel_120.amc"
    assert "The skeleton is that of arm.asf." in read_asf_amc(motion).notices  # the only one
    for name in ("HDM_bd", "hdm_b", "hdm", "other"):
        (tmp_path / f"{name}.ASF").write_text(
            ARM.replace("name upper", f"name {name}").replace("root upper", f"root {name}").replace("upper lower", f"{name} lower")
        )
    with pytest.raises(InputError, match=r"'upper' is no bone"):  # of the longest name that the file's begins with
        read_asf_amc(motion)
    motion.write_text(rows(STILL).replace("upper", "HDM_bd"))
    assert read_asf_amc(motion).names[1] == "HDM_bd"
    assert read_asf_amc(motion.rename(tmp_path / "hdm_bdx.amc"), tmp_path / "HDM_bd.ASF").names[1] == "HDM_bd"
    (tmp_path / "hdm.ASF").unlink()
    with pytest.raises(InputError, match=r"hdm_bdx.amc: none of 4 ASF files beside it begins its name; .* '--skeleton hdm_bdx.asf'"):
        read_asf_amc(tmp_path / "hdm_bdx.amc")
    (tmp_path / "alone").mkdir()
    lonely = (tmp_path / "hdm_bdx.amc").rename(tmp_path / "alone" / "hdm_bdx.amc")
    with pytest.raises(InputError, match="there is no ASF file beside it"):
        read_asf_amc(lonely)


def test_what_lacks_or_is_strange_is_told(tmp_path: Path) -> None:
    motion = rows(STILL, STILL, STILL).replace("\n3\n", "\n7\n").replace("lower 0\n", "")
    skeleton = ARM.replace("dof rx\n", "dof rx l\n").replace("orientation 0 0 0", "orientation 0 0 90")
    bvh = read_asf_amc(write_arm(tmp_path, motion + "8\nroot 0 0 0 0 0 0\nupper 1 2", skeleton))
    assert len(bvh.values) == 3
    for line in (
        "The last frame is cut off and was left out.",
        "The numbers of the frames have gaps or repeat; the frames were taken one after the other.",
        "The motion says nothing of 'lower'; these keep the skeleton's pose.",
        "Bones that move or stretch ('lower') were read with the skeleton's lengths.",
        "The skeleton gives its root an orientation; it was taken as one before the motion's.",
    ):
        assert line in bvh.notices
    np.testing.assert_allclose(ends(bvh)[2:], [[0, 2, 0], [0, 5, 0]], atol=1e-9)  # turned to y


def test_missing_values_are_filled(tmp_path: Path) -> None:
    frames = [(number, *STILL[1:]) for number in range(4)]
    bvh = read_asf_amc(write_arm(tmp_path, rows(*frames).replace("root 1 0", "root nan 0")))
    np.testing.assert_allclose(bvh.values[:, 0], range(4))
    assert any("filled between their neighbours (frames 2)" in line for line in bvh.notices)


@pytest.mark.parametrize(
    ("skeleton", "motion", "message"),
    [
        ("", rows(STILL), r"arm.asf: 0 bytes long"),
        (ARM.replace(":hierarchy", ":tree"), rows(STILL), rf"arm.asf, line {len(ARM.splitlines())}: the file ends without :hierarchy"),
        (ARM.replace("angle deg", "angle turns"), rows(STILL), r"arm.asf, line 7: 'turns' stands where deg or rad"),
        (ARM.replace("length 0.45", "length 0"), rows(STILL), "a length unit of 0; it should be positive"),
        (ARM.replace("XYZ\n    dof", "XYY\n    dof", 1), rows(STILL), "'XYY' stands where an order of axes"),
        (ARM.replace("dof rx ry rz", "dof rx rx"), rows(STILL), "'rx' is no degree of freedom or stands twice"),
        (ARM.replace("direction 1 0 0", "direction 1 0", 1), rows(STILL), "2 words stand where three numbers"),
        (ARM.replace("direction 1 0 0", "direction 1 0 nan", 1), rows(STILL), "'nan' is out of range"),
        (ARM.replace("length 2", "length far"), rows(STILL), "'far' is not a number"),
        (ARM.replace("name lower", "name upper"), rows(STILL), r"the bone of line 27 has no name, or another's \('upper'\)"),
        (ARM.replace("    upper lower\n", ""), rows(STILL), "bone 'lower' does not hang under the root"),
        (ARM.replace("root upper", "lower upper"), rows(STILL), "bone 'upper' does not hang under the root"),
        (ARM.replace("root upper", "root upper lower"), rows(STILL), "'lower' hangs under a second bone"),
        (ARM.replace("upper lower", "upper wing"), rows(STILL), "'wing' is no bone of :bonedata"),
        (ARM, "", r"arm_01.amc: 0 bytes long"),
        (ARM, ":DEGREES\n", "the file ends where the number of a frame should stand"),
        (ARM, "root 0 0 0 0 0 0\n", "'root' stands where the number of the first frame should stand"),
        (ARM, rows(STILL, STILL).replace("lower 0", "lower 0 0", 1), r"arm_01.amc, line 7: 2 values where bone 'lower' should have 1"),
        (ARM, rows(STILL, STILL).replace("lower", "wing", 1), "'wing' is no bone of the skeleton"),
        (ARM, rows(STILL, STILL, STILL).replace("2\nroot 0 0 0 0 0 0\n", "2\n"), "frame 2 holds 2 bones, the first 3"),
        (ARM, rows(STILL, STILL).replace("lower 0", "lower x", 1), "'x' is not a number"),
        (ARM, rows((1e7, *STILL[1:])), r"the value 1e\+07 is out of range"),
        (ARM, ":FPS 0\n" + rows(STILL), "a frame rate of 0; it should lie from 1 to 10000"),
    ],
)
def test_what_is_broken_is_named_with_its_line(tmp_path: Path, skeleton: str, motion: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read_asf_amc(write_arm(tmp_path, motion, skeleton))
    assert "\n" not in str(caught.value)


def test_files_that_are_not_there_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none.amc: no such file"):
        read_asf_amc(tmp_path / "none.amc")
    with pytest.raises(InputError, match=r"none.asf: no such file"):
        read_asf_amc(write_arm(tmp_path, rows(STILL)), tmp_path / "none.asf")


@pytest.mark.parametrize("seed", range(4))
def test_damaged_files_are_refused_in_one_line_or_are_clips(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    motion = write_arm(tmp_path, rows(*[tuple(rng.uniform(-90, 90, 10).round(3)) for _ in range(20)]))
    skeleton, refused = tmp_path / "arm.asf", 0
    whole = {file: file.read_bytes() for file in (motion, skeleton)}
    tracemalloc.start()
    for _ in range(100):
        chosen = (motion, skeleton)[rng.integers(2)]
        chosen.write_bytes(mutate_acclaim(whole[chosen], rng))
        try:
            bvh = read_asf_amc(motion)
        except InputError as error:
            refused += 1
            assert "\n" not in str(error)
            assert "arm" in str(error)
        else:
            assert np.isfinite(bvh.values).all()
        chosen.write_bytes(whole[chosen])
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert 20 < refused < 95
    assert peak < 300 * 2**20


def test_a_person_of_cmu_is_read_from_names_and_unit_to_the_pose(tmp_path: Path) -> None:
    bent = write_person(tmp_path, {"ltibia": "90"})
    clip = load_performer_clip(bent)
    assert clip.unit == pytest.approx(0.0254 / 0.45)
    assert clip.up_axis == "y"
    assert clip.motion.fps == 120.0
    names = clip.motion.skeleton.names
    joints = {body: names[joint] for body, joint in clip.joint_map.items()}
    limbs = {
        "thigh": "femur",
        "shin": "tibia",
        "foot": "foot",
        "toe": "toes",
        "collar": "clavicle",
        "upper_arm": "humerus",
        "forearm": "radius",
    }
    assert {f"{limb}_{side}": joints[f"{limb}_{side}"] for limb in limbs for side in "lr"} == {
        f"{limb}_{side}": f"{side}{bone}" for limb, bone in limbs.items() for side in "lr"
    }
    assert (joints["pelvis"], joints["head"]) == ("root", "head")
    # Whatever the axes of the bones are: at rest the shin hangs down. Its x is tilted by 20 degrees against the skeleton's, about z, so
    # that a bend of 90 degrees about it lifts the shin from straight down to straight back, but for what the tilt leaves.
    positions, _ = body_poses(retarget(clip).motion)
    knee, ankle = (positions[0, BODY_NAMES.index(body)] for body in ("shin_l", "foot_l"))
    assert (ankle - knee)[0] < -0.3  # m, behind: we face x
    right = positions[0, BODY_NAMES.index("foot_r")] - positions[0, BODY_NAMES.index("shin_r")]
    assert right[2] == pytest.approx(-0.41, abs=0.02)  # m, our shin
    assert abs(right[0]) < 0.05


def test_a_stated_unit_that_nobody_fits_is_not_believed(tmp_path: Path) -> None:
    motion = write_person(tmp_path, {}, scale=5.6444, length="1.0")  # in cm, but stated as inches
    clip = load_performer_clip(motion)
    assert clip.unit == 0.01
    assert any("The unit that the file states, inch (legs would be 2.1 m), was not believed" in line for line in clip.notices)
    assert load_performer_clip(motion, ReadingOptions(unit=0.02)).unit == 0.02


def test_a_folder_of_a_database_is_a_motion_source(tmp_path: Path) -> None:
    write_person(tmp_path, {})
    (clip,) = load_clips(tmp_path)
    assert (clip.name, len(clip), clip.fps) == ("05_12", 60, 60.0)
