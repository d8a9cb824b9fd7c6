"""Reading of YAML files and command-line overrides into frozen dataclasses; a mistake in them becomes one clear line."""

import sys
from dataclasses import MISSING, Field, field, fields, is_dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar, cast

from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from configs.atomic_file import atomic_write
from configs.errors import InputError
from configs.source_code import PROJECT_ROOT

T = TypeVar("T")

CONFIG_DIR = PROJECT_ROOT / "configs"  # folder of the package's own config files


def formerly(old_key: str, default: Any) -> Any:
    """Return a dataclass field with a default that is also read from its old key in config files of earlier versions."""
    return field(default=default, metadata={"formerly": old_key})


def former_key(cls: Any, key: str) -> str:
    """Return the key that a field of a dataclass had in earlier versions; its own if that never changed."""
    return next((one.metadata.get("formerly", key) for one in fields(cls) if one.name == key), key)


def load_config(cls: type[T], path: Path, overrides: list[str] | None = None) -> T:
    """Return the config of a file with overrides applied.

    Args:
        cls: Frozen dataclass, possibly of dataclasses, with a default for every field.
        path: YAML file, or the name of one of the package's own; keys that it leaves out keep their defaults.
        overrides: Overrides of keys, such as ``learner.learning_rate=1e-4``.

    Raises:
        InputError: If the file is missing or no YAML, a key is unknown, or a value is bad.
    """
    path = _or_own(path)
    if not path.is_file():
        known = ", ".join(sorted(p.name for p in CONFIG_DIR.glob("*.yaml")))
        raise InputError(f"there is no config file {path}; the project's own in configs/ are {known}")
    for text in overrides or []:
        if "=" not in text:
            raise InputError(f"override '{text}' should have the form key.sub=value")
    try:
        written, typed = OmegaConf.load(path), OmegaConf.from_dotlist(overrides or [])
        for given, where in ((written, str(path)), (typed, "overrides")):
            _replace_old_keys(cls, given, "", where)
            _check_keys(cls, given, "", where)
        merged = OmegaConf.merge(OmegaConf.structured(cls), written, typed)
        return cast(T, OmegaConf.to_object(merged))
    except InputError:
        raise
    except OmegaConfBaseException as error:  # the first line of its text says what is wrong, its key where
        raise InputError(f"{path}: {error.full_key or 'the file'}: {str(error).splitlines()[0]}") from None
    except (YAMLError, ValueError) as error:
        raise InputError(f"{path}: {' '.join(str(error).split())}") from None


def read_value(path: Path, key: str) -> object:
    """Return the value of a top-level key of a YAML file; None if there is no such key, or no such file of YAML."""
    try:
        written = OmegaConf.load(_or_own(path))
        return written.get(key) if isinstance(written, DictConfig) else None
    except (OSError, OmegaConfBaseException, YAMLError, ValueError):
        return None


def save_config(config: Any, path: Path) -> None:
    """Write a resolved config as YAML.

    Raises:
        InputError: If the file cannot be written.
    """
    try:
        with atomic_write(path) as temporary:
            temporary.write_text(OmegaConf.to_yaml(OmegaConf.structured(config)))
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror}; make room there, or name another folder") from None


def _or_own(path: Path) -> Path:
    """Return a path, or the package's own config of that name where there is no such file: commands are called from anywhere."""
    own = CONFIG_DIR / path.name
    named = path.parent in (Path(), Path(CONFIG_DIR.name))
    return own if named and own.is_file() and not path.is_file() else path


def _replace_old_keys(cls: Any, given: object, prefix: str, where: str) -> None:
    """Rename keys of earlier versions in a table, with a line on stderr for each; drop removed keys that had no effect.

    Args:
        cls: Dataclass; its fields of ``formerly`` hold their old keys, its ``REMOVED_KEYS`` the values of removed keys without effect.
        given: Table that was read; changed in place.
        prefix: Keys that lead to the table, each followed by a dot.
        where: Source of the table, for messages.

    Raises:
        InputError: If an old key stands beside the new one, or a removed one has another value.
    """
    if not isinstance(given, DictConfig):
        return
    renamed = {one.metadata["formerly"]: one.name for one in fields(cls) if "formerly" in one.metadata}
    removed = getattr(cls, "REMOVED_KEYS", {})
    for old in [str(key) for key in given]:
        if old in removed:
            if given[old] != removed[old]:
                raise InputError(f"{where}: '{prefix}{old}' is no longer supported; leave it out")
            del given[old]
        elif old in renamed:
            new = renamed[old]
            if new in given:
                raise InputError(f"{where}: '{prefix}{old}' is the old name of '{prefix}{new}', which is there as well; leave it out")
            given[new] = given.pop(old)
            print(f"{where}: '{prefix}{old}' is now called '{prefix}{new}'", file=sys.stderr)
    for one in fields(cls):
        if one.name in given and is_dataclass(_default(one)):
            _replace_old_keys(type(_default(one)), given[one.name], f"{prefix}{one.name}.", where)


def _default(one: Field[Any]) -> object:
    """Return the default of a dataclass field."""
    return one.default if one.default_factory is MISSING else one.default_factory()


def _check_keys(cls: Any, given: object, prefix: str, where: str) -> None:
    """Raise InputError for the first key that the dataclass lacks, with the most similar key that it has."""
    known = {field.name: field for field in fields(cls)}
    if not isinstance(given, DictConfig):
        raise InputError(f"{where}: {prefix.rstrip('.') or 'the file'} should be a table of keys and values")
    for key, value in given.items():
        if str(key) not in known:
            near = get_close_matches(str(key), known, n=1, cutoff=0.0)
            raise InputError(f"{where}: unknown key '{prefix}{key}', did you mean '{prefix}{near[0]}'?")
        default = _default(known[str(key)])
        if is_dataclass(default):
            _check_keys(type(default), value, f"{prefix}{key}.", where)
