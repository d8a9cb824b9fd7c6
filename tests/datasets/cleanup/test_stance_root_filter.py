"""Anti-skate filter: standing feet keep still, else the root moves as predicted; level ground stays level, stairs are climbed."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.cleanup.stance_root_filter import LEVEL_CORRECTION_S, StanceRootFilter, apply_stance_root_filter, relative_soles
from datasets.ik.leg_ik import SHIN_LENGTH_M, THIGH_LENGTH_M
from datasets.imu.suit_simulation import simulate_suit
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import HINGE_COUNT, rotations_from_hinges
from datasets.motion.kinematics import body_poses, sole_points
from datasets.motion.rotation import heading
from datasets.synthetic import clips as synthetic
from datasets.synthetic.movement_style import draw_movement_style
from tests.builders import STANDING, hinge, posed

BIAS = np.array([0.006, -0.006, 0.005])  # m/s, of a root that drifts by 1 cm a second


def asked(still: BodyMotion, velocity: np.ndarray) -> BodyMotion:
    """Return the clip whose root is asked to move with ``velocity`` (T - 1, 3) or (3,) [m/s]."""
    steps = np.broadcast_to(velocity, (len(still) - 1, 3)) / still.fps
    path = still.root_position[0] + np.concat([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    return replace(still, root_position=path)


def drifting(truth: BodyMotion, pose: BodyMotion, seed: int = 0) -> BodyMotion:
    """Return ``pose`` on the true root's displacements with a bias of 1 cm/s and noise of 1 cm/s."""
    noise = 0.01 * np.random.default_rng(seed).standard_normal((len(truth) - 1, 3))
    path = asked(pose, np.diff(truth.root_position, axis=0) * truth.fps + BIAS + noise).root_position
    return replace(pose, root_position=path + truth.root_position[0] - pose.root_position[0])


def end_error(motion: BodyMotion, truth: BodyMotion) -> np.ndarray:
    """Return how far the root ends from the truth [m], shape (3,)."""
    return motion.root_position[-1] - truth.root_position[-1]


def test_a_standing_figure_does_not_drift() -> None:
    # That feet stand is believed after 0.1 s, 7 frames at 60 fps, and a grip tightens in thirds over 3 frames more, of which one is
    # lost: 8 frames of 6 mm/s are 0.8 mm an axis.
    drifts = asked(posed({}, frames=3600), BIAS)
    assert np.linalg.norm(drifts.root_position[-1] - drifts.root_position[0]) > 0.55  # 1 cm/s for a minute
    held = apply_stance_root_filter(drifts)
    assert np.abs(held.root_position - drifts.root_position[0]).max() < 0.81e-3


@pytest.mark.parametrize("speed", [0.5, -1.5])  # m/s; above 0.4 m/s even a held foot is let go
def test_a_figure_that_glides_goes_where_it_is_asked_to(speed: float) -> None:
    glides = asked(posed({}, frames=60), np.array([speed, 0.3, 0.0]))
    path = apply_stance_root_filter(glides).root_position
    # The first frames are the slow start of the smoothing: it passes 0.2 m/s in the first.
    assert np.allclose(np.diff(path, axis=0)[3:], np.diff(glides.root_position, axis=0)[3:], atol=1e-12)


@pytest.mark.parametrize(("speed", "kept"), [(0.03, 1.0), (0.06, 0.5), (0.1, 0.0)])  # m/s, twice 0.04 is 0.08
def test_a_root_that_is_trusted_more_slides_on_its_way_and_keeps_its_level(speed: float, kept: float) -> None:
    glides = asked(posed({}, frames=300), np.array([speed, 0.0, 0.02]))
    held = apply_stance_root_filter(glides, slide_speed=0.04)
    steps = np.diff(held.root_position, axis=0)[30:60] * glides.fps  # of feet that are held by now, and have not slipped by 4 cm
    assert steps[:, 0] == pytest.approx((1.0 - kept) * speed, abs=0.25 * speed)
    assert steps[:, 2] == pytest.approx(0.0, abs=0.005)


def test_the_root_follows_the_legs_over_a_foot_that_stands() -> None:
    # Both thighs turn back at 0.05 rad/s under soles that stay level: the ankles are THIGH + SHIN = 0.83 m below the hips and move
    # back by 0.83 sin(0.05 t); so over standing feet the root moves forward by that, although it is asked to stay.
    angle = 0.05 * np.arange(121) / 60.0
    hinges = np.zeros((121, HINGE_COUNT))
    for side in "lr":
        hinges[:, hinge(f"thigh_{side}_y")], hinges[:, hinge(f"foot_{side}_y")] = angle, -angle
    still = np.tile([1.0, 0.0, 0.0, 0.0], (121, 1))
    leans = BodyMotion(np.tile([0.0, 0.0, STANDING], (121, 1)), rotations_from_hinges(still, hinges), 60.0, "leans")
    x = apply_stance_root_filter(leans).root_position[:, 0]
    gripped = 12
    expected = (THIGH_LENGTH_M + SHIN_LENGTH_M) * (np.sin(angle) - np.sin(angle[gripped]))
    assert np.allclose((x - x[gripped])[gripped:], expected[gripped:], atol=1e-6)


def hop(height: float) -> BodyMotion:
    """Return a figure that stands for 1 s, rises to ``height`` [m] at 1 m/s, and stands there for 3 s, at 100 fps."""
    velocity = np.zeros((400 + round(100 * height), 3))
    velocity[100 : 100 + round(100 * height), 2] = 1.0
    return asked(replace(posed({}, frames=len(velocity) + 1), fps=100.0), velocity)


def test_a_small_step_up_is_an_error_and_is_taken_back_gradually() -> None:
    hops = hop(0.05)
    z = apply_stance_root_filter(hops).root_position[:, 2] - STANDING
    peak = z.max()
    assert 0.03 < peak <= 0.05
    # After the landing the error falls by exp(-t / LEVEL_CORRECTION_S): in 0.01 s by 3.3 %, and in 2 s to nearly nothing.
    assert np.diff(z).min() > -1.1 * peak * 0.01 / LEVEL_CORRECTION_S
    assert abs(z[-1]) < 1e-3


def test_a_stair_becomes_a_new_level() -> None:
    z = apply_stance_root_filter(hop(0.17)).root_position[:, 2] - STANDING
    assert z[-1] == pytest.approx(0.17, abs=0.01)
    assert np.ptp(z[-200:]) < 1e-4


def test_one_frame_at_a_time_gives_the_same() -> None:
    rng = np.random.default_rng(0)
    walk = synthetic.walk(np.arange(360) / 60.0, 1.2, draw_movement_style("somebody", rng), rng)
    noisy = drifting(walk, walk)
    soles, root = [relative_soles(pose) for pose in noisy.local_rotations], noisy.root_position
    figure = StanceRootFilter(noisy.fps, root[0], soles[0])
    steps = [figure.step(root[n] - root[n - 1], soles[n]) for n in range(1, len(noisy))]
    held = apply_stance_root_filter(noisy)
    assert np.allclose(held.root_position[1:], steps, atol=1e-12)
    assert np.array_equal(held.root_position[0], noisy.root_position[0])
    assert np.abs(held.root_position - noisy.root_position).max() > 0.01  # so that there is something to compare


def test_what_comes_later_changes_nothing_before() -> None:
    rng = np.random.default_rng(1)
    walk = synthetic.walk(np.arange(360) / 60.0, 1.2, draw_movement_style("somebody", rng), rng)
    noisy = drifting(walk, walk)
    assert np.array_equal(apply_stance_root_filter(noisy.cut(0, 200)).root_position, apply_stance_root_filter(noisy).root_position[:200])


def test_a_walk_stays_on_its_way_and_on_the_ground() -> None:
    rng = np.random.default_rng(2)
    walk = synthetic.walk(np.arange(720) / 60.0, 1.2, draw_movement_style("somebody", rng), rng)
    noisy = drifting(walk, walk)
    held = apply_stance_root_filter(noisy)
    assert np.linalg.norm(end_error(noisy, walk)) > 0.08  # 1 cm/s for 12 s is 12 cm, and noise
    assert np.linalg.norm(end_error(held, walk)) < 0.02  # what is left arises while feet land and leave
    assert np.abs(held.root_position - walk.root_position)[:, 2].max() < 0.02


@pytest.mark.parametrize("rise", [0.17, -0.17])
def test_stairs_keep_their_height(rise: float) -> None:
    rng = np.random.default_rng(3)
    stairs = synthetic.stairs(np.arange(600) / 60.0, rise, draw_movement_style("somebody", rng), rng)
    climbed = stairs.root_position[-1, 2] - stairs.root_position[0, 2]
    assert abs(climbed) > 1.5
    held = apply_stance_root_filter(drifting(stairs, stairs))
    assert held.root_position[-1, 2] - held.root_position[0, 2] == pytest.approx(climbed, abs=0.04)


def test_a_turn_on_the_spot_stays_on_its_spot() -> None:
    rng = np.random.default_rng(4)
    turn = synthetic.turn_on_the_spot(np.arange(1200) / 60.0, draw_movement_style("somebody", rng), rng)
    turns = abs(np.unwrap(heading(turn.local_rotations[:, 0]))[-1]) / (2 * np.pi)
    assert turns > 1.5
    for pose in (turn, simulate_suit(turn, seed=5).faulty):
        assert np.linalg.norm(end_error(apply_stance_root_filter(drifting(turn, pose)), turn)[:2]) < 0.05 * turns


def test_a_minute_of_standing_in_a_suit() -> None:
    rng = np.random.default_rng(6)
    stand = synthetic.stand(np.arange(3600) / 60.0, draw_movement_style("somebody", rng), rng)
    held = apply_stance_root_filter(drifting(stand, simulate_suit(stand, seed=7).faulty))
    feet = sole_points(*body_poses(held)).mean(axis=(1, 2))
    assert np.linalg.norm((feet - feet[60])[60:], axis=-1).max() < 0.01  # m; its suit may think that the body leans, but feet stay
