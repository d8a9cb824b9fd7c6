"""Balance against the inverted pendulum's closed forms."""

import numpy as np
import pytest

from datasets.motion.humanoid import BODY_MASSES_KG, SKELETON
from datasets.motion.kinematics import centre_of_mass
from datasets.motion.skeleton import forward_kinematics
from datasets.synthetic.balance import balance_correction, balanced_path, reachable_height


def test_a_step_of_the_pressure_is_met_half_way() -> None:
    # x'' = k (x - p), p stepping from 0 to 1 at t = 0, bounded: x = exp(w t) / 2 before and 1 - exp(-w t) / 2 after, w = sqrt(k).
    t = np.arange(-480, 481) / 60.0
    pressure = np.stack([(t > 0).astype(float), np.full_like(t, 2.0)], axis=1)
    pressure[t == 0, 0] = 0.5
    x = balanced_path(pressure, np.full_like(t, 9.0), 60.0)
    expected = np.where(t < 0, 0.5 * np.exp(3.0 * t), 1.0 - 0.5 * np.exp(-3.0 * t))
    assert x[:, 0] == pytest.approx(expected, abs=2e-3)
    assert x[:, 1] == pytest.approx(2.0)


def test_a_flying_body_keeps_its_speed() -> None:
    t = np.arange(120) / 60.0
    flight = (t > 0.8) & (t < 1.2)
    x = balanced_path(np.stack([t, 0.0 * t], axis=1), np.where(flight, 0.0, 10.0), 60.0)[:, 0]
    assert np.abs(np.diff(x[flight], 2)).max() < 1e-12


def test_a_still_body_is_shifted_over_the_pressure() -> None:
    frames = 601
    rotations = np.zeros((frames, 20, 4))
    rotations[..., 0] = 1.0
    offsets = np.broadcast_to(SKELETON.offsets, (frames, 20, 3)).copy()
    offsets[:, 0, 2] = 0.95
    positions, rotations = forward_kinematics(SKELETON.parents, offsets, rotations)
    centre = centre_of_mass(positions, rotations)
    pressure = np.zeros((frames, 3))
    pressure[:, :2] = centre[:, :2] + np.array([0.10, -0.04])
    shift = balance_correction(positions, rotations, pressure, 60.0)
    # Held at zero at both ends, it approaches the whole distance within a few times sqrt(h / g) = 0.3 s; the middle is 5 s away.
    assert shift[[0, -1]] == pytest.approx(0.0, abs=1e-9)
    assert shift[300] == pytest.approx([0.10, -0.04], abs=1e-6)
    assert len(BODY_MASSES_KG) == 20


def test_a_leg_reaches_by_pythagoras() -> None:
    # A leg of 0.5 m whose foot is 0.3 m ahead of the hip: 0.4 m above the ankle at 0.1 m; the hip is 0.03 m under the pelvis.
    height = reachable_height(np.array([[0.0, 0.09, -0.03]]), np.array([[1.0, 2.0]]), np.array([[1.3, 2.09, 0.1]]), 0.5)
    assert height == pytest.approx(0.53)
