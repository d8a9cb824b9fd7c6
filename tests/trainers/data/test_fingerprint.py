"""Cache key of prepared motion: depends on every file that prepares it, in whatever folder, and on no other."""

import shutil
from pathlib import Path

import pytest

from configs.source_code import PACKAGES, PROJECT_ROOT, imported_files
from datasets.library.sources import SYNTHETIC_SOURCE
from tests.datasets.formats.acclaim_files import write_person
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
    for changed in ("retarget.py", "suit_simulation.py", "reconstruct.py", "inverse_dynamics.py", "motion_cache.py"):
        file = copy / next(file for file in code if Path(file).name == changed)
        kept = file.read_bytes()
        file.write_bytes(kept + b"#")
        assert key(copy) != before, changed
        file.write_bytes(kept)
    assert key(copy) == before


def test_the_skeleton_beside_a_motion_counts(tmp_path: Path) -> None:
    motion = write_person(tmp_path, {})
    keys: list[str] = []
    for text in ((tmp_path / "05.asf").read_text(), "another skeleton"):
        (tmp_path / "05.asf").write_text(text)
        keys += [fingerprint({}, str(source), "", motions.__name__) for source in (motion, tmp_path)]
    assert (keys[0] == keys[1], keys[2] == keys[3], keys[0] == keys[2]) == (True, True, False)


def test_other_code_leaves_the_key_alone(copy: Path) -> None:
    before = key(copy)
    for other in ("eval/pages/render.py", "trainers/ppo/run.py"):
        (copy / other).write_bytes((copy / other).read_bytes() + b"#")
    assert key(copy) == before


def test_inner_packages_names_out_of_modules_and_imports_in_functions_are_followed(tmp_path: Path) -> None:
    written = {
        "datasets/__init__.py": "",
        "datasets/formats/__init__.py": "",
        "datasets/formats/bvh.py": "def read():\n    from datasets.rotation import turn\n    return turn\n",
        "datasets/rotation.py": "import numpy as np\nimport datasets.formats\n",
        "datasets/unused.py": "",
        "eval/clean.py": "from datasets.formats import bvh\n",
    }
    for name, source in written.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(source)
    found = {file.relative_to(tmp_path).as_posix() for file in imported_files("eval.clean", root=tmp_path)}
    assert found == written.keys() - {"datasets/unused.py"}
