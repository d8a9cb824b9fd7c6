"""Mirrored clips of a library: the same numbers as of the mirrored motion."""

import numpy as np

from datasets.imu.suit_simulation import simulate_suit
from datasets.library.mirrored_library import with_mirrored_clips
from datasets.library.motion_library import MotionLibrary, table_parts
from datasets.motion.humanoid import HINGE_COUNT
from datasets.motion.mirror import mirror_motion
from datasets.synthetic.clips import synthetic_clips
from envs.physics.inverse_dynamics import with_feed_forward
from tests.builders import hinge, posed


def test_the_mirrored_half_is_the_library_of_the_mirrored_motion() -> None:
    clean = synthetic_clips(seed=3)[0].cut(0, 90)
    faulty = simulate_suit(clean, seed=1).faulty
    library = with_feed_forward(MotionLibrary.from_clips([clean, faulty], [clean, clean], paired=True))
    twins = [mirror_motion(clip) for clip in (clean, faulty)]
    expected = with_feed_forward(MotionLibrary.from_clips(twins, [twins[0], twins[0]], paired=True))
    found = with_mirrored_clips(library).select([False, False, True, True])
    assert [clip.name for clip in found.clips] == [clip.name for clip in expected.clips]
    for name, part in table_parts(found.table).items():
        assert np.allclose(part, table_parts(expected.table)[name], atol=2e-4), name
    facing = np.sign(np.sum(found.start_pose[:, 3:7] * expected.start_pose[:, 3:7], axis=1))  # of a rotation's two quaternions
    assert np.allclose(found.start_pose[:, 3:7] * facing[:, None], expected.start_pose[:, 3:7], atol=1e-5)
    assert np.allclose(np.delete(found.start_pose, np.s_[3:7], axis=1), np.delete(expected.start_pose, np.s_[3:7], axis=1), atol=1e-5)
    assert np.allclose(found.start_vel, expected.start_vel, atol=2e-4)
    assert found.feed_forward is not None and expected.feed_forward is not None
    assert np.allclose(found.feed_forward, expected.feed_forward, atol=1e-3)


def test_a_left_arm_turned_about_x_becomes_a_right_one_turned_the_other_way() -> None:
    library = with_mirrored_clips(MotionLibrary.from_clips([posed({"upper_arm_l_x": 30.0, "shin_r_y": 20.0}, 2)]))
    assert [(clip.name, clip.start, clip.frames) for clip in library.clips] == [("posed", 0, 2), ("posed_mirrored", 2, 2)]
    hinges = np.degrees(table_parts(library.table)["hinges"][2])
    expected = np.zeros(HINGE_COUNT)
    expected[hinge("upper_arm_r_x")], expected[hinge("shin_l_y")] = -30.0, 20.0
    assert np.allclose(hinges, expected, atol=1e-4)
