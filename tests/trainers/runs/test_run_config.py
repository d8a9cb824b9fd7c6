"""Bad values of the settings that all trainings share become one line."""

import pytest

from configs.errors import InputError
from trainers.algorithms.ppo_config import PpoConfig
from trainers.runs.run_config import RunConfig
from trainers.supervised.lobstr_config import LobstrConfig
from trainers.supervised.lower_body_config import LowerBodyConfig
from trainers.supervised.root_config import RootConfig


@pytest.mark.parametrize("config", [PpoConfig, RootConfig, LobstrConfig, LowerBodyConfig])
@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("samples", 0, "samples is 0, should be 1 or more"),
        ("evaluate_every", 0, "evaluate_every is 0, should be 1 or more"),
        ("checkpoint_every", -1, "checkpoint_every is -1, should be 1 or more"),
        ("minutes", -0.5, r"minutes is -0\.5, should be 0 \(no limit\) or more"),
        ("name", "a/b", "name is 'a/b', should be a folder's name"),
    ],
)
def test_bad_values_are_one_line(config: type[RunConfig], field: str, value: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        config(**{field: value})  # type: ignore[arg-type]
