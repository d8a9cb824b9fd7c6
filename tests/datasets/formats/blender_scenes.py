"""Scenes for tests, built by Blender where a Python has it: a skinned figure that moves as the 20 bodies do."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from datasets.formats.blender_process import NO_BLENDER
from datasets.formats.blender_runner import PYTHON_VARIABLE
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_NAMES, SKELETON
from datasets.motion.kinematics import body_poses
from datasets.motion.rotation import from_axis_angle, multiply, to_matrix
from datasets.motion.skeleton import forward_kinematics
from tests.builders import MIXAMO, STANDING, joint_name

PYTHON = os.environ.get(PYTHON_VARIABLE) or sys.executable
HAS_BLENDER = (
    subprocess.run([PYTHON, "-I", "-c", "import importlib.util, sys; sys.exit(importlib.util.find_spec('bpy') is None)"]).returncode == 0
)
needs_blender = pytest.mark.skipif(
    not HAS_BLENDER, reason=f"needs Blender as a Python module (bpy), here or in the Python of {PYTHON_VARIABLE}"
)
without_blender = pytest.mark.skipif(sys.platform == "win32", reason="Windows does not run scripts by their first line")
BUILDER = Path(__file__).with_name("blender_builder.py")
NAMES = [joint_name(body, MIXAMO) for body in BODY_NAMES]
FINGER = "LeftHandIndex1"
CENTIMETRES_Y_UP = 0.01 * np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # of an armature, to metres and Z up


def hide_blender(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Let a Python in a folder be asked for Blender that says that it has none; for tests ``without_blender``."""
    python = folder / "python"
    python.write_text(f"#!{sys.executable}\nimport sys\nsys.exit({NO_BLENDER})\n")
    python.chmod(0o755)
    patch.setenv(PYTHON_VARIABLE, str(python))


def place_in_centimetres() -> np.ndarray:
    """Return the matrix of an armature in centimetres and Y up that stands aside."""
    place = np.eye(4)
    place[:3, :3], place[:3, 3] = CENTIMETRES_Y_UP, (0.3, 0.2, 0.1)
    return place


def run_builder(*arguments: object) -> None:
    """Run the builder in the Python with Blender."""
    done = subprocess.run([PYTHON, "-I", str(BUILDER), *map(str, arguments)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def write_spec(folder: Path, motion: BodyMotion, **changes: Any) -> Path:
    """Write what the builder builds: a skinned figure that moves as the 20 bodies, with a finger that bends by a degree a frame."""
    positions, rotations = body_poses(motion)
    still = np.tile((1.0, 0.0, 0.0, 0.0), (len(BODY_NAMES), 1))
    heads = forward_kinematics(SKELETON.parents, SKELETON.offsets, still)[0] + (0.0, 0.0, STANDING)
    hand, ahead = BODY_NAMES.index("hand_l"), np.array([0.0, 0.08, 0.0])
    bent = from_axis_angle(np.tile((1.0, 0.0, 0.0), (len(motion), 1)), -np.radians(np.arange(len(motion)) % 60.0))
    places = positions[:, hand] + np.einsum("tij,j->ti", to_matrix(rotations[:, hand]), ahead)
    spec = {
        "names": [*NAMES, FINGER],
        "parents": [*SKELETON.parents, hand],
        "heads": np.concat([heads, [heads[hand] + ahead]]),
        "positions": np.concat([positions, places[:, None]], axis=1),
        "rotations": to_matrix(np.concat([rotations, multiply(rotations[:, hand], bent)[:, None]], axis=1)),
        "fps": motion.fps,
        "place": np.eye(4),
        "axes": "-Z Y",
        "figures": ["Figure"],
        "all_takes": False,
    }
    np.savez(folder / "spec.npz", **(spec | changes))
    return folder / "spec.npz"


def build(folder: Path, motion: BodyMotion, outs: list[str], **changes: Any) -> list[Path]:
    """Have Blender build and export the figure of ``write_spec``."""
    paths = [folder / out for out in outs]
    run_builder("build", write_spec(folder, motion, **changes), *paths)
    return paths


def inspect(path: Path) -> tuple[dict[str, Any], np.ndarray, np.ndarray]:
    """Return what a file holds, the centre of the skin around each joint (T, joints, 3), and the place of another object (T, 3)."""
    facts = path.with_suffix(".npz")
    run_builder("inspect", path, facts)
    with np.load(facts, allow_pickle=False) as told:
        return json.loads(str(told["told"])), told["centres"], told["ball"]
