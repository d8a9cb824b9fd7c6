"""What ``trainers.supervised`` can teach: for each job its config, its motion and its learner."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import torch

from configs.load import read_value
from datasets.library.motion_library import ClipInfo
from trainers.supervised.lobstr_config import LobstrConfig
from trainers.supervised.lobstr_data import prepare_lobstr_data
from trainers.supervised.lobstr_learner import LobstrLearner
from trainers.supervised.root_config import RootConfig
from trainers.supervised.root_data import prepare_root_data
from trainers.supervised.root_learner import RootLearner

Config = RootConfig | LobstrConfig


class Clips(Protocol):
    """Motion of which the clips are known."""

    @property
    def clips(self) -> tuple[ClipInfo, ...]:
        """What is known of each."""
        ...


class Data(Protocol):
    """What a run trains and selects on."""

    @property
    def training(self) -> Clips:
        """Clips to learn from."""
        ...

    @property
    def held_out(self) -> str:
        """The held-out performer, or "none"."""
        ...

    @property
    def identity(self) -> str:
        """What tells this motion from another."""
        ...


class Network(Protocol):
    """A network that writes itself."""

    def parameters(self) -> Any:
        """Return what is learnt."""
        ...

    def save(self, path: Path, card: dict[str, Any]) -> None:
        """Write it with its card."""
        ...


class Learner(Protocol):
    """Owner of a network that is trained."""

    @property
    def model(self) -> Network:
        """The network."""
        ...

    @property
    def samples(self) -> int:
        """Samples of an update."""
        ...

    def update(self, progress: float) -> torch.Tensor:
        """Improve the network on one batch; return its loss."""
        ...

    def score(self) -> dict[str, float]:
        """Return errors on the held-out performer, "loss" among them."""
        ...

    def get_state(self) -> dict[str, Any]:
        """Return everything that the next update depends on."""
        ...

    def set_state(self, state: dict[str, Any]) -> None:
        """Go back to a state."""
        ...


@dataclass(frozen=True)
class Job:
    """Something that can be learnt.

    Attributes:
        config: Class of its config, which says so in ``learns``.
        prepare: Takes ``config.data``, the folder of prepared motion and who is told of it.
        learner: Takes the config and what ``prepare`` returned.
        sample_unit: What is counted, in the plural.
        fixed_learner_settings: Settings of the learner that a run keeps when it goes on.
    """

    config: type[Config]
    prepare: Callable[..., Data]
    learner: Callable[..., Learner]
    sample_unit: str
    fixed_learner_settings: tuple[str, ...] = ()


JOBS = {
    "root": Job(RootConfig, prepare_root_data, RootLearner, "windows", ("loss",)),
    "lower_body": Job(LobstrConfig, prepare_lobstr_data, LobstrLearner, "frames"),
}


def config_class(path: Path) -> type[Config]:
    """Return the class of the config in a file, by what it ``learns``; a root model's where the file does not say or is broken."""
    return JOBS.get(str(read_value(path, "learns")), JOBS["root"]).config
