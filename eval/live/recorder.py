"""Recordings of live sessions: frames are written to disk as they come, and another process converts them to BVH, so that nobody waits.

A recording in progress is a hidden file of plain numbers (the spool). After a crash ``python -m eval.live.recorder FILE ...`` converts it.
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

from configs.errors import InputError
from configs.exit_codes import run_command
from configs.source_code import PROJECT_ROOT
from datasets.formats.bvh import write_bvh
from datasets.motion.clip import BodyMotion
from datasets.motion.humanoid import BODY_COUNT
from datasets.retarget.humanoid_bvh import to_humanoid_bvh
from datasets.trackers.trackers import TRACKER_RATE_HZ

MAX_RECORDING_MIN = 30.0  # min, of a file; a longer recording continues in another one
SPOOL_SUFFIX = ".frames"
_VALUES_PER_FRAME = 4 + 4 * BODY_COUNT  # scale, root, rotations
_DIGITS = 6  # decimals of centimetres and degrees in the file


@dataclass
class Recording:
    """A recording in progress.

    Attributes:
        file: Open spool.
        spool: Path of the spool.
        target: Path of the BVH file that it becomes.
        frames: Number of frames so far.
    """

    file: BinaryIO
    spool: Path
    target: Path
    frames: int = 0


class Recorder:
    """Records the live frames of all users, each stretch between two calibrations as a recording of its own."""

    def __init__(self, folder: Path, log: Callable[[str], None], minutes: float = MAX_RECORDING_MIN) -> None:
        """Prepare recordings of at most so many minutes in a folder.

        Raises:
            InputError: If the folder cannot be made or written to.
        """
        self._folder, self._log, self._max_frames = folder.absolute(), log, max(1, round(minutes * 60 * TRACKER_RATE_HZ))
        self._recordings: dict[int, Recording] = {}
        self._failed: set[int] = set()  # users whose recording could not be written: logged once
        self._saving: set[asyncio.Task[None]] = set()
        self._turn = asyncio.Semaphore(1)  # recordings are converted one after the other, as the remaining users need the machine
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"--record {folder}: cannot be made ({error.strerror}); name a folder that can") from error
        if not os.access(folder, os.W_OK | os.X_OK):
            raise InputError(f"--record {folder}: cannot be written to; name a folder that can")

    def record(self, user: int, root: np.ndarray, rotations: np.ndarray, scale: float) -> None:
        """Add a frame of a user: root position (3,) [m], local rotations (20, 4), size relative to the standard skeleton."""
        if user in self._failed:
            return
        try:
            recording = self._recordings.get(user) or self._begin(user)
            recording.file.write(np.concat([[scale], root, rotations.reshape(-1)], dtype=np.float32).tobytes())
        except OSError as error:
            self._failed.add(user)
            self._log(f"recording of user {user} stops: {error.strerror}")
            self.close(user)
            return
        recording.frames += 1
        if recording.frames >= self._max_frames:
            self.close(user)

    def close(self, user: int) -> None:
        """End a user's recording, if there is one, and start to save it."""
        recording = self._recordings.pop(user, None)
        if recording is None:
            return
        try:
            recording.file.close()
        except OSError as error:
            self._log(f"the end of {recording.target} is lost: {error.strerror}")
        task = asyncio.get_running_loop().create_task(self._save(recording))
        self._saving.add(task)
        task.add_done_callback(self._saving.discard)

    async def finish(self) -> None:
        """End all recordings and wait until they are saved."""
        for user in list(self._recordings):
            self.close(user)
        while self._saving:
            await asyncio.gather(*self._saving)

    def _begin(self, user: int) -> Recording:
        """Open a recording under an unused name."""
        stem = f"{time.strftime('%Y%m%d-%H%M%S')}_user{user}"
        for attempt in range(1, 1000):
            name = stem if attempt == 1 else f"{stem}_{attempt}"
            spool, target = self._folder / f".{name}{SPOOL_SUFFIX}", self._folder / f"{name}.bvh"
            try:
                file = spool.open("xb")
            except FileExistsError:
                continue
            if target.exists():  # checked after the spool was created: two services never write the same file
                file.close()
                spool.unlink()
                continue
            self._recordings[user] = Recording(file, spool, target)
            return self._recordings[user]
        raise FileExistsError(0, f"{stem} is taken a thousand times")

    async def _save(self, recording: Recording) -> None:
        """Convert a recording to BVH in a process that Ctrl-C at the terminal does not reach."""
        command = [sys.executable, "-m", "eval.live.recorder", str(recording.spool)]
        async with self._turn:
            try:
                process = await asyncio.create_subprocess_exec(
                    *command, stderr=asyncio.subprocess.PIPE, start_new_session=True, cwd=PROJECT_ROOT
                )
                _, said = await process.communicate()
                reason = said.decode(errors="replace").strip().rpartition("\n")[2] if process.returncode else ""
            except OSError as error:
                reason = str(error.strerror)
        if reason:
            self._log(f"{recording.target} could not be saved ({reason}); it is kept: python -m eval.live.recorder {recording.spool}")
        else:
            self._log(f"saved {recording.target}: {recording.frames / TRACKER_RATE_HZ:.1f} s")


def save_recording(spool: Path) -> Path:
    """Convert a spool to the BVH file beside it, at the user's own size, and remove the spool.

    Returns:
        Path of the BVH file.

    Raises:
        InputError: If there is no such recording, or the BVH file exists already or cannot be written.
    """
    target = spool.with_name(spool.name.removeprefix(".").removesuffix(SPOOL_SUFFIX) + ".bvh")
    if spool.suffix != SPOOL_SUFFIX or not spool.is_file():
        raise InputError(f"{spool}: no recording; one is a hidden file whose name ends with {SPOOL_SUFFIX}")
    if target.exists():
        raise InputError(f"{target} is there already; move it away")
    numbers = np.fromfile(spool, dtype=np.float32)
    whole = len(numbers) // _VALUES_PER_FRAME * _VALUES_PER_FRAME  # a crash may have cut the last frame
    rows = numbers[:whole].reshape(-1, _VALUES_PER_FRAME).astype(float)
    if not len(rows):
        raise InputError(f"{spool}: holds no frame; remove it")
    scale = float(rows[0, 0])
    clip = BodyMotion(rows[:, 1:4] / scale, rows[:, 4:].reshape(-1, BODY_COUNT, 4), TRACKER_RATE_HZ, target.stem)
    bvh = to_humanoid_bvh(clip)
    values = bvh.values.copy()
    values[:, :3] *= scale
    sites = tuple(tuple((x * scale, y * scale, z * scale) for x, y, z in ends) for ends in bvh.end_sites)
    write_bvh(target, replace(bvh, offsets=(bvh.offsets * scale).round(_DIGITS), end_sites=sites, values=values.round(_DIGITS)))
    spool.unlink()
    return target


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m eval.live.recorder", description="Save recordings that a crash left behind as BVH.")
    parser.add_argument("spools", nargs="+", type=Path, metavar="FILE", help=f"a hidden file of a recording folder, named .*{SPOOL_SUFFIX}")
    options = parser.parse_args(arguments)

    def save() -> None:
        for spool in options.spools:
            save_recording(spool)

    return run_command(save)


if __name__ == "__main__":
    sys.exit(main())
