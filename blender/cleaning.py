"""One cleaning, from the armature's poses to the new action, in steps short enough for Blender to stay responsive in between."""

import shutil
import tempfile
import time
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import bpy  # type: ignore[import-not-found]  # Blender's own module
import numpy as np

from .addon_error import AddonError
from .armature_sampling import MODES, active_constraints, check_armature, find_armature, sample_frames, sample_motion
from .baking import add_action, all_bone_keys, set_markers, update_view
from .bvh_motion import ArmatureMotion, changed_poses, to_channels
from .bvh_text import DECIMALS, read_values, write_bvh
from .command import CleaningCall, CommandProcess, cleaning_arguments
from .events import MARKERS, CleaningEvents, Notice, frame_at, marker_times
from .rotations import nearest_rotations

SAMPLING_S = 0.2  # between two moments at which the user may do something else: more often costs more, as Blender's scenes change each time
POLL_S = 0.1  # between two looks at the command
MAX_CHECKED_FRAMES = 20
MAX_LISTED = 6  # names in a notice
MAX_PLACE_ERROR_RATIO, MAX_TURN_ERROR_DEG = 6e-4, 0.1  # of the skeleton's extent, a millimetre of a person, and degrees


class Status(NamedTuple):
    """What a cleaning does at the moment."""

    text: str
    share: float  # of the whole, 0 to 1
    waits: bool = False  # for something outside, so that the next step should come later


class Cleaning:
    """A cleaning of an armature's action."""

    def __init__(self, armature: Any, call: CleaningCall) -> None:
        """Check the armature.

        Args:
            armature: Object with the action to clean.
            call: How it is to be cleaned.

        Raises:
            AddonError: If it cannot be cleaned.
        """
        check_armature(armature)
        self.uid, self.action_uid = armature.session_uid, armature.animation_data.action.session_uid
        self._call, self._name = call, armature.name
        self.events = CleaningEvents()
        self.status = Status("Reading the action", 0.0)
        self.draft: Path | None = None  # of the joints' names, where they are not found
        self._folder: Path | None = None
        self._process: CommandProcess | None = None

    def steps(self) -> Iterator[Status]:
        """Clean; yield the status after each step, and stop where the armature has the new action.

        Raises:
            AddonError: If it cannot be done; nothing has changed then.
        """
        for status in self._steps():
            self.status = status
            yield status

    def stop(self) -> None:
        """Stop the command and take its files away."""
        if self._process:
            self._process.stop()
        if self._folder:
            shutil.rmtree(self._folder, ignore_errors=True)

    def _steps(self) -> Generator[Status, None, None]:
        self._folder = Path(tempfile.mkdtemp(prefix="adapt-mimic-"))
        source, out = self._folder / "motion.bvh", self._folder / "clean.bvh"
        motion = yield from _reported("Reading the action", 0.0, 0.05, sample_motion(find_armature(self.uid), SAMPLING_S))
        hierarchy, values = yield from _reported("Handing it over", 0.05, 0.06, to_channels(motion))
        before = np.round(values, DECIMALS)  # as they are written
        yield from _reported("Handing it over", 0.06, 0.08, write_bvh(source, hierarchy, before, motion.fps))
        yield from self._run_command(source, out)
        after = yield from _reported("Taking it back", 0.9, 0.92, read_values(out, hierarchy, len(before)))
        poses, keyed = yield from _reported("Comparing", 0.92, 0.94, changed_poses(motion, hierarchy, before, after))
        keys = yield from _reported("Making keys", 0.94, 1.0, all_bone_keys(self.uid, motion, poses, keyed))
        while bpy.context.mode not in MODES:  # whose undo would not hold the new action
            yield Status("Ready; waiting for Object or Pose Mode", 1.0, waits=True)
        armature = find_armature(self.uid)
        check_armature(armature)
        if armature.animation_data.action.session_uid != self.action_uid:
            raise AddonError(f"'{armature.name}' was given another action while it was cleaned; choose the recorded one and clean it again")
        self._finish(armature, motion, poses, keys)

    def _run_command(self, source: Path, out: Path) -> Generator[Status, None, None]:
        """Run the command on a file, and yield how far it is until it has ended."""
        self._process = CommandProcess(cleaning_arguments(self._call, source, out), source.parent)
        code = None
        while code is None:
            code = self._process.exit_code()  # first: what it says after its end is nothing
            for line in self._process.new_lines():
                self.events.take(line)
            left = self.events.seconds_left
            told = f"{self.events.stage[:1].upper()}{self.events.stage[1:]}" + (f", {left:.0f} s left" if left is not None else "")
            yield Status(told, 0.08 + 0.82 * self.events.share, waits=code is None)
        if code or not out.is_file():
            said = (self.events.error or self._process.complaint()).replace(str(source), "The action")
            draft = next(source.parent.glob("*.mapping.yaml"), None)
            if draft is None:
                raise AddonError(said)
            self.draft = keep_draft(draft, self._name)
            told = said.partition("; name them")[0]  # then it says how to call the command
            raise AddonError(f"{told}; set their names right in {self.draft}, a draft of Joint Names, and clean again")

    def _finish(self, armature: Any, motion: ArmatureMotion, poses: np.ndarray, keys: dict[str, dict[str, np.ndarray]]) -> None:
        """Give the armature the new action, with markers and what was found."""
        source, held = armature.animation_data.action, _influences(armature, list(keys))
        action = add_action(armature, motion.first_frame, keys)
        found = [(frame_at(time, motion.first_frame, motion.fps), name) for time, name in marker_times(self.events)]
        set_markers(action, found, MARKERS)
        update_view()
        notices = [*self.events.listed(), *_astray(armature, motion, poses)]
        if held:
            bones = listed(sorted({path.split('"')[1] for path, _ in held}))
            told = f"Constraints of these bones are off in the clean action: {bones}. Show Before turns them on again."
            notices.append(Notice(told))
        if not keys:
            notices.append(Notice("Nothing had to be changed: the action is as it was."))
        _keep(action, source, self.events.summary, notices, motion, held)


def _reported(text: str, begin: float, end: float, steps: Generator[float, None, Any]) -> Generator[Status, None, Any]:
    """Run steps that yield their share; yield it as a status, of which ``begin`` to ``end`` is theirs, and return what they return."""
    while True:
        try:
            share = next(steps)
        except StopIteration as done:
            return done.value
        yield Status(text, begin + (end - begin) * share)


def _influences(armature: Any, bones: list[str]) -> list[tuple[str, float]]:
    """Return the active constraints of bones: the path of each from the armature, and its influence."""
    found = [constraint for name in bones for constraint in active_constraints(armature.pose.bones[name])]
    return [(constraint.path_from_id(), constraint.influence) for constraint in found]


def _astray(armature: Any, motion: ArmatureMotion, poses: np.ndarray) -> list[Notice]:
    """Return a notice of bones that the new action does not put where they should be."""
    picked = np.unique(np.linspace(0, len(poses) - 1, MAX_CHECKED_FRAMES).astype(int))
    wanted, (real, _) = poses[picked], sample_frames(armature, list(motion.names), (picked + motion.first_frame).tolist())
    extent = float(np.ptp(motion.rest[:, :3, 3], axis=0).max())
    gaps = np.linalg.norm(wanted[..., :3, 3] - real[..., :3, 3], axis=-1).max(axis=0) / extent
    turned = nearest_rotations(wanted[..., :3, :3]).swapaxes(-1, -2) @ nearest_rotations(real[..., :3, :3])
    angles = np.degrees(2.0 * np.arcsin(np.clip(np.linalg.norm(turned - np.eye(3), axis=(-1, -2)) / np.sqrt(8.0), 0.0, 1.0))).max(axis=0)
    wrong = motion.is_joint & ((gaps > MAX_PLACE_ERROR_RATIO) | (angles > MAX_TURN_ERROR_DEG))
    if not wrong.any():
        return []
    names = listed(np.array(motion.names)[wrong].tolist())
    return [Notice(f"These bones are not where they should be, as constraints or drivers elsewhere hold them: {names}.")]


def listed(names: list[str]) -> str:
    """Return names as a list in a sentence."""
    more = f" and {len(names) - MAX_LISTED} more" if len(names) > MAX_LISTED else ""
    return ", ".join(names[:MAX_LISTED]) + more


def _keep(action: Any, source: Any, summary: str, notices: list[Notice], motion: ArmatureMotion, held: list[tuple[str, float]]) -> None:
    """Keep with an action what was done to it."""
    kept = action.adapt_mimic
    kept.source, kept.summary = source, summary
    kept.notices.clear()
    kept.constraints.clear()
    for notice in notices:
        one = kept.notices.add()
        one.text, one.timed = notice.text, notice.start_s is not None
        one.frame = frame_at(notice.start_s or 0.0, motion.first_frame, motion.fps)
    for path, influence in held:
        one = kept.constraints.add()
        one.path, one.influence = path, influence


def keep_draft(draft: Path, name: str) -> Path:
    """Copy a draft of a skeleton's joint names to where it stays, for an armature of some name; return the copy."""
    package = str(__package__)
    installed = package.startswith("bl_ext.")  # otherwise it runs from the checkout
    folder = Path(bpy.utils.extension_path_user(package, create=True) if installed else bpy.app.tempdir)
    kept = "".join(letter if letter.isalnum() else "_" for letter in name)
    return Path(shutil.copy(draft, folder / f"{kept}.mapping.yaml"))


def run_to_the_end(cleaning: Cleaning) -> None:
    """Run a cleaning without returning to Blender in between, as scripts and Blender without a window need it.

    Raises:
        AddonError: If it cannot be done; nothing has changed then.
    """
    try:
        for status in cleaning.steps():
            if status.waits:
                time.sleep(POLL_S)
    finally:
        cleaning.stop()


def run_for(steps: Iterator[Status], seconds: float) -> bool:
    """Run steps for some time [s], less where one waits for something; return whether all are done.

    Raises:
        AddonError: If the cleaning cannot be done; nothing has changed then.
    """
    end = time.monotonic() + seconds
    while (status := next(steps, None)) is not None:
        if status.waits or time.monotonic() > end:
            return False
    return True
