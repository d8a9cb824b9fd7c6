"""Trainings by other RL libraries: the examples of docs/rl_libraries.md as they stand, a rollout and an update at a time."""

import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout
from importlib.util import find_spec
from queue import SimpleQueue
from threading import Thread
from typing import Any

import numpy as np
from torch.optim.optimizer import register_optimizer_step_pre_hook

from configs.errors import InputError
from configs.source_code import PROJECT_ROOT
from envs.vector_env import AdaptMimicVectorEnv

PAGE = PROJECT_ROOT / "docs" / "rl_libraries.md"
STEPS, ENV_ID = "200_000", '"envs:AdaptMimic-v0"'  # as every example has them
# By heading of the page: modules that the example needs, how they are installed, and what it steps.
LIBRARIES = {
    "Stable-Baselines3": (("stable_baselines3",), "stable-baselines3", "a single env in a DummyVecEnv"),
    "CleanRL": ((), "", "64 worlds of the native vector env, and two of Gymnasium's wrappers"),
    "RLlib": (("ray.rllib", "tree"), "'ray[rllib]'", "8 single envs in Gymnasium's SyncVectorEnv"),
    "TorchRL": (("torchrl",), "torchrl", "a single env in a GymWrapper"),
    "rsl_rl": (("rsl_rl",), "rsl-rl-lib", "64 worlds of the native vector env, and its adapter"),
}


def missing_libraries() -> list[str]:
    """Return the libraries that are not installed."""
    return [name for name, (modules, _, _) in LIBRARIES.items() if any(find_spec(module) is None for module in modules)]


def read_example(library: str, steps: int, motions: str | None = None) -> str:
    """Return the code under a heading of the page, for so many steps, on a motion source if one is given.

    Raises:
        InputError: If there is no page, as where the package was installed without its sources.
    """
    if not PAGE.is_file():
        raise InputError(f"{PAGE} is not there: the examples of the RL libraries are in the project's sources only")
    section = PAGE.read_text(encoding="utf-8").split(f"\n## {library}\n")[1].split("\n## ")[0]
    (code,) = re.findall(r"```python\n(.*?)```", section, flags=re.DOTALL)
    assert STEPS in code
    assert ENV_ID in code
    return code.replace(STEPS, str(steps)).replace(ENV_ID, f"{ENV_ID}, motions={motions!r}" if motions else ENV_ID)


class LibraryTraining:
    """Example that runs in a thread, which waits before each rollout and before each update.

    A rollout begins with the first step of an env after an update, and ends with an optimiser's first step after it.
    """

    def __init__(self, code: str) -> None:
        """Begin the example."""
        self._gate: SimpleQueue[None] = SimpleQueue()
        self._reports: SimpleQueue[int | BaseException] = SimpleQueue()
        self._steps, self._is_collecting = 0, False
        Thread(target=self._run, args=(code,), daemon=True).start()

    def collect(self) -> int:
        """Let the library collect a rollout; return its control steps."""
        return self._go_on()

    def update(self) -> int:
        """Let the library learn from the rollout; return its control steps."""
        return self._go_on()

    def _go_on(self) -> int:
        self._gate.put(None)
        report = self._reports.get()
        if isinstance(report, BaseException):
            raise report
        return report

    def _run(self, code: str) -> None:
        """Run the example, and report its end."""
        try:
            exec(compile(code, PAGE.name, "exec"), {})
            self._reports.put(RuntimeError("the example came to its end"))
        except BaseException as error:
            self._reports.put(error)

    def count_steps(self, worlds: int) -> None:
        """Count a control step of some worlds; the first of a rollout waits."""
        if not self._is_collecting:
            if self._steps:
                self._reports.put(self._steps)
            self._gate.get()
            self._steps, self._is_collecting = 0, True
        self._steps += worlds

    def begin_update(self, *_: Any) -> None:
        """Wait before an update's first step."""
        if self._is_collecting:
            self._reports.put(self._steps)
            self._gate.get()
            self._is_collecting = False


@contextmanager
def library_training(code: str) -> Iterator[LibraryTraining]:
    """Run an example in this process, all of whose envs and optimisers count as its; what it prints and writes is dropped."""
    step = AdaptMimicVectorEnv.step

    def counted(env: AdaptMimicVectorEnv, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        training.count_steps(env.num_envs)
        return step(env, actions)

    with (
        tempfile.TemporaryDirectory() as folder,
        chdir(folder),
        open(os.devnull, "w") as nothing,
        redirect_stdout(nothing),
        redirect_stderr(nothing),
    ):
        training = LibraryTraining(code)
        register_optimizer_step_pre_hook(training.begin_update)
        AdaptMimicVectorEnv.step = counted  # type: ignore[method-assign]
        yield training
