"""Recordings of live sessions: frames go to disk as they come, and become BVH files in another process, so that nobody waits for them.

While a take lasts it is a hidden file of plain numbers. After a crash ``python -m eval.live.recorder FILE ...`` saves what it holds.
"""

import argparse
import asyncio
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from configs.command import exit_code_of
from configs.errors import InputError
from configs.source_code import ROOT
from datasets.formats.bvh import write_bvh
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_COUNT
from datasets.retarget.humanoid_bvh import bvh_of
from datasets.trackers.trackers import RATE

MINUTES = 30.0  # of a file; what lasts longer goes on in another one
SPOOL = ".frames"
_ROW = 4 + 4 * BODY_COUNT  # scale, root, rotations
_DIGITS = 6  # of centimetres and degrees in the file


@dataclass
class Take:
    """A recording that goes on: its file of numbers, the BVH it will be, and its frames so far."""

    file: BinaryIO
    spool: Path
    target: Path
    frames: int = 0


class Recorder:
    """Keeps the live frames of all users, each stretch between two calibrations as a take of its own."""

    def __init__(self, folder: Path, tell: Callable[[str], None], minutes: float = MINUTES) -> None:
        """Keep takes of at most so many minutes in a folder.

        Raises:
            InputError: If it cannot be made or written to.
        """
        self._folder, self._tell, self._longest = folder.absolute(), tell, max(1, round(minutes * 60 * RATE))
        self._takes: dict[int, Take] = {}
        self._failed: set[int] = set()  # users whose take could not be written: told once
        self._saving: set[asyncio.Task[None]] = set()
        self._turn = asyncio.Semaphore(1)  # takes are saved one after the other: the users who are left need the machine
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"--record {folder}: cannot be made ({error.strerror}); name a folder that can") from error
        if not os.access(folder, os.W_OK | os.X_OK):
            raise InputError(f"--record {folder}: cannot be written to; name a folder that can")

    def record(self, user: int, root: np.ndarray, rotations: np.ndarray, scale: float) -> None:
        """Add a frame of a user: root position (3,) [m], local rotations (20, 4), size against the standard skeleton."""
        if user in self._failed:
            return
        try:
            take = self._takes.get(user) or self._begin(user)
            take.file.write(np.concat([[scale], root, rotations.reshape(-1)], dtype=np.float32).tobytes())
        except OSError as error:
            self._failed.add(user)
            self._tell(f"recording of user {user} stops: {error.strerror}")
            self.close(user)
            return
        take.frames += 1
        if take.frames >= self._longest:
            self.close(user)

    def close(self, user: int) -> None:
        """End a user's take, if there is one, and begin to save it."""
        take = self._takes.pop(user, None)
        if take is None:
            return
        try:
            take.file.close()
        except OSError as error:
            self._tell(f"the end of {take.target} is lost: {error.strerror}")
        task = asyncio.get_running_loop().create_task(self._save(take))
        self._saving.add(task)
        task.add_done_callback(self._saving.discard)

    async def finish(self) -> None:
        """End all takes and wait until they are saved."""
        for user in list(self._takes):
            self.close(user)
        while self._saving:
            await asyncio.gather(*self._saving)

    def _begin(self, user: int) -> Take:
        """Open a take under a name that nobody has."""
        stem = f"{time.strftime('%Y%m%d-%H%M%S')}_user{user}"
        for attempt in range(1, 1000):
            name = stem if attempt == 1 else f"{stem}_{attempt}"
            spool, target = self._folder / f".{name}{SPOOL}", self._folder / f"{name}.bvh"
            try:
                file = spool.open("xb")
            except FileExistsError:
                continue
            if target.exists():  # looked at after the spool was taken: two services never write the same file
                file.close()
                spool.unlink()
                continue
            self._takes[user] = Take(file, spool, target)
            return self._takes[user]
        raise FileExistsError(0, f"{stem} is taken a thousand times")

    async def _save(self, take: Take) -> None:
        """Turn a take into its BVH in a process that Ctrl-C at the terminal does not reach."""
        command = [sys.executable, "-m", "eval.live.recorder", str(take.spool)]
        async with self._turn:
            try:
                process = await asyncio.create_subprocess_exec(*command, stderr=asyncio.subprocess.PIPE, start_new_session=True, cwd=ROOT)
                _, said = await process.communicate()
                reason = said.decode(errors="replace").strip().rpartition("\n")[2] if process.returncode else ""
            except OSError as error:
                reason = str(error.strerror)
        if reason:
            self._tell(f"{take.target} could not be saved ({reason}); it is still in {take.spool}: python -m eval.live.recorder")
        else:
            self._tell(f"saved {take.target}: {take.frames / RATE:.1f} s")


def save_take(spool: Path) -> Path:
    """Turn a file of numbers into the BVH beside it, at the user's own size, and remove it.

    Returns:
        The BVH.

    Raises:
        InputError: If there is no such take, or the BVH is there already or cannot be written.
    """
    target = spool.with_name(spool.name.removeprefix(".").removesuffix(SPOOL) + ".bvh")
    if spool.suffix != SPOOL or not spool.is_file():
        raise InputError(f"{spool}: no take; one is a hidden file whose name ends with {SPOOL}")
    if target.exists():
        raise InputError(f"{target} is there already; move it away")
    numbers = np.fromfile(spool, dtype=np.float32)
    rows = numbers[: len(numbers) // _ROW * _ROW].reshape(-1, _ROW).astype(float)  # a crash may have cut the last one
    if not len(rows):
        raise InputError(f"{spool}: holds no frame; remove it")
    scale = float(rows[0, 0])
    clip = BodyMotion(rows[:, 1:4] / scale, rows[:, 4:].reshape(-1, BODY_COUNT, 4), RATE, target.stem)
    bvh = bvh_of(clip)
    values = bvh.values.copy()
    values[:, :3] *= scale
    sites = tuple(tuple((x * scale, y * scale, z * scale) for x, y, z in ends) for ends in bvh.end_sites)
    write_bvh(target, replace(bvh, offsets=(bvh.offsets * scale).round(_DIGITS), end_sites=sites, values=values.round(_DIGITS)))
    spool.unlink()
    return target


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m eval.live.recorder", description="Save takes that a crash left behind as BVH.")
    parser.add_argument("takes", nargs="+", type=Path, metavar="FILE", help=f"a hidden file of a recording folder, named .*{SPOOL}")
    options = parser.parse_args(arguments)

    def save() -> None:
        for take in options.takes:
            save_take(take)

    return exit_code_of(save)


if __name__ == "__main__":
    sys.exit(main())
