"""Live foot lock of a standing body that is pushed about: positions of the feet frame by frame, worked out by hand."""

import numpy as np
import pytest

from datasets.cleanup.live_foot_lock import RELEASE_FRAMES, LiveFootLock
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import from_axis_angle, from_rotation_vector, rotation_angle
from datasets.motion.t_pose import PELVIS_HEIGHT

TOES = [BODY_NAMES.index("toe_l"), BODY_NAMES.index("toe_r")]
SHINS = [BODY_NAMES.index("shin_l"), BODY_NAMES.index("shin_r")]
LEFT_LEG = [BODY_NAMES.index(name) for name in ("thigh_l", "shin_l", "foot_l")]
ONE = np.array([0])
BOTH, NEITHER, LEFT = np.array([[True, True]]), np.array([[False, False]]), np.array([[True, False]])


def standing(users: int = 1, bend: float = 20.0) -> np.ndarray:
    """Return a pose (users, 20, 4) with knees bent by twice ``bend`` degrees, and the feet level."""
    local = np.zeros((users, 20, 4))
    local[..., 0] = 1.0
    for side in "lr":
        for name, degrees in (("thigh", -bend), ("shin", 2.0 * bend), ("foot", -bend)):
            local[:, BODY_NAMES.index(f"{name}_{side}")] = from_axis_angle(np.array([0.0, 1.0, 0.0]), np.array(np.radians(degrees)))
    return local


def root(x: float = 0.0, y: float = 0.0, z: float = 0.89) -> np.ndarray:
    return np.array([[x, y, z]])


def toes(root_position: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Return where the toe-bases are (n, 2, 3) [m]."""
    return body_poses(BodyMotion(root_position, local, 45.0, "frames"))[0][:, TOES]


def knees(local: np.ndarray) -> np.ndarray:
    """Return the knees' flexion [deg] (n, 2); fails where a knee is no hinge."""
    assert np.all(local[:, SHINS][..., [1, 3]] == 0.0)
    return np.degrees(2.0 * np.arctan2(local[:, SHINS, 2], local[:, SHINS, 0]))


def test_feet_keep_still_while_the_body_sways() -> None:
    hold, pose = LiveFootLock(1), standing()
    start = toes(root(), pose)
    held = hold.step(ONE, root(), pose, BOTH)
    assert held == pytest.approx(pose, abs=1e-12)  # where contact begins, nothing has to change
    place = root()
    for step in range(1, 12):
        place = root(0.008 * step, -0.005 * step, 0.89 - 0.01 * step)
        held = hold.step(ONE, place, pose, BOTH)
        assert toes(place, held) == pytest.approx(start, abs=0.0005)
        assert np.all(knees(held) > 40.0)
        changed = [body for body in range(20) if not np.array_equal(held[0, body], pose[0, body])]
        assert [BODY_NAMES[body] for body in changed] == [f"{name}_{side}" for side in "lr" for name in ("thigh", "shin", "foot")]
    level = body_poses(BodyMotion(place, held, 45.0, "last"))[1][0, LEFT_LEG[2]]
    assert rotation_angle(level) < np.radians(1.0)  # thigh and knee do it, the foot stays level


def test_a_foot_without_contact_is_left_alone() -> None:
    hold, pose = LiveFootLock(1), standing()
    hold.step(ONE, root(), pose, LEFT)
    held = hold.step(ONE, root(0.05), pose, LEFT)
    assert toes(root(0.05), held)[0, 0] == pytest.approx(toes(root(), pose)[0, 0], abs=0.0005)
    assert np.array_equal(np.delete(held, LEFT_LEG, axis=1), np.delete(pose, LEFT_LEG, axis=1))


def test_release_goes_along_a_shifted_sine() -> None:
    # The body has moved on by 0.06 m when contact ends. Of these a toe has made up 1/2 + 1/2 sin(pi (k / 10 - 1/2)) in frame k: half
    # after 5 frames, (1 - cos 36) / 2 = 0.0955 after 2, and all after 10.
    hold, pose = LiveFootLock(1), standing()
    start = toes(root(), pose)[0]
    hold.step(ONE, root(), pose, BOTH)
    hold.step(ONE, root(0.06), pose, BOTH)
    made_up, freed = [], pose
    for _ in range(RELEASE_FRAMES):
        freed = hold.step(ONE, root(0.06), pose, NEITHER)
        made_up.append((toes(root(0.06), freed)[0] - start)[:, 0] / 0.06)
    assert RELEASE_FRAMES == 10
    assert made_up[1] == pytest.approx([0.0955, 0.0955], abs=0.005)
    assert made_up[4] == pytest.approx([0.5, 0.5], abs=0.005)
    assert np.array_equal(freed, pose)


def test_contact_again_while_released_begins_where_the_foot_is_then() -> None:
    hold, pose = LiveFootLock(1), standing()
    freed = hold.step(ONE, root(), pose, BOTH)
    for _ in range(5):
        freed = hold.step(ONE, root(0.06), pose, NEITHER)
    halfway = toes(root(0.06), freed)
    again = hold.step(ONE, root(0.06), pose, BOTH)
    assert np.linalg.norm(toes(root(0.06), again) - halfway, axis=-1).max() < 0.06 * 0.16  # one more frame of the sine
    later = hold.step(ONE, root(0.09), pose, BOTH)
    assert toes(root(0.09), later) == pytest.approx(toes(root(0.06), again), abs=0.0005)


def test_a_leg_too_short_is_straight_and_never_bent_backward() -> None:
    # Straight legs reach PELVIS_HEIGHT; the body is raised 0.15 m over that, so that the toes stay at least 0.15 m short, less what
    # lifting the heels gives: ankle to toe-base is sqrt(0.13^2 + 0.06^2) = 0.143 m long, of which 0.06 m already point down.
    hold, pose = LiveFootLock(1), standing()
    start = toes(root(), pose)
    held, highest = hold.step(ONE, root(), pose, BOTH), PELVIS_HEIGHT + 0.15
    for height in np.linspace(0.89, highest, 30):
        held = hold.step(ONE, root(z=height), pose, BOTH)
        assert np.all(knees(held) >= 0.0)
    short = toes(root(z=highest), held)[0, :, 2] - start[0, :, 2]
    assert np.all(knees(held) < 1.0)
    assert np.all(short > 0.15 - (0.143 - 0.06) - 0.001)
    assert np.all(short < 0.16)


def test_a_knee_that_is_asked_to_bend_backward_is_straight_at_most() -> None:
    hold, pose = LiveFootLock(1), standing(bend=-4.0)
    assert np.all(knees(pose) == pytest.approx(-8.0))
    hold.step(ONE, root(), pose, BOTH)
    assert np.all(knees(hold.step(ONE, root(0.01), pose, BOTH)) >= 0.0)


def test_a_foot_wanted_far_away_is_let_go() -> None:
    hold, pose = LiveFootLock(1), standing()
    start = toes(root(), pose)
    hold.step(ONE, root(), pose, BOTH)
    held = freed = hold.step(ONE, root(0.24), pose, BOTH)
    assert np.all(toes(root(0.24), held)[0, :, 0] < start[0, :, 0] + 0.1)
    for _ in range(RELEASE_FRAMES):
        freed = hold.step(ONE, root(0.27), pose, BOTH)
    assert toes(root(0.27), freed)[0] == pytest.approx(start[0] + [0.27, 0.0, 0.0], abs=0.001)  # though contact lasts
    held = hold.step(ONE, root(0.30), pose, BOTH)
    assert toes(root(0.30), held)[0] == pytest.approx(start[0] + [0.27, 0.0, 0.0], abs=0.001)  # and counts from there


def test_users_do_not_disturb_each_other() -> None:
    rng = np.random.default_rng(0)
    together, alone = LiveFootLock(4), [LiveFootLock(4) for _ in range(3)]
    rows = np.array([2, 0, 3])
    for _ in range(40):
        place = np.array([0.0, 0.0, 0.89]) + rng.uniform(-0.05, 0.05, (3, 3))
        pose = standing(3)
        pose[:, 0] = from_rotation_vector(rng.uniform(-0.2, 0.2, (3, 3)))
        contacts = rng.uniform(size=(3, 2)) < 0.7
        out = together.step(rows, place, pose, contacts)
        for user in range(3):
            mine = slice(user, user + 1)
            assert alone[user].step(rows[mine], place[mine], pose[mine], contacts[mine]) == pytest.approx(out[mine], abs=1e-12)


def test_reset_frees_the_feet_of_some() -> None:
    hold, pose = LiveFootLock(2), standing(2)
    rows, both = np.array([0, 1]), np.ones((2, 2), dtype=bool)
    hold.step(rows, np.repeat(root(), 2, axis=0), pose, both)
    hold.reset(np.array([1]))
    moved = np.repeat(root(0.05), 2, axis=0)
    feet = toes(moved, hold.step(rows, moved, pose, both))[:, :, 0]
    assert feet[1] - feet[0] == pytest.approx([0.05, 0.05], abs=0.0005)
