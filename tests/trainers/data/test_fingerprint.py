"""The key of prepared motion sees every file that prepares it, in whatever folder it lies, and no other."""

import shutil
from pathlib import Path

import pytest

from configs.source_code import PACKAGES, PROJECT_ROOT, imported_files
from datasets.library.sources import SYNTHETIC_SOURCE
from trainers.data import training_motions as motions
from trainers.data.fingerprint import fingerprint


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """Return a copy of the project's packages, code alone."""
    for package in PACKAGES:
        shutil.copytree(PROJECT_ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("*.safetensors", "__pycache__"))
    return tmp_path


def key(root: Path) -> str:
    return fingerprint({}, SYNTHETIC_SOURCE, "", motions.__name__, root)


def test_a_changed_byte_in_any_file_that_prepares_motion_is_another_key(copy: Path) -> None:
    code = {file.relative_to(copy).as_posix() for file in imported_files(motions.__name__, root=copy)}
    before = key(copy)
    assert before == key(copy) == key(PROJECT_ROOT)  # where the project lies does not count
    for changed in ("retarget.py", "imu_fusion.py", "reconstruct_root.py", "feed_forward.py"):
        file = copy / next(file for file in code if Path(file).name == changed)
        kept = file.read_bytes()
        file.write_bytes(kept + b"#")
        assert key(copy) != before, changed
        file.write_bytes(kept)
    assert key(copy) == before


def test_other_code_leaves_the_key_alone(copy: Path) -> None:
    before = key(copy)
    (copy / "eval" / "render.py").write_text("# another way to draw\n")
    (copy / "trainers" / "ppo_run.py").write_text("# another loop\n")
    assert key(copy) == before


def test_inner_packages_names_out_of_modules_and_imports_in_functions_are_followed(tmp_path: Path) -> None:
    inner = tmp_path / "datasets" / "formats"
    inner.mkdir(parents=True)
    (inner / "__init__.py").touch()
    (tmp_path / "datasets" / "__init__.py").touch()
    (inner / "bvh.py").write_text("def read():\n    from datasets.motion.rotation import turn\n    return turn\n")
    (tmp_path / "datasets" / "rotation.py").write_text("import numpy as np\nimport datasets.formats\n")
    (tmp_path / "datasets" / "unused.py").touch()
    (tmp_path / "eval").mkdir()
    (tmp_path / "eval" / "clean.py").write_text("from datasets.formats import bvh\n")
    found = {file.relative_to(tmp_path).as_posix() for file in imported_files("eval.clean", root=tmp_path)}
    formats = {"datasets/formats/__init__.py", "datasets/formats/bvh.py"}
    assert found == {"eval/clean/cli.py", "datasets/__init__.py", "datasets/motion/rotation.py", *formats}
