"""Ballistic flights, by hand."""

import numpy as np

from datasets.cleanup.ballistic_flight import BallisticRoot, apply_ballistic_root, smoothed_com_acceleration
from datasets.imu.sensor_model import SENSOR_BODIES
from datasets.motion.humanoid import BODY_MASSES_KG, BODY_NAMES

FALLING, CARRIED = [0.0, 0.0, -9.81], [0.0, 0.0, 0.0]  # free accelerations of who weighs nothing, and of who stands


def test_who_is_carried_moves_as_asked() -> None:
    flight = BallisticRoot()
    np.testing.assert_allclose(flight.step([0.01, 0.0, 0.002], [0.0, 0.0, 0.0], CARRIED), [0.01, 0.0, 0.002])
    np.testing.assert_allclose(flight.step([0.03, 0.0, 0.0], [0.5, 0.0, 0.0], CARRIED), [0.03, 0.0, 0.0])


def test_in_the_air_the_centre_of_mass_keeps_its_velocity_and_falls() -> None:
    # Begins with 0.02 m a frame, 2 m/s. In the n-th frame of flight it has 2 m/s still and 9.81 x 0.01 n m/s downwards, whatever is
    # asked; the pelvis goes 0.001 m a frame backwards against the centre of mass, for that moves forward in it.
    flight = BallisticRoot()
    flight.step([0.02, 0.0, 0.0], [0.0, 0.0, 0.0], CARRIED)
    for n in range(1, 30):
        step = flight.step([-0.5, 0.3, 0.1], [0.001, 0.0, 0.0], FALLING)
        np.testing.assert_allclose(step, [0.02 - 0.001, 0.0, -0.0981 * n * 0.01], atol=1e-12)


def test_a_jump_of_half_a_second_goes_as_far_as_ballistics_says() -> None:
    # Off with 2 m/s forward and 2.4525 m/s up, in the air for 0.5 s, in which the model sees no movement at all: 1 m forward, and back
    # to the height of the start but for half a frame's fall at either end.
    frames = 210
    path = np.zeros((frames, 3))
    steps = np.zeros((frames - 1, 3))
    steps[50:150] = [0.02, 0.0, 0.024525]  # a second of it, six times the filter's memory
    path[1:] = np.cumsum(steps, axis=0)
    accelerations = np.zeros((frames, 19, 3))
    accelerations[150:200, :, 2] = -9.81
    flown = apply_ballistic_root(path, np.zeros((frames, 3)), accelerations)
    assert abs(flown[-1, 0] - path[-1, 0] - 1.0) < 0.05
    assert abs(flown[-1, 2] - path[-1, 2]) < 0.08
    np.testing.assert_allclose(flown[:148], path[:148], atol=1e-12)


def test_the_body_s_acceleration_is_the_mean_by_mass() -> None:
    # Head alone accelerates by 10 m/s^2: its share of the mass of all bodies.
    accelerations = np.zeros((7, 19, 3))
    accelerations[:, SENSOR_BODIES.index(BODY_NAMES.index("head")), 0] = 10.0
    share = BODY_MASSES_KG[BODY_NAMES.index("head")] / BODY_MASSES_KG.sum()
    np.testing.assert_allclose(smoothed_com_acceleration(accelerations)[:, 0], 10.0 * share)
    # One sample in five: a fifth of it, two samples before and after.
    accelerations[:] = 0.0
    accelerations[3, :, 1] = 5.0
    np.testing.assert_allclose(smoothed_com_acceleration(accelerations)[:, 1], [0, 1, 1, 1, 1, 1, 0])
