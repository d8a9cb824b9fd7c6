"""Mimicking task; importing this package registers ``AdaptMimic-v0`` with Gymnasium."""

from importlib.util import find_spec

import gymnasium

if find_spec("datasets.motion") is None:
    import datasets

    raise ImportError(
        f"the package 'datasets' was found at {datasets.__file__}, which is not this project's; "
        "install this project into an environment without Hugging Face's 'datasets', or put it first on the path"
    )

gymnasium.register(
    id="AdaptMimic-v0",
    entry_point="envs.gym_env:AdaptMimicEnv",
    vector_entry_point="envs.gym_env:make_vector_env",
)
