"""The add-on as an extension of Blender: what its manifest has to say, what it imports, and that Blender's own tool builds it."""

import ast
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from configs.source_code import PACKAGES, PROJECT_ROOT
from tests.datasets.formats.blender_scenes import PYTHON, needs_blender

ADDON = PROJECT_ROOT / "blender"
MANIFEST = tomllib.loads((ADDON / "blender_manifest.toml").read_text(encoding="utf-8"))
REQUIRED = {"schema_version", "id", "version", "name", "tagline", "maintainer", "type", "blender_version_min", "license"}
PERMISSIONS = {"files", "network", "clipboard", "camera", "microphone"}
MAX_TERSE = 64  # characters of a tagline and of the reason for a permission


def test_the_manifest_has_what_the_schema_demands() -> None:
    assert set(MANIFEST) >= REQUIRED
    assert (MANIFEST["schema_version"], MANIFEST["type"], MANIFEST["id"]) == ("1.0.0", "add-on", "adapt_mimic")
    assert MANIFEST["id"].isidentifier()
    assert re.fullmatch(r"\d+\.\d+\.\d+", MANIFEST["blender_version_min"])
    assert MANIFEST["license"] == ["SPDX:Apache-2.0"]
    terse = [MANIFEST["tagline"], *MANIFEST["permissions"].values()]
    assert all(len(text) <= MAX_TERSE and text[-1].isalnum() for text in terse)
    assert set(MANIFEST["permissions"]) == {"files"} < PERMISSIONS  # and no network


def test_version_and_licence_are_the_projects() -> None:
    project = tomllib.loads((PROJECT_ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert MANIFEST["version"] == project["version"]
    assert MANIFEST["license"] == [f"SPDX:{project['license']}"]
    assert (ADDON / "LICENSE").read_bytes() == (PROJECT_ROOT / "LICENSE").read_bytes()


@pytest.mark.parametrize("file", sorted(ADDON.glob("*.py")), ids=lambda file: file.name)
def test_it_imports_nothing_but_itself_and_what_blender_has(file: Path) -> None:
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            assert node.level == 1
            assert all(
                (ADDON / f"{name}.py").is_file() for name in ([node.module] if node.module else [alias.name for alias in node.names])
            )
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [str(node.module)]
            assert {name.split(".")[0] for name in names} <= {*sys.stdlib_module_names, "bpy", "mathutils", "numpy"} - {
                "socket",
                "urllib",
                "http",
                "threading",
            }


def test_no_package_imports_it() -> None:
    files = [file for package in PACKAGES for file in (PROJECT_ROOT / package).rglob("*.py")]
    assert not [file for file in files if re.search(r"^\s*(from|import) blender\b", file.read_text(encoding="utf-8"), re.MULTILINE)]


def test_it_is_imported_without_blender() -> None:
    names = ("rotations", "bvh_motion", "bvh_text", "command", "events")
    code = "import sys; sys.modules['bpy'] = None; " + "; ".join(f"import blender.{name}" for name in names)
    subprocess.run([sys.executable, "-c", code], cwd=PROJECT_ROOT, check=True)


@needs_blender
def test_blenders_own_tool_builds_and_validates_it(tmp_path: Path) -> None:
    find = "import bpy; print(bpy.utils.system_resource('SCRIPTS'))"
    scripts = subprocess.run([PYTHON, "-I", "-c", find], capture_output=True, text=True, check=True).stdout.strip()
    tool = str(Path(scripts) / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py")
    for words in (
        ["build", "--source-dir", str(ADDON), "--output-dir", str(tmp_path)],
        ["validate", str(tmp_path / f"adapt_mimic-{MANIFEST['version']}.zip")],
    ):
        done = subprocess.run([PYTHON, "-I", "-B", tool, *words], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    names = set(zipfile.ZipFile(next(tmp_path.glob("*.zip"))).namelist())
    assert names == {file.name for file in ADDON.iterdir() if file.is_file()}
