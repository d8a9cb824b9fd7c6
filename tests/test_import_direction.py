"""Imports point one way, name modules of ours that exist, and let no pickle in."""

import ast
from collections.abc import Iterator

import pytest

from configs.source_code import ROOT

MAY_IMPORT = {
    "configs": set(),
    "datasets": {"configs"},
    "envs": {"configs", "datasets"},
    "agents": {"configs", "datasets"},
    "trainers": {"configs", "datasets", "envs", "agents"},
    "eval": {"configs", "datasets", "envs", "agents", "trainers"},
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
    return "." in name and (ROOT / name.replace(".", "/")).with_suffix(".py").is_file()


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_package_imports_only_what_it_may(package: str) -> None:
    files = sorted((ROOT / package).rglob("*.py"))
    assert files
    named = [(file.relative_to(ROOT).as_posix(), problem) for file in files for problem in violations(package, file.read_text("utf-8"))]
    found = [f"{file}, {problem}" for file, problem in named if not (file == GUARD and "datasets is no module" in problem)]
    assert not found, "\n".join(found)


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
        ("envs", "from .reward import reward"),
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
        ("envs", "from envs import reward"),
    ],
)
def test_what_is_allowed_passes(package: str, source: str) -> None:
    assert not violations(package, source)
