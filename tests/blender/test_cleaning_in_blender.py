"""The add-on in Blender: installed from its zip, it cleans a figure that stands, moves and is keyed in every way, by a stand-in command."""

import json
import math
import os
import stat
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from configs.source_code import PROJECT_ROOT
from datasets.formats.bvh import local_pose, read_bvh
from datasets.motion.humanoid import BODY_NAMES
from datasets.motion.rotation import to_matrix
from datasets.motion.skeleton import forward_kinematics
from tests.builders import lively
from tests.datasets.formats.blender_scenes import PYTHON, needs_blender, place_in_centimetres, write_spec

pytestmark = needs_blender
ADDON = PROJECT_ROOT / "blender"
SCENE, STAND_IN = Path(__file__).with_name("addon_scene.py"), Path(__file__).with_name("stand_in_command.py")
MAX_ERROR_M, MAX_ERROR_DEG = 1e-3, 0.1
FRAMES = 30


def zipped(folder: Path) -> Path:
    """Return the add-on as a zip."""
    with zipfile.ZipFile(folder / "adapt_mimic.zip", "w") as packed:
        for file in sorted(ADDON.glob("*.*")):
            packed.write(file, file.name)
    return folder / "adapt_mimic.zip"


def play(
    folder: Path, fps: float = 60.0, place: np.ndarray | None = None, environment: dict[str, str] | None = None, **scenario: Any
) -> dict:
    """Play a scenario in Blender and return its facts."""
    motion = lively(standing=10, moving=FRAMES - 10)
    write_spec(folder, motion, fps=fps, **({} if place is None else {"place": place}))
    command = folder / "adapt-mimic"
    command.write_text(f'#!/bin/sh\nPYTHONPATH="{PROJECT_ROOT}" exec "{sys.executable}" "{STAND_IN}" "$@"\n')
    command.chmod(command.stat().st_mode | stat.S_IXUSR)
    told = {"zip": str(zipped(folder)), "command": str(command)} | scenario
    (folder / "scenario.json").write_text(json.dumps(told))
    places = {"BLENDER_USER_RESOURCES": str(folder / "user"), "STAND_IN_KEEPS": str(folder), "TMPDIR": str(folder / "temporary")}
    (folder / "temporary").mkdir()
    done = subprocess.run(
        [PYTHON, "-I", "-B", str(SCENE), str(folder)],
        env=os.environ | places | (environment or {}),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert not list((folder / "temporary").glob("adapt-mimic-*"))  # nothing is left behind
    return json.loads((folder / "facts.json").read_text())


def errors(folder: Path) -> tuple[float, float]:
    """Return how far the evaluated bones are from the command's clip, by our reader: the largest distance [m] and angle [degrees]."""
    clean = read_bvh(folder / "out.bvh")
    positions, rotations = forward_kinematics(clean.parents, *local_pose(clean))
    with np.load(folder / "poses.npz", allow_pickle=False) as found:
        names, places, turns = found["names"].tolist(), found["places"], found["turns"]
    joints, bones = [clean.names.index(name) for name in names if name in clean.names], [name in clean.names for name in names]
    assert len(joints) == len(BODY_NAMES) + 1  # and a finger
    apart = np.linalg.norm(positions[:, joints] - places[:, bones], axis=-1)
    between = to_matrix(rotations[:, joints]).swapaxes(-1, -2) @ turns[:, bones]
    angles = 2.0 * np.arcsin(np.clip(np.linalg.norm(between - np.eye(3), axis=(-1, -2)) / math.sqrt(8.0), 0.0, 1.0))
    return float(apart.max()), float(np.degrees(angles.max()))


@pytest.mark.parametrize(
    "scenario",
    [
        {"fps": 60.0},
        {"fps": 24.0, "first": 0, "mode": "XZY"},
        {"fps": 30.0, "first": 1001, "mode": "AXIS_ANGLE", "place": place_in_centimetres()},
        {"fps": 29.97, "carried": True, "place": place_in_centimetres()},
    ],
    ids=["quaternions", "24 fps from 0, Euler angles", "30 fps from 1001, axis and angle, centimetres and Y up", "a parent that moves"],
)
def test_the_new_action_is_the_commands_clip(scenario: dict[str, Any], tmp_path: Path) -> None:
    facts = play(tmp_path, **scenario)
    assert facts["said"] == "FINISHED"
    apart, angle = errors(tmp_path)
    assert apart < MAX_ERROR_M
    assert angle < MAX_ERROR_DEG
    given = read_bvh(tmp_path / "in.bvh")
    assert abs(1.0 / given.frame_time - scenario["fps"]) < 1e-3
    assert len(given.values) == FRAMES
    assert facts["modes"] == [scenario.get("mode", "QUATERNION")]
    assert facts["changed"] == ["Hips", "LeftArm"]  # the others, and the finger, keep their keys
    assert facts["gone"] == []
    assert (facts["old_same"], facts["kept"], facts["new"]) == (True, True, f"{facts['old']} clean")
    first, fps = scenario.get("first", 1), scenario["fps"]
    times = {"L down": [0.0], "L up": [0.1], "R down": [0.2, 0.4], "R up": [0.3, 0.5], "restart": [0.2]}
    expected = sorted([first + round(time * fps), name] for name, times_s in times.items() for time in times_s)
    assert sorted(facts["markers"]) == expected
    whole = ["Taken for a figure.", "Read with care."]
    timed = [
        ["The left knee was moved.", first + round(0.1 * fps)],
        ["Restart of the simulation", first + round(0.2 * fps)],
    ]
    assert facts["notices"] == [*([text, None] for text in whole), *timed]
    assert facts["summary"] == "0.5 s cleaned in 1.0 s; 50 % of it is physics, restarted 1 times"
    assert facts["scenes"] == 1
    assert (facts["compared"], facts["compared_again"]) == (facts["old"], facts["new"])
    assert (facts["undone"], facts["undone_action"]) == ([facts["old"]], facts["old"])
    assert facts["left"] == [False, False]
    with np.load(tmp_path / "poses.npz", allow_pickle=False) as found:
        np.testing.assert_allclose(found["again"], found["before"], atol=1e-5)
        lift = np.linalg.norm(found["places"] - found["before"], axis=-1)
    np.testing.assert_allclose(lift[:, 0], 0.25, atol=1e-4)


def test_constraints_of_a_rig_let_go_in_the_new_action_alone(tmp_path: Path) -> None:
    facts = play(tmp_path, rig=True)
    assert facts["said"] == "FINISHED"
    apart, angle = errors(tmp_path)
    assert apart < MAX_ERROR_M
    assert angle < MAX_ERROR_DEG
    assert "foot_ik" not in read_bvh(tmp_path / "in.bvh").names
    assert facts["changed"] == ["Hips", "LeftArm", "LeftLeg", "LeftUpLeg"]
    assert facts["influences"] == [0.0]
    assert [text for text, _ in facts["notices"] if text.startswith("Constraints of these bones are off in the clean action: LeftLeg.")]
    with np.load(tmp_path / "poses.npz", allow_pickle=False) as found:
        np.testing.assert_allclose(found["again"], found["before"], atol=1e-5)  # with its influence again


def test_the_switches_reach_the_command(tmp_path: Path) -> None:
    facts = play(tmp_path, settings={"quality": "best", "physics": False})
    words = json.loads((tmp_path / "words.json").read_text())
    assert words[0] == "clean"
    assert words[words.index("--quality") + 1] == "best"
    assert words[words.index("--without") + 1] == "physics"
    assert words.count("--without") == 1
    assert words[words.index("--up") + 1] == "z"
    assert "--json" in words
    assert "--ground" not in words
    assert "[Show Before]" in facts["panel_after"]
    assert {"quality=best", "restore=True", "physics=False", "[adapt_mimic.clean]"} <= set(facts["panel_after"])


@pytest.mark.parametrize(
    ("prepare", "told"),
    [
        ("armature.animation_data.action = None", "has no action"),
        ("armature.data.pose_position = 'REST'", "rest position"),
        ("armature.scale = (1, 1, 2); bpy.context.view_layer.update()", "apply its scale"),
        ("armature.animation_data.action_blend_type = 'ADD'", "blended over NLA"),
    ],
)
def test_what_cannot_be_cleaned_is_told(prepare: str, told: str, tmp_path: Path) -> None:
    facts = play(tmp_path, prepare=prepare)
    assert told in facts["said"]
    assert any(told.split()[0] in line for line in facts["panel"])


def test_the_commands_own_line_is_told(tmp_path: Path) -> None:
    facts = play(tmp_path, environment={"STAND_IN_FAILS": "{}: no human skeleton; name the joints"})
    assert facts["said"] == "Error: The action: no human skeleton; name the joints"
    assert "undone" not in facts  # no new action


def test_a_draft_of_joint_names_stays_and_is_chosen(tmp_path: Path) -> None:
    facts = play(tmp_path, environment={"STAND_IN_FAILS": "{}: no joint found for pelvis; name them in a mapping file, a line each"})
    (chosen,) = [Path(line.removeprefix("mapping=")) for line in facts["panel"] if line.startswith("mapping=")]
    assert (
        facts["said"]
        == f"Error: The action: no joint found for pelvis; set their names right in {chosen}, a draft of Joint Names, and clean again"
    )
    assert chosen.name == "Figure.mapping.yaml"
    assert chosen.read_text() == "pelvis: bone\n"


@pytest.mark.parametrize("modal", ["to the end", "undo"])
def test_blender_goes_on_while_it_is_cleaned(modal: str, tmp_path: Path) -> None:
    facts = play(tmp_path, modal=modal)
    assert facts["answer"] == "FINISHED"
    assert facts["reports"] == [["INFO", facts["summary"]]]
    assert facts["longest_s"] < 0.5
    assert any(bar.startswith("Simulating, 1 s left") for bar in facts["bars"])
    assert (facts["begun"], facts["timers"], facts["ready"], facts["scenes"]) == (1, 0, True, 1)
    apart, _ = errors(tmp_path)
    assert apart < MAX_ERROR_M


def test_it_can_be_cancelled(tmp_path: Path) -> None:
    facts = play(tmp_path, modal="cancel", environment={"STAND_IN_WAITS": "1"})
    assert facts["answer"] == "CANCELLED"
    assert (facts["begun"], facts["timers"], facts["ready"], facts["reports"]) == (1, 0, True, [])
    assert "undone" not in facts  # no new action
