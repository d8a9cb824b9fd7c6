"""Files and overrides become dataclasses; mistakes in them become one line."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

import pytest

from configs.errors import InputError
from configs.load import formerly, load_config, save_config
from configs.source_code import PROJECT_ROOT
from trainers.algorithms.ppo_config import PpoConfig
from trainers.supervised.jobs import config_class
from trainers.supervised.lobstr_config import LobstrConfig
from trainers.supervised.root_config import RootConfig

CONFIGS = sorted((PROJECT_ROOT / "configs").glob("*.yaml"))


@dataclass(frozen=True)
class Wheel:
    """A part with a check of its own."""

    REMOVED_KEYS: ClassVar[dict[str, object]] = {"hub": 0}

    radius: float = formerly("size", 0.3)
    spokes: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        """Check the value."""
        if self.radius <= 0.0:
            raise InputError(f"radius is {self.radius}, should be above 0")


@dataclass(frozen=True)
class Cart:
    """Something with parts."""

    name: str = "cart"
    wheels: int = 4
    front: Wheel = field(default_factory=Wheel)


def written(folder: Path, text: str) -> Path:
    path = folder / "cart.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_file_then_overrides_then_defaults(tmp_path: Path) -> None:
    path = written(tmp_path, "name: dray\nfront:\n  radius: 0.5\n")
    assert load_config(Cart, path, ["wheels=2", "front.spokes=[3,5]"]) == Cart("dray", 2, Wheel(0.5, (3, 5)))
    assert load_config(Cart, path, ["front.radius=1e-1"]).front.radius == 0.1


def test_empty_file_is_all_defaults(tmp_path: Path) -> None:
    assert load_config(Cart, written(tmp_path, "")) == Cart()


def test_saved_config_loads_again(tmp_path: Path) -> None:
    config = Cart("dray", 2, Wheel(0.5, (3, 5)))
    save_config(config, tmp_path / "saved.yaml")
    assert load_config(Cart, tmp_path / "saved.yaml") == config


def test_old_keys_are_read_under_their_new_names(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "front: {size: 0.5, hub: 0}\n")
    assert load_config(Cart, path) == Cart(front=Wheel(0.5))
    assert load_config(Cart, path, ["front.size=0.25"]).front.radius == 0.25
    assert capsys.readouterr().err.splitlines() == [
        f"{path}: 'front.size' is now called 'front.radius'",
        f"{path}: 'front.size' is now called 'front.radius'",
        "overrides: 'front.size' is now called 'front.radius'",
    ]


@pytest.mark.parametrize(
    ("text", "overrides", "message"),
    [
        ("front: {size: 1, radius: 2}", [], "{path}: 'front.size' is the old name of 'front.radius', which is there as well; leave it out"),
        ("front: {hub: 1}", [], "{path}: 'front.hub' is no longer supported; leave it out"),
        ("whels: 3", [], "{path}: unknown key 'whels', did you mean 'wheels'?"),
        ("front: {radios: 3}", [], "{path}: unknown key 'front.radios', did you mean 'front.radius'?"),
        ("", ["front.radis=3"], "overrides: unknown key 'front.radis', did you mean 'front.radius'?"),
        ("", ["wheels"], "override 'wheels' should have the form key.sub=value"),
        ("wheels: many", [], "{path}: wheels: Value 'many' of type 'str' could not be converted to Integer"),
        ("", ["front.radius=wide"], "{path}: front.radius: Value 'wide' of type 'str' could not be converted to Float"),
        ("front: 3", [], "{path}: front should be a table of keys and values"),
        ("- a\n- b", [], "{path}: the file should be a table of keys and values"),
        ("", ["front.radius=-1"], "radius is -1.0, should be above 0"),
    ],
)
def test_mistakes_become_one_line(tmp_path: Path, text: str, overrides: list[str], message: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(InputError) as error:
        load_config(Cart, path, overrides)
    assert str(error.value) == message.format(path=path)


@pytest.mark.parametrize("content", [b"a: [b", b"a: b: c", b"\xff\xfe\x00", b"x\x00", b"name: ${nowhere}", b"name: ???"])
def test_broken_files_become_one_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "broken.yaml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"broken\.yaml: ") as error:
        load_config(Cart, path)
    assert "\n" not in str(error.value)


def test_missing_file_names_those_that_exist(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"there is no config file .*absent\.yaml; the project's own .* adapt\.yaml, .*mixed\.yaml"):
        load_config(Cart, tmp_path / "absent.yaml")


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.name)
def test_every_config_of_the_project_loads(path: Path) -> None:
    config = load_config(config_class(path) if path.stem in ("root3d", "planar", "lobstr", "lower_body", "restore") else PpoConfig, path)
    assert config.name == path.stem


def test_adapt_is_the_thesis_s_table() -> None:
    # Table 4.3, and 35,000 epochs of 65,536 samples.
    config = load_config(PpoConfig, next(path for path in CONFIGS if path.name == "adapt.yaml"))
    learner, collect = config.learner, config.collect
    assert (learner.gamma, learner.gae_lambda, learner.clip_range, learner.epochs) == (0.99, 0.95, 0.2, 6)
    assert (collect.envs * collect.horizon, learner.minibatch) == (65536, 16384)
    assert (collect.envs, collect.horizon) == (4096, 16)
    assert learner.learning_rate == learner.final_learning_rate == 5e-5
    assert learner.action_std**2 == pytest.approx(0.03)
    assert (config.network.hidden, config.network.activation) == ((1024, 1024, 512), "tanh")
    assert config.samples == 35_000 * 65_536
    assert (config.task.observation_size, config.task.action_size, config.task.smoothing) == (273, 20, 0.2)


def test_unknown_key_of_the_real_config_is_named(tmp_path: Path) -> None:
    path = written(tmp_path, "learner: {gama: 0.9}")
    with pytest.raises(InputError, match=r"unknown key 'learner\.gama', did you mean 'learner\.gamma'\?"):
        load_config(PpoConfig, path)


@pytest.mark.parametrize("name", ["lobstr.yaml", "configs/lobstr.yaml"])
def test_the_packages_own_configs_are_found_from_anywhere(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert config_class(Path(name)) is LobstrConfig  # told by the file's "learns"
    assert load_config(LobstrConfig, Path(name)).name == "lobstr"
    with pytest.raises(InputError, match=r"there is no config file elsewhere/lobstr\.yaml"):
        load_config(LobstrConfig, Path("elsewhere/lobstr.yaml"))
    own = tmp_path / name
    own.parent.mkdir(exist_ok=True)
    own.write_text("learns: root\n")
    assert config_class(Path(name)) is RootConfig  # a user's own file of that name comes first
