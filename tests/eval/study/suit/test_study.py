"""The comparison of the simulated suit with real ones."""

import json
from pathlib import Path

import numpy as np
import pytest

from datasets.motion.rotation import from_axis_angle, multiply, normalise
from eval.study.cli import main
from eval.study.suit.study import real_rest_noise, residual_angles

X, Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


def wobble(frames: int = 200) -> np.ndarray:
    """Return orientations (T, 4) that turn about all axes."""
    t = np.arange(frames) / 100.0
    return multiply(from_axis_angle(Z, np.sin(3 * t)), from_axis_angle(X, np.cos(5 * t)))


def test_constant_rotations_explain_themselves() -> None:
    """A sensor mounted askew in a world turned by a constant is right: nothing remains."""
    mounting, world = normalise(np.array([0.3, 0.5, -0.2, 0.7])), normalise(np.array([0.9, 0.1, 0.3, -0.2]))
    assert residual_angles(multiply(multiply(world, wobble()), mounting), wobble()) == pytest.approx(0.0, abs=1e-4)


def test_a_step_in_heading_remains() -> None:
    """A heading that jumps by 10 degrees half-way leaves 5 degrees on either side of the best constant."""
    jump = np.where(np.arange(200) < 100, 0.0, np.radians(10.0))
    remains = residual_angles(multiply(from_axis_angle(Z, jump), wobble()), wobble())
    assert remains.mean() == pytest.approx(5.0, abs=0.3)


def test_missing_recordings_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without the real recordings: one line that names the first missing one, exit code 2, nothing written."""
    out = tmp_path / "out"
    assert main(["suit", "--out", str(out), "--data", str(tmp_path)]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert "rokoko_jesse_dance.bvh" in message
    assert not out.exists()


@pytest.mark.shared_data
def test_real_sensors_at_rest(shared_data: Path) -> None:
    """The 16 sensors on limbs and torso show milliradians per second and centimetres per second squared of noise."""
    rest = real_rest_noise(shared_data)
    assert 1e-3 < np.median(rest["gyroscope_noise"]) < 1e-2
    assert 1e-2 < np.median(rest["accelerometer_noise"]) < 1e-1


@pytest.mark.slow
@pytest.mark.shared_data
def test_study_writes_its_shape(shared_data: Path, tmp_path: Path) -> None:
    """The study leaves a JSON file with rows and findings, and a page."""
    assert main(["suit", "--out", str(tmp_path), "--data", str(shared_data)]) == 0
    study = json.loads((tmp_path / "study.json").read_text())
    assert study["study"] == "suit"
    assert all({"name", "ours", "published"} == set(row) for row in study["rows"])
    assert all(isinstance(finding["reproduced"], bool) for finding in study["findings"])
    assert (tmp_path / "index.html").is_file()
