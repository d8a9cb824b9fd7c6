"""Trainings of ``trainers.supervised``: config, motion and learner of each."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from configs.load import read_value
from trainers.supervised.lobstr_config import LobstrConfig
from trainers.supervised.lobstr_data import LobstrData, prepare_lobstr_data
from trainers.supervised.lobstr_learner import LobstrLearner
from trainers.supervised.lower_body_config import LowerBodyConfig
from trainers.supervised.lower_body_data import LowerBodyData, prepare_lower_body_data
from trainers.supervised.lower_body_learner import LowerBodyLearner
from trainers.supervised.recurrent_root_learner import RecurrentRootLearner
from trainers.supervised.restore_config import RestoreConfig
from trainers.supervised.restore_data import RestoreData, prepare_restore_data
from trainers.supervised.restore_learner import RestoreLearner
from trainers.supervised.root_config import RootConfig
from trainers.supervised.root_data import RootData, prepare_root_data
from trainers.supervised.root_learner import RootLearner

Config = RootConfig | LobstrConfig | LowerBodyConfig | RestoreConfig
Data = RootData | LobstrData | LowerBodyData | RestoreData
Learner = RootLearner | RecurrentRootLearner | LobstrLearner | LowerBodyLearner | RestoreLearner


@dataclass(frozen=True)
class Job:
    """A kind of network to train.

    Attributes:
        config: Class of the config, whose ``learns`` names the job.
        prepare: Takes ``config.data``, the folder of prepared motion and a function that logs a line; returns the motion.
        learner: Takes the config and the motion; returns the learner.
        sample_unit: Unit in which samples are counted, in the plural.
        selected_by: Name of the score, lower is better, by which the best network is chosen.
        fixed_learner_settings: Settings of the learner that a resumed run must have in common with its beginning.
    """

    config: type[Config]
    prepare: Callable[..., Data]
    learner: Callable[..., Learner]
    sample_unit: str
    selected_by: str = "loss"
    fixed_learner_settings: tuple[str, ...] = ()


def make_root_learner(config: RootConfig, data: RootData) -> RootLearner | RecurrentRootLearner:
    """Return the learner for the network of a root model's config."""
    return (RecurrentRootLearner if config.model.is_recurrent else RootLearner)(config, data)


JOBS = {
    "root": Job(RootConfig, prepare_root_data, make_root_learner, "windows", fixed_learner_settings=("loss",)),
    "lower_body": Job(LobstrConfig, prepare_lobstr_data, LobstrLearner, "frames"),
    "legs": Job(LowerBodyConfig, prepare_lower_body_data, LowerBodyLearner, "frames"),
    "restore": Job(RestoreConfig, prepare_restore_data, RestoreLearner, "windows", selected_by="restored_error_mm"),
}


def config_class(path: Path) -> type[Config]:
    """Return the class of the config in a file by its ``learns``; a root model's where the file does not say or is broken."""
    return JOBS.get(str(read_value(path, "learns")), JOBS["root"]).config
