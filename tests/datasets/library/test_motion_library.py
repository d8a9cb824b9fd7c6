"""Contents of the motion library, worked out by hand; packing, look-up and selection of clips."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.library.motion_library import MAX_HINGE_SPEED_RAD_S, MotionLibrary, axis_velocity
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, HINGE_NAMES, rotations_from_hinges
from datasets.motion.rotation import from_axis_angle, multiply
from tests.builders import STANDING, hinge, posed

Z = np.array([0.0, 0.0, 1.0])
QUARTER_Z = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]  # matrix of 90 degrees about the vertical: x goes to y, y to -x


def gliding(name: str, frames: int, speed: float, performer: str = "ann") -> BodyMotion:
    """Return a T-pose that glides along x at ``speed`` [m/s]."""
    motion = posed({}, frames)
    root = motion.root_position + speed * np.arange(frames)[:, None] / 60.0 * [1.0, 0, 0]
    return replace(motion, root_position=root, name=name, performer=performer)


def turned(degrees: np.ndarray, height: float = STANDING) -> BodyMotion:
    """Return a T-pose that faces ``degrees`` to the left of x, one for each frame."""
    rotations = np.tile([1.0, 0, 0, 0], (len(degrees), 20, 1))
    rotations[:, 0] = from_axis_angle(Z, np.radians(degrees))
    return BodyMotion(np.tile([0.0, 0, height], (len(degrees), 1)), rotations, 60.0, "turned")


def test_clips_stand_one_after_the_other() -> None:
    library = MotionLibrary.from_clips([gliding("one", 40, 1.0), gliding("two", 30, 2.0, "bob")])
    assert [(c.name, c.performer, c.start, c.frames) for c in library.clips] == [("one", "ann", 0, 40), ("two", "bob", 40, 30)]
    assert (len(library), library.fps) == (70, 60.0)
    # Row 43 is frame 3 of the second clip: 2 m/s x 3 / 60 s = 0.1 m. Row 12: 1 m/s x 12 / 60 s = 0.2 m.
    at = library.at(np.array([43, 12]))
    assert np.allclose(at.observed.pos[:, 0], [[0.1, 0, STANDING], [0.2, 0, STANDING]])
    assert np.allclose(at.observed.lin_vel, np.array([[[2.0, 0, 0]], [[1.0, 0, 0]]]), atol=1e-4)
    assert np.allclose(at.observed.com_vel, [[2, 0, 0], [1, 0, 0]], atol=1e-4)
    assert at.observed.pos.dtype == np.float32


def test_velocities_do_not_reach_over_the_edge_of_a_clip() -> None:
    # The first clip ends 1.3 m from where the second begins; a difference across the edge would be tens of m/s.
    library = MotionLibrary.from_clips([gliding("one", 80, 1.0), gliding("two", 30, 2.0)])
    assert np.allclose(library.at(np.array([79, 80])).observed.lin_vel[:, :, 0], [[1.0] * 20, [2.0] * 20], atol=1e-4)


def test_turning_clip_by_hand() -> None:
    # Two degrees a frame at 60 fps are 120 degrees/s = 2.0944 rad/s about the vertical. At frame 45 it faces y.
    library = MotionLibrary.from_clips([turned(np.arange(0.0, 180.0, 2.0))])
    at = library.at(np.array([45]))
    assert np.allclose(at.observed.facing, [[0, 1]], atol=1e-6)
    assert np.allclose(at.rewarded.rot[0], np.tile(QUARTER_Z, (20, 1, 1)), atol=1e-6)
    assert np.allclose(library.start_vel[45, 3:6], [0, 0, 2.0943951], atol=1e-4)
    # The left hand, 0.71 out, points along -x and moves along -y at 0.71 x 2.0944 = 1.487 m/s.
    hand = BODY_NAMES.index("hand_l")
    assert np.allclose(at.observed.pos[0, hand], [-0.71, 0, STANDING + 0.47], atol=1e-5)
    assert np.allclose(at.observed.lin_vel[0, hand], [0, -1.487, 0], atol=2e-3)
    # The tips of the axes: x points along y and moves along -x, y points along -x and moves along -y, z stands still.
    assert np.allclose(at.rewarded.axis_vel[0, hand], 2.0943951 * np.array([[-1, 0, 0], [0, -1, 0], [0, 0, 0]]), atol=1e-4)
    # Relative to its parent nothing turns.
    assert np.allclose(at.rewarded.local_rot[0], np.eye(3), atol=1e-6)


def test_local_rotation_is_relative_to_the_parent() -> None:
    at = MotionLibrary.from_clips([posed({"forearm_l_z": 90.0}, 3)]).at(np.array([1]))
    expected = np.tile(np.eye(3), (19, 1, 1))
    expected[BODY_NAMES.index("forearm_l") - 1] = QUARTER_Z  # the hand turns with it, so not against it
    assert np.allclose(at.rewarded.local_rot[0], expected, atol=1e-6)
    assert np.allclose(at.rewarded.rot[0, BODY_NAMES.index("hand_l")], QUARTER_Z, atol=1e-6)


def test_start_state_is_what_the_engine_asks_for() -> None:
    # Engine: root position and rotation, then hinges; root velocity in the world, angular velocity in the body, then hinges.
    # A body that lies face down (90 degrees about y) and rolls about the vertical at 3 rad/s: its own x axis points down and
    # its own z axis forward, so the vertical is its -x: the rate is (-3, 0, 0) in the body.
    frames = 20
    hinges = np.zeros((frames, 43))
    hinges[:, hinge("shin_l_y")] = 0.5 + 0.6 * np.arange(frames) / 60.0  # rad, 0.6 rad/s
    yaw = from_axis_angle(Z, 3.0 * (np.arange(frames) - 10) / 60.0)
    face_down = from_axis_angle(np.array([0.0, 1, 0]), np.array(np.pi / 2))
    rotations = rotations_from_hinges(multiply(yaw, np.tile(face_down, (frames, 1))), hinges)
    root = np.array([0.0, 0.0, 2.0]) + np.arange(frames)[:, None] / 60.0 * np.array([0.0, 1.2, 0.0])
    library = MotionLibrary.from_clips([BodyMotion(root, rotations, 60.0, "rolling")])
    pose, vel = library.start_pose[10], library.start_vel[10]
    assert np.allclose(pose[:3], [0, 0.2, 2.0])  # 1.2 m/s x 10 / 60 s
    assert np.allclose(pose[3:7], face_down, atol=1e-6)
    assert np.allclose(vel[:6], [0, 1.2, 0, -3, 0, 0], atol=1e-4)
    knee = HINGE_NAMES.index("shin_l_y")
    assert (pose[7 + knee], vel[6 + knee]) == pytest.approx((0.6, 0.6), abs=1e-4)  # 0.5 + 0.6 x 10 / 60
    assert np.count_nonzero(np.abs(pose[7:]) > 1e-6) == 1
    at = library.at(np.array([10]))
    assert np.allclose(at.observed.hinges[0], pose[7:])
    assert np.allclose(at.observed.hinge_vel[0], vel[6:])


def test_start_is_lifted_out_of_the_ground_and_the_reference_is_not() -> None:
    # Soles 0.05 under the ground, or on it: the start stands on it, 0.1 mm in it. Soles 0.05 over it: the start stays there.
    low, level, high = (MotionLibrary.from_clips([turned(np.zeros(3), STANDING + off)]) for off in (-0.05, 0.0, 0.05))
    assert level.start_pose[0, 2] == pytest.approx(STANDING - 1e-4)
    assert low.start_pose[0, 2] == pytest.approx(STANDING - 1e-4)
    assert low.at(np.array([0])).observed.pos[0, 0, 2] == pytest.approx(STANDING - 0.05)
    assert high.start_pose[0, 2] == pytest.approx(STANDING + 0.05)


def test_hinge_speeds_have_a_limit() -> None:
    # 60 degrees from one frame to the next are 1.05 x 60 / 2 = 31 rad/s by central differences.
    motion = posed({}, 5)
    hinges = np.zeros((5, 43))
    hinges[3:, hinge("shin_l_y")] = np.radians(60.0)
    motion = replace(motion, local_rotations=rotations_from_hinges(motion.local_rotations[:, 0], hinges))
    library = MotionLibrary.from_clips([motion])
    assert library.at(np.array([2])).observed.hinge_vel.max() == MAX_HINGE_SPEED_RAD_S == 20.0


def test_truth_is_the_clean_clips_root() -> None:
    clean, faulty = gliding("clean", 10, 1.0), gliding("faulty", 10, 1.6)
    at = MotionLibrary.from_clips([clean, faulty], [clean, clean]).at(np.array([6, 16]))
    # After 6 frames: 1 m/s x 0.1 s and 1.6 m/s x 0.1 s; the truth of both is the clean one's.
    assert np.allclose(at.observed.pos[:, 0, 0], [0.1, 0.16])
    assert np.allclose(at.truth_root[:, 0], [0.1, 0.1])


def test_selected_clips_move_up() -> None:
    library = MotionLibrary.from_clips([gliding("one", 40, 1.0), gliding("two", 30, 2.0), gliding("three", 20, 3.0)])
    part = library.select([False, True, True])
    assert [(c.name, c.start, c.frames) for c in part.clips] == [("two", 0, 30), ("three", 30, 20)]
    # Row 36 is frame 6 of the third clip: 3 m/s x 0.1 s.
    assert part.at(np.array([36])).observed.pos[0, 0, 0] == pytest.approx(0.3)
    assert part.start_pose[36, 0] == pytest.approx(0.3)
    assert library.select([True, True, True]) is library


def test_arrays_bring_the_library_back() -> None:
    library = MotionLibrary.from_clips([gliding("one", 40, 1.0), posed({"shin_l_y": 40.0}, 5)])
    again = MotionLibrary.from_arrays(library.clips, {name: array.copy() for name, array in library.arrays().items()}, 60.0)
    rows = np.array([3, 41])
    one, other = ((*at.observed, *at.rewarded, at.truth_root) for at in (library.at(rows), again.at(rows)))
    for mine, theirs in zip(one, other, strict=True):
        assert np.array_equal(mine, theirs)
    assert np.array_equal(library.start_vel, again.start_vel)


def test_feed_forward_travels_with_the_library() -> None:
    library = MotionLibrary.from_clips([gliding("one", 4, 1.0), gliding("two", 3, 2.0)])
    assert library.feed_forward is None
    assert library.arrays().keys() == {"table", "start_pose", "start_vel"}
    angles = np.arange(7.0 * 43).reshape(7, 43)
    fed = MotionLibrary.from_arrays(library.clips, library.arrays() | {"feed_forward": angles}, 60.0)
    # Of the second clip, frames 4 to 6 of the library, the first is row 4.
    part = fed.select([False, True]).feed_forward
    assert part is not None
    assert part[0, 0] == 4 * 43
    assert np.array_equal(part, angles[4:])
    assert np.array_equal(fed.arrays()["feed_forward"], angles)


def faulty_pair() -> tuple[BodyMotion, BodyMotion]:
    """Return a clean clip that glides at 1 m/s, and a faulty one that drifts by another 0.2 m/s, floats by 5 cm and bends an elbow."""
    clean = gliding("clean", 600, 1.0)
    root = clean.root_position + 0.2 * np.arange(600)[:, None] / 60.0 * [1.0, 0, 0] + [0.0, 0.0, 0.05]
    return clean, replace(posed({"forearm_l_z": 90.0}, 600), root_position=root, name="faulty")


def test_of_a_pair_the_faulty_clip_is_observed_and_the_clean_one_rewarded() -> None:
    clean, faulty = faulty_pair()
    at = MotionLibrary.from_clips([faulty], [clean], paired=True).at(np.array([300]))
    observed, rewarded = at.observed, at.rewarded
    hand = BODY_NAMES.index("hand_l")
    # After 5 s the faulty one is at 1.2 x 5 = 6 m; its hand, 0.25 m beyond an elbow 0.46 to the side, points along -x.
    assert np.allclose(observed.pos[0, 0], [6.0, 0, STANDING + 0.05])
    assert np.allclose(observed.pos[0, hand], [6.0 - 0.25, 0.46, STANDING + 0.05 + 0.47])
    assert np.allclose(observed.lin_vel[0], [1.2, 0, 0], atol=1e-4)
    assert observed.hinges[0, hinge("forearm_l_z")] == pytest.approx(np.pi / 2)
    # The clean one stretches its arm and stands on the ground, and is carried along with the drift.
    assert np.allclose(rewarded.pos[0, 0], [6.0, 0, STANDING], atol=1e-5)
    assert np.allclose(rewarded.pos[0, hand], [6.0, 0.71, STANDING + 0.47], atol=1e-5)
    assert np.allclose(rewarded.lin_vel[0], [1.2, 0, 0], atol=1e-4)
    assert np.allclose(rewarded.local_rot[0], np.eye(3), atol=1e-6)
    # The truth itself was at 5 m.
    assert np.allclose(at.truth_root[0], [5.0, 0, STANDING])


def test_without_pairs_what_is_observed_is_rewarded() -> None:
    clean, faulty = faulty_pair()
    for library, row in (
        (MotionLibrary.from_clips([faulty], [clean]), 300),
        (MotionLibrary.from_clips([faulty, clean], [clean, clean], paired=True), 900),
    ):
        at = library.at(np.array([row]))
        assert np.array_equal(at.rewarded.pos, at.observed.pos)
        assert np.array_equal(at.rewarded.lin_vel, at.observed.lin_vel)
        assert np.allclose(at.truth_root[0], [5.0, 0, STANDING])
    elbow = BODY_NAMES.index("forearm_l") - 1
    assert np.allclose(MotionLibrary.from_clips([faulty], [clean]).at(np.array([300])).rewarded.local_rot[0, elbow], QUARTER_Z, atol=1e-6)


def test_library_is_read_only_and_lookups_are_the_callers() -> None:
    library = MotionLibrary.from_clips([gliding("one", 4, 1.0)])
    with pytest.raises(ValueError, match="read-only"):
        library.frames.observed.pos[0, 0, 0] = 9.0
    with pytest.raises(ValueError, match="read-only"):
        library.start_pose[0, 0] = 9.0
    at = library.at(np.array([0]))
    at.observed.pos[:] = 9.0
    assert library.at(np.array([0])).observed.pos[0, 0, 0] == 0.0


def test_bad_sets_of_clips_are_refused() -> None:
    with pytest.raises(ValueError, match="at least one clip"):
        MotionLibrary.from_clips([])
    with pytest.raises(ValueError, match="differ in their frame rate"):
        MotionLibrary.from_clips([gliding("one", 4, 1.0), replace(gliding("two", 4, 1.0), fps=30.0)])
    with pytest.raises(ValueError, match="faulty and its clean clip differ in length"):
        MotionLibrary.from_clips([gliding("faulty", 4, 1.0)], [gliding("clean", 5, 1.0)])


def test_axis_velocity_by_hand() -> None:
    # About z at 2 rad/s: x's tip moves along y at 2 m/s, y's along -x, z's not at all.
    assert np.allclose(axis_velocity(np.array([0.0, 0, 2]), np.eye(3)), [[0, -2, 0], [2, 0, 0], [0, 0, 0]])
