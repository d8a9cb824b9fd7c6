"""The command ``adapt-mimic clean``: where it is, how it is called, and its process, which is looked at and never waited for."""

import os
import shutil
import signal
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from .addon_error import AddonError

COMMAND = "adapt-mimic"
QUALITIES, STAGES = ("fast", "good", "best"), ("restore", "physics")  # the command's own words
BLENDERS_OWN = ("PYTHONHOME", "PYTHONPATH", "PYTHONSTARTUP")  # of the environment, where they would lead the command's Python astray
MAX_REASON = 300  # characters of what the command says where it fails
STOPPING_S = 5.0  # after which a command that was asked to stop is stopped


def find_command(given: str) -> str:
    """Return the path of the command.

    Args:
        given: Path in the preferences; empty for the command on the PATH.

    Raises:
        AddonError: If it is not there.
    """
    found = shutil.which(os.path.expanduser(given.strip()) or COMMAND)
    if found:
        return found
    if given.strip():
        raise AddonError(f"{given.strip()}, the command in the add-on's preferences, is no program; give the path of {COMMAND}")
    raise AddonError(f"{COMMAND} is not on the PATH; install the package, or give the command's path in the add-on's preferences")


@dataclass(frozen=True)
class CleaningCall:
    """How a clip is to be cleaned.

    Attributes:
        command: Path of the command.
        quality: Quality of the search.
        without: Stages to leave out.
        mapping: Path of a file that names the joints; empty where they are found.
        zero_ground: Whether the ground is put on height 0.
    """

    command: str
    quality: str
    without: tuple[str, ...] = ()
    mapping: str = ""
    zero_ground: bool = False


def cleaning_arguments(call: CleaningCall, source: Path, out: Path) -> list[str]:
    """Return the words that clean a file.

    Args:
        call: How it is to be cleaned.
        source: BVH file, Z up as Blender's world.
        out: BVH file to write.
    """
    threads = max((os.cpu_count() or 1) - 1, 1)  # one core is Blender's
    left_out = [word for stage in call.without for word in ("--without", stage)]
    named = ["--mapping", call.mapping] if call.mapping else []
    options = [
        "--quality",
        call.quality,
        *left_out,
        *named,
        *(["--ground", "zero"] if call.zero_ground else []),
        "--up",
        "z",
        "--threads",
        str(threads),
        "--json",
    ]
    return [call.command, "clean", str(source), "--out", str(out), *options]


def command_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the environment of the command: this process's, without what is for Blender's own Python."""
    return {name: value for name, value in environment.items() if name not in BLENDERS_OWN} | {"PYTHONIOENCODING": "utf-8"}


class CommandProcess:
    """A command that runs beside this program; what it prints goes into files, so that nothing here ever waits for it."""

    def __init__(self, arguments: list[str], folder: Path) -> None:
        """Start the command.

        Args:
            arguments: The words of the call.
            folder: Folder to work in.

        Raises:
            AddonError: If it does not start.
        """
        self._said, self._complained = folder / "stdout.txt", folder / "stderr.txt"
        self._read = 0  # bytes of what was said that were handed out
        with self._said.open("wb") as said, self._complained.open("wb") as complained:
            try:
                self._process = subprocess.Popen(
                    arguments,
                    cwd=folder,
                    env=command_environment(os.environ),
                    stdin=subprocess.DEVNULL,
                    stdout=said,
                    stderr=complained,
                    start_new_session=os.name == "posix",  # so that its own processes stop with it
                    creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
                )
            except OSError as error:
                raise AddonError(
                    f"{arguments[0]} does not start ({error.strerror}); give the path of {COMMAND} in the preferences"
                ) from error

    def new_lines(self) -> list[str]:
        """Return the whole lines that it has printed since this was last asked."""
        with self._said.open("rb") as file:
            file.seek(self._read)
            new = file.read()
        whole = new[: new.rfind(b"\n") + 1]
        self._read += len(whole)
        return whole.decode("utf-8", errors="replace").splitlines()

    def exit_code(self) -> int | None:
        """Return the exit code, None while it runs."""
        return self._process.poll()

    def complaint(self) -> str:
        """Return the last line that it wrote to standard error, without what stands before the message."""
        lines = [line.strip() for line in self._complained.read_text(encoding="utf-8", errors="replace").splitlines() if line.strip()]
        said = lines[-1] if lines else f"it ended with exit code {self._process.returncode} and said nothing"
        line = "".join(letter if letter.isprintable() else " " for letter in said)
        return line.partition("error: ")[2][:MAX_REASON] or line[:MAX_REASON]

    def stop(self) -> None:
        """Stop it and all processes that it started; nothing happens where it has ended."""
        if self._process.poll() is not None:
            return
        self._signal(signal.SIGTERM)
        try:
            self._process.wait(STOPPING_S)
        except subprocess.TimeoutExpired:
            self._signal(getattr(signal, "SIGKILL", signal.SIGTERM))
            self._process.wait()

    def _signal(self, number: int) -> None:
        if os.name == "posix":
            os.killpg(self._process.pid, number)  # the leader of its own group
        else:
            self._process.terminate()
