"""A clip on the 20 bodies as a BVH of its own: positions of the bodies, and reading it back."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.formats.bvh import read_bvh, write_bvh
from datasets.imu.suit_simulation import simulate_suit
from datasets.library.sources import load_clips
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import conjugate, from_axis_angle, multiply, rotate, rotation_angle
from datasets.performer.performer_clip import performer_clip_from_bvh
from datasets.retarget.humanoid_bvh import to_humanoid_bvh
from datasets.retarget.retarget import retarget
from tests.builders import lively, posed

UP = np.array([0.0, 0.0, 1.0])


def turned(motion: BodyMotion, radians: np.ndarray) -> BodyMotion:
    """Return a clip that is turned about the vertical by an angle a frame (T,)."""
    local = motion.local_rotations.copy()
    local[:, 0] = multiply(from_axis_angle(np.broadcast_to(UP, (len(motion), 3)), radians), local[:, 0])
    return replace(motion, local_rotations=local)


def test_places_and_turns_by_hand() -> None:
    # 2 m forward, 1 m to the left, hips at 0.94 m, facing left. Our (x, y, z) are the file's (z, x, y), in cm.
    still = posed({"shin_l_y": 30.0})
    there = replace(still, root_position=np.tile([2.0, 1.0, 0.94], (30, 1)))
    bvh = to_humanoid_bvh(turned(there, np.full(30, 0.5 * np.pi)))
    expected = np.zeros((30, 63))
    expected[:, :6] = 100.0, 94.0, 200.0, 0.0, 0.0, 90.0  # places, then turns about Z, X, Y
    expected[:, 3 + 3 * BODY_NAMES.index("shin_l") + 1] = 30.0  # about our y, the file's x
    assert bvh.values == pytest.approx(expected, abs=1e-9)
    assert bvh.names == BODY_NAMES
    assert bvh.offsets[BODY_NAMES.index("thigh_l")] == pytest.approx([9.0, -3.0, 0.0])
    assert bvh.end_sites[BODY_NAMES.index("head")] == ((0.0, 26.0, 4.0),)  # twice (0.02, 0, 0.13) m
    assert bvh.end_sites[BODY_NAMES.index("chest")] == ()
    assert bvh.frame_time == 1.0 / 60.0


def test_curves_do_not_jump_where_somebody_turns_round_and_round() -> None:
    # Three turns in 120 frames: 9 degrees from frame to frame.
    still = posed({}, frames=121)
    bvh = to_humanoid_bvh(turned(still, np.linspace(0.0, 6.0 * np.pi, 121)))
    assert np.diff(bvh.values[:, 5]) == pytest.approx(9.0, abs=1e-9)


def test_reading_gives_the_clip_back(tmp_path: Path) -> None:
    # It begins above the origin, faces x and stands on the ground, so that nothing is to be calibrated away.
    clip = lively()
    write_bvh(tmp_path / "clip.bvh", to_humanoid_bvh(clip))
    found = retarget(performer_clip_from_bvh(read_bvh(tmp_path / "clip.bvh"), "clip"))
    assert (found.scale, found.performer_clip.unit, found.performer_clip.up_axis) == (pytest.approx(1.0), 0.01, "y")
    assert found.motion.fps == clip.fps
    assert found.motion.root_position == pytest.approx(clip.root_position, abs=1e-6)
    assert body_poses(found.motion)[0] == pytest.approx(body_poses(clip)[0], abs=1e-6)
    assert np.degrees(rotation_angle(multiply(conjugate(found.motion.local_rotations), clip.local_rotations))).max() < 1e-3


@pytest.mark.shared_data
@pytest.mark.parametrize("name", ["cmu/test/cmu_salsa_30", "noncommercial/bandai/test/bnr_dataset-2_walk_feminine_001"])
@pytest.mark.parametrize("suited", [False, True])
def test_real_clips_come_back_but_for_what_reading_calibrates(shared_data: Path, name: str, suited: bool) -> None:
    """Measured on cmu/test and bandai/test: joints within 0.2 mm on average of clean clips, 1.1 mm of a suit's; one height for all frames.

    What differs is the tilt of a suit's feet, which reading takes for the sensors' and takes away, and toes that stab into the ground.
    """
    (clean,) = load_clips(shared_data / f"{name}.bvh")
    clip = simulate_suit(clean, 0).faulty if suited else clean
    found = retarget(performer_clip_from_bvh(to_humanoid_bvh(clip), "clip"))
    assert len(found.motion) == len(clip)
    turn = np.broadcast_to(from_axis_angle(UP, np.array(-found.yaw)), (len(clip), len(BODY_NAMES), 4))
    back, own = body_poses(found.motion)[0], rotate(turn, body_poses(clip)[0])
    assert back[:, 0] - own[:, 0] == pytest.approx(np.tile((back - own)[0, 0], (len(clip), 1)), abs=1e-6)
    apart = np.linalg.norm((back - back[:, :1]) - (own - own[:, :1]), axis=-1)
    assert apart.mean() < (2e-3 if suited else 2e-4)
