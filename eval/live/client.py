"""Client of the live service: sends frames when they are due and collects the answers."""

import asyncio
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

from configs.errors import InputError
from datasets.trackers.trackers import TRACKER_NAMES, TRACKER_RATE_HZ, TrackerPoses
from eval.live.wire_protocol import MAX_LINE_BYTES, MAX_NAME_LENGTH, PROTOCOL_VERSION, Codec

TIMEOUT_S = 5.0  # s, for which the service may be silent


@dataclass
class PlaybackResult:
    """Result of sending frames to the service.

    Attributes:
        sent_times: Time at which each frame was sent, on ``perf_counter`` [s].
        answers: Answers by frame number.
        latencies_ms: Times from sending a frame to its answer [ms].
        messages: Errors and warnings of the service.
    """

    sent_times: list[float] = field(default_factory=list)
    answers: dict[int, dict[str, Any]] = field(default_factory=dict)
    latencies_ms: list[float] = field(default_factory=list)
    messages: list[str] = field(default_factory=list)

    @property
    def rate(self) -> float:
        """Frames sent per second [1/s]."""
        return (len(self.sent_times) - 1) / (self.sent_times[-1] - self.sent_times[0]) if len(self.sent_times) > 1 else 0.0


async def play(
    trackers: TrackerPoses, host: str, port: int, speed: float = 1.0, name: str = "", worn: Sequence[str] = TRACKER_NAMES
) -> PlaybackResult:
    """Send frames at true speed and collect the answers.

    Args:
        trackers: Tracker poses of T frames, shape (T, J, ...).
        host: Address of the service.
        port: Port of the service.
        speed: Factor on 45 frames a second.
        name: Name of the user.
        worn: Names of the user's trackers.

    Raises:
        InputError: If nothing listens there, it refuses, or it is no live service.
    """
    address = f"{host} port {port}"
    try:
        reader, writer = await asyncio.wait_for(asyncio.open_connection(host, port, limit=MAX_LINE_BYTES), TIMEOUT_S)
    except (OSError, TimeoutError) as error:
        raise InputError(f"{address}: nobody listens ({error or 'no answer'}); start it: python -m eval.live") from error
    codec = Codec.of("z-up", "".join(letter for letter in name if letter.isprintable())[:MAX_NAME_LENGTH], worn)
    try:
        await _greet(reader, writer, codec, address)
        lines = [codec.frame(number, TrackerPoses(*pose)) for number, pose in enumerate(zip(*trackers, strict=True))]
        played = PlaybackResult()
        listening = asyncio.create_task(_listen(reader, played))
        await _send(writer, lines, TRACKER_RATE_HZ * speed, played, listening)
        await listening
        return played
    finally:
        writer.close()


async def _greet(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, codec: Codec, address: str) -> None:
    """Send the hello and read the service's answer to it."""
    hello = {"lobstr": PROTOCOL_VERSION, "axes": codec.axes, "name": codec.name, "trackers": codec.trackers}
    writer.write(json.dumps(hello).encode() + b"\n")
    try:
        welcome = json.loads(await asyncio.wait_for(reader.readline(), TIMEOUT_S) or b"{}")
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(f"{address}: something listens, but is no live service ({error or 'silent'})") from error
    if not isinstance(welcome, dict) or welcome.get("lobstr") != PROTOCOL_VERSION:
        error = welcome.get("error") if isinstance(welcome, dict) else None
        raise InputError(f"{address}: {error or 'something listens, but is no live service'}")


async def _send(
    writer: asyncio.StreamWriter, lines: list[bytes], fps: float, played: PlaybackResult, listening: asyncio.Task[None]
) -> None:
    """Send each line when it is due, until the service closes the connection."""
    begin = perf_counter()
    for number, line in enumerate(lines):
        await asyncio.sleep(max(0.0, begin + number / fps - perf_counter()))
        if listening.done():
            return
        played.sent_times.append(perf_counter())
        writer.write(line)
    writer.write_eof()


async def _listen(reader: asyncio.StreamReader, played: PlaybackResult) -> None:
    """Collect answers until the service closes the connection."""
    try:
        while line := await asyncio.wait_for(reader.readline(), TIMEOUT_S):
            message = json.loads(line)
            if "state" in message:
                played.latencies_ms.append(1e3 * (perf_counter() - played.sent_times[message["frame"]]))
                played.answers[message["frame"]] = message
            else:
                played.messages.append(message.get("error") or message.get("warning") or line.decode())
    except (ValueError, KeyError, IndexError, TypeError, AttributeError):
        played.messages.append("the connection ended: an answer was none")
    except (OSError, TimeoutError) as error:
        played.messages.append(f"the connection ended: {error or 'silent'}")
