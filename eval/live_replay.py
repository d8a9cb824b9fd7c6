"""Replay of a clip to the live service as the trackers of a virtual user: ``python -m eval.live_replay CLIP``."""

import argparse
import asyncio
import sys

import numpy as np
from rich.console import Console

from configs.errors import InputError, require
from configs.exit_codes import run_command
from datasets.library.sources import load_clips
from datasets.motion.clip import BodyMotion
from datasets.trackers.trackers import LEG_TRACKER_NAMES, PELVIS_TRACKER, TRACKER_NAMES, TRACKER_RATE_HZ
from eval.live.client import PlaybackResult, play
from eval.live.virtual_user import TrackerReplay, measure_answers, replay_as_trackers
from eval.live.wire_protocol import DEFAULT_HOST, DEFAULT_PORT

WORN = NOT_WORN, TRACKER, IMU = "none", "tracker", "imu"  # what may be on a limb
DEFAULT_HEIGHT_CM = 171  # of one of the paper's users


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    made = argparse.ArgumentParser(prog="python -m eval.live_replay", description="Play a clip to the live service, without hardware.")
    made.add_argument("source", metavar="CLIP", help="a motion file, a folder of them, or 'synthetic'")
    made.add_argument("--name", metavar="CLIP", help="which clip, where the source holds several (default: the longest)")
    made.add_argument("--host", default=DEFAULT_HOST, help=f"where the service is (default: {DEFAULT_HOST})")
    made.add_argument("--port", type=int, default=DEFAULT_PORT, help=f"port of the service (default: {DEFAULT_PORT})")
    made.add_argument(
        "--height", type=float, default=DEFAULT_HEIGHT_CM, metavar="CM", help=f"height of the virtual user (default: {DEFAULT_HEIGHT_CM})"
    )
    made.add_argument("--seed", type=int, default=0, help="seed of the tracker placement and noise (default: 0)")
    made.add_argument("--feet", choices=WORN, default=NOT_WORN, help="trackers on the feet (default: none)")
    made.add_argument("--shins", choices=WORN, default=NOT_WORN, help="trackers on the shins, below the knees (default: none)")
    made.add_argument("--no-pelvis", action="store_true", help="no tracker on the pelvis")
    made.add_argument("--speed", type=float, default=1.0, help="frames come so many times as quickly (default: 1)")
    options = made.parse_args(arguments)
    return run_command(lambda: _run(options))


def _run(options: argparse.Namespace) -> None:
    require(0 < options.port < 65536, "--port", options.port, "a port, 1 to 65535")
    require(100.0 <= options.height <= 230.0, "--height", options.height, "100 to 230 cm")
    require(0.01 <= options.speed <= 100.0, "--speed", options.speed, "0.01 to 100")
    require(options.seed >= 0, "--seed", options.seed, "0 or more")
    clip = choose_clip(load_clips(options.source, fps=TRACKER_RATE_HZ), options.name)
    worn, imus = choose_trackers(options.feet, options.shins, not options.no_pelvis)
    replay = replay_as_trackers(
        clip, options.height / 100.0, options.seed, legs=options.feet != NOT_WORN or options.shins != NOT_WORN, imus=imus
    )
    print(f"{clip.name}: {clip.seconds:.1f} s as a user of {options.height:g} cm, T-pose first, to {options.host} port {options.port}")
    with Console(stderr=True).status("playing"):
        played = asyncio.run(play(replay.trackers, options.host, options.port, options.speed, clip.name, worn))
    for line in format_report(replay, played):
        print(line)
    if not played.answers:
        raise InputError("the service answered no frame")


def choose_trackers(feet: str, shins: str, pelvis: bool = True) -> tuple[list[str], list[str]]:
    """Return the names of the trackers that are worn, and of those of them that are IMUs, by what is on feet and shins, one of ``WORN``."""
    how = {"foot": feet, "shin": shins}
    legs = {name: how[name.partition("_")[0]] for name in LEG_TRACKER_NAMES}
    usual = [name for name in TRACKER_NAMES if pelvis or name != TRACKER_NAMES[PELVIS_TRACKER]]
    return usual + [name for name in legs if legs[name] != NOT_WORN], [name for name in legs if legs[name] == IMU]


def choose_clip(clips: list[BodyMotion], name: str | None) -> BodyMotion:
    """Return the clip of a name, or the longest if the name is None.

    Raises:
        InputError: If there is no clip of that name.
    """
    named = [clip for clip in clips if name in (None, clip.name)]
    if not named:
        raise InputError(f"--name {name}: no such clip; there are {', '.join(clip.name for clip in clips[:20])}")
    return max(named, key=len)


def format_report(replay: TrackerReplay, played: PlaybackResult) -> list[str]:
    """Return the lines of a replay's report: answers, latencies and errors."""
    lines = [f"service: {text}" for text in played.messages]
    if not played.answers:
        return lines
    delays, own = np.percentile(played.latencies_ms, [50, 99]), [answer["latency_ms"] for answer in played.answers.values()]
    lines.append(f"{len(played.answers)} of {len(played.sent_times)} frames answered, {played.rate:.1f} frames/s sent")
    lines.append(f"from sending to answer: median {delays[0]:.2f} ms, 99th percentile {delays[1]:.2f} ms")
    lines.append(f"of which the service: median {np.median(own):.2f} ms, 99th percentile {np.percentile(own, 99):.2f} ms")
    live = [number for number, answer in played.answers.items() if answer["state"] == "live" and number >= replay.first_clip_frame]
    if live:
        parts = [np.array([played.answers[number][key] for number in live]) for key in ("root", "rotations", "contacts")]
        found = measure_answers(replay, np.array(live) - replay.first_clip_frame, *parts)
        lines.append(
            f"toes: {100 * found.toe_error:.1f} cm from the truth with the pelvis in place, "
            f"{100 * found.toe_error_world:.1f} cm in the world; "
            f"contacts right in {100 * found.contact_accuracy:.1f} % ({found.frames} live frames of the clip)"
        )
    return lines


if __name__ == "__main__":
    sys.exit(main())
