"""Imports point one way between packages and between their rooms, run in no circle, name modules that exist, and let no pickle in."""

import ast
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from configs.source_code import PACKAGES, PROJECT_ROOT, direct_imports

MAY_IMPORT = {
    "configs": set(),
    "datasets": {"configs"},
    "envs": {"configs", "datasets"},
    "agents": {"configs", "datasets"},
    "trainers": {"configs", "datasets", "envs", "agents"},
    "eval": {"configs", "datasets", "envs", "agents", "trainers"},
}
# The rooms of each package from the ground up: a room imports from those below it, none beside or above it. "" is the package itself.
LAYERS = {
    "configs": [{""}],
    "datasets": [
        {"", "motion"},
        {"formats", "ik", "joints"},
        {"damage"},
        {"performer"},
        {"retarget", "synthetic"},
        {"imu"},
        {"cleanup", "library"},
        {"trackers", "describe"},
    ],
    "envs": [{"physics"}, {"mimic"}, {""}],
    "agents": [{""}, {"policy", "root.networks", "root.recurrent"}, {"root", "lobstr", "lower_body", "restore"}, {"weights"}],
    "trainers": [{"", "runs"}, {"data"}, {"algorithms"}, {"collectors", "evaluation", "supervised"}, {"distributed"}, {"ppo"}],
    "eval": [
        {"live", "viewer", "metrics", "runs", "backends"},
        {"", "live.page", "pages"},
        {"clean.optimisation"},
        {"clean", "report", "study.framework", "study.suit", "benchmark.contacts", "benchmark.peers", "benchmark.timing"},
        {"agent_server", "study.clean", "study.lobstr", "study.policy", "study.root", "benchmark.scaling", "studio.state"},
        {"study.search", "study.restore", "studio.scene"},
        {"study", "studio.page"},
        {"benchmark", "studio"},
    ],
}
GUARD = "envs/__init__.py"  # imports whatever is called datasets, to say where a foreign one was found
PICKLES = {"pickle", "cPickle", "_pickle", "cloudpickle", "dill", "joblib", "shelve", "marshal"}
PICKLING = {"torch.load", "torch.save", "torch.serialization.load", "torch.serialization.save"}


def violations(package: str, source: str) -> list[str]:
    """Return what a module of ``package`` with this source imports or calls but should not."""
    return [f"line {line}: {problem}" for line, problem in _problems(package, ast.parse(source))]


def _problems(package: str, tree: ast.Module) -> Iterator[tuple[int, str]]:
    for node in ast.walk(tree):
        match node:
            case ast.Import(names=names):
                yield from ((node.lineno, problem) for alias in names for problem in _judge(package, alias.name, ""))
            case ast.ImportFrom(module=module, level=0, names=names):
                yield from ((node.lineno, problem) for alias in names for problem in _judge(package, module or "", alias.name))
            case ast.ImportFrom():
                yield node.lineno, "a relative import; write the whole name"
            case ast.Attribute() if ast.unparse(node) in PICKLING:
                yield node.lineno, f"{ast.unparse(node)} is for pickles; use safetensors"
            case ast.keyword(arg="allow_pickle") if ast.unparse(node.value) != "False":
                yield node.lineno, "allow_pickle should stay False"


def _judge(package: str, module: str, name: str) -> Iterator[str]:
    """Yield what is wrong with importing ``name`` out of ``module``, or the whole module when the name is empty."""
    top, whole = module.split(".")[0], f"{module}.{name}".removesuffix(".")
    if top in PICKLES or whole in PICKLING:
        yield f"{whole} is for pickles; use safetensors, npz or JSON"
    if top in MAY_IMPORT and top != package and top not in MAY_IMPORT[package]:
        yield f"{package} may not import {top}"
    elif top in MAY_IMPORT and not (_is_file(module) or _is_file(whole)):
        yield f"{whole} is no module of this project; import names from one of its files"


def _is_file(name: str) -> bool:
    """Return whether a dotted name is a file of ours, and so neither Hugging Face's datasets nor a bare package."""
    return "." in name and (PROJECT_ROOT / name.replace(".", "/")).with_suffix(".py").is_file()


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_package_imports_only_what_it_may(package: str) -> None:
    files = sorted((PROJECT_ROOT / package).rglob("*.py"))
    assert files
    named = [
        (file.relative_to(PROJECT_ROOT).as_posix(), problem) for file in files for problem in violations(package, file.read_text("utf-8"))
    ]
    found = [f"{file}, {problem}" for file, problem in named if not (file == GUARD and "datasets is no module" in problem)]
    assert not found, "\n".join(found)


def room_of(file: Path) -> tuple[str, str]:
    """Return the package of a file and its room."""
    package, *inner, _ = file.relative_to(PROJECT_ROOT).parts
    return package, ".".join(inner)


def may_import(importer: tuple[str, str], imported: tuple[str, str]) -> bool:
    """Return whether a room may import from another, as far as rooms of one package are concerned."""
    if importer == imported or importer[0] != imported[0]:
        return True
    floor = {room: height for height, rooms in enumerate(LAYERS[importer[0]]) for room in rooms}
    return floor[imported[1]] < floor[importer[1]]


def own_files() -> list[Path]:
    """Return every module of the project, without the packages' own files: whoever imports a module imports them."""
    return [file for package in PACKAGES for file in sorted((PROJECT_ROOT / package).rglob("*.py")) if file.name != "__init__.py"]


def test_every_room_has_its_layer() -> None:
    listed = {(package, room) for package, layers in LAYERS.items() for rooms in layers for room in rooms}
    assert {room_of(file) for file in own_files()} <= listed
    assert all((PROJECT_ROOT / package / room.replace(".", "/") / "__init__.py").is_file() for package, room in listed)


@pytest.fixture(scope="module")
def imports() -> dict[Path, set[Path]]:
    """Return for each module the modules that it imports."""
    files = set(own_files())
    return {file: files.intersection(direct_imports(file)) for file in sorted(files)}


def test_rooms_import_only_from_layers_below(imports: dict[Path, set[Path]]) -> None:
    wrong = [
        f"{file.relative_to(PROJECT_ROOT)} imports {imported.relative_to(PROJECT_ROOT)}"
        for file, found in imports.items()
        for imported in sorted(found)
        if not may_import(room_of(file), room_of(imported))
    ]
    assert not wrong, "\n".join(wrong)


def test_imports_run_in_no_circle(imports: dict[Path, set[Path]]) -> None:
    list(TopologicalSorter(imports).static_order())  # raises CycleError


@pytest.mark.parametrize(
    ("importer", "imported", "allowed"),
    [
        (("datasets", "retarget"), ("datasets", "motion"), True),
        (("datasets", "motion"), ("datasets", "retarget"), False),
        (("datasets", "formats"), ("datasets", "ik"), False),  # beside each other
        (("eval", "clean"), ("eval", "study.clean"), False),
        (("envs", ""), ("envs", "physics"), True),
        (("trainers", "ppo"), ("datasets", "motion"), True),  # the packages' own rule
    ],
)
def test_a_room_above_or_beside_is_refused(importer: tuple[str, str], imported: tuple[str, str], allowed: bool) -> None:
    assert may_import(importer, imported) is allowed


@pytest.mark.parametrize(
    ("package", "source"),
    [
        ("datasets", "from envs.mimic.spec import SPEC"),
        ("agents", "import envs.mimic.reward"),
        ("envs", "from agents.policy.policy import Policy"),
        ("trainers", "def f():\n    from eval.report import main"),
        ("configs", "from datasets.motion.clip import Motion"),
        ("datasets", "from datasets import load_dataset"),
        ("datasets", "import datasets"),
        ("trainers", "from datasets.arrow_dataset import Dataset"),
        ("eval", "import eval"),
        ("envs", "from . import reward"),
        ("envs", "from .mimic import reward"),
        ("trainers", "import pickle"),
        ("trainers", "from torch import save"),
        ("trainers", "import torch\ntorch.load('x', weights_only=True)"),
        ("datasets", "import numpy as np\nnp.load('x', allow_pickle=True)"),
    ],
)
def test_what_is_forbidden_is_found(package: str, source: str) -> None:
    assert len(violations(package, source)) == 1


@pytest.mark.parametrize(
    ("package", "source"),
    [
        ("datasets", "from datasets.motion.clip import Motion\nfrom configs.errors import InputError"),
        ("eval", "import numpy as np\nfrom datasets.motion.clip import Motion\nnp.load('x', allow_pickle=False)"),
        ("trainers", "import datasets.motion.clip"),
        ("envs", "from envs.mimic import reward"),
    ],
)
def test_what_is_allowed_passes(package: str, source: str) -> None:
    assert not violations(package, source)
