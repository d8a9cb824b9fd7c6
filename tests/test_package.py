"""A built wheel holds every package, template and weight, and cleans a clip in an environment that has nothing else of the project."""

import subprocess
import sys
import sysconfig
import venv
from pathlib import Path
from zipfile import ZipFile

import pytest

from configs.source_code import PACKAGES, PROJECT_ROOT
from datasets.formats.bvh import read_bvh, write_bvh
from tests.builders import as_bvh, posed

SHIPPED = (".py", ".yaml", ".j2", ".safetensors")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the project's wheel, built from a copy of what git knows, so that nothing that lies about is packed."""
    source, out = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    archive = subprocess.run(["git", "archive", "HEAD"], cwd=PROJECT_ROOT, capture_output=True, check=True).stdout
    subprocess.run(["tar", "x", "-C", source], input=archive, check=True)
    build = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(out), str(source)]
    subprocess.run(build, capture_output=True, check=True)
    return next(out.glob("*.whl"))


@pytest.mark.slow
def test_the_wheel_holds_every_file_of_the_packages(wheel: Path) -> None:
    packed = set(ZipFile(wheel).namelist())
    known = subprocess.run(["git", "ls-tree", "-r", "--name-only", "HEAD"], cwd=PROJECT_ROOT, capture_output=True, text=True, check=True)
    files = {name for name in known.stdout.splitlines() if name.split("/")[0] in PACKAGES and name.endswith(SHIPPED)}
    assert len(files) > 250
    assert files <= packed
    assert {name.split("/")[0] for name in packed if not name.split("/")[0].endswith(".dist-info")} == set(PACKAGES)


@pytest.mark.slow
def test_an_installed_wheel_cleans_a_clip_and_finds_its_configs(wheel: Path, tmp_path: Path) -> None:
    venv.create(tmp_path / "env", with_pip=True)
    scripts = tmp_path / "env" / ("Scripts" if sys.platform == "win32" else "bin")
    subprocess.run([scripts / "python", "-m", "pip", "install", "--no-deps", "--no-index", wheel], capture_output=True, check=True)
    site = next((tmp_path / "env").rglob("site-packages"))
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")  # torch and the others, already installed here
    write_bvh(tmp_path / "in.bvh", as_bvh(posed({"forearm_l_z": -20.0}, 30)))
    place = [scripts / "python", "-c", "import eval.clean.pipeline as found; print(found.__file__)"]
    assert str(site) in subprocess.run(place, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    done = subprocess.run([scripts / "adapt-mimic", "clean", "in.bvh", "--out", "out.bvh"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert read_bvh(tmp_path / "out.bvh").names == read_bvh(tmp_path / "in.bvh").names
    missing = [scripts / "adapt-mimic", "train", "--config", "configs/mixed.yaml", "data.motions=nowhere"]
    done = subprocess.run(missing, cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert "nowhere" in done.stderr
