"""What ``adapt-mimic clean --json`` prints, one JSON object a line, and what the timeline and the panel make of it."""

import json
from dataclasses import dataclass, field
from typing import Any

FEET = {"left": "L", "right": "R"}  # foot -> how markers name it
DOWN, UP, RESTART = "down", "up", "restart"
MARKERS = frozenset({RESTART, *(f"{foot} {what}" for foot in FEET.values() for what in (DOWN, UP))})  # names of all markers
MAX_TEXT = 1000  # characters of a notice that are kept


@dataclass(frozen=True)
class Notice:
    """A line for the user, and the time in the file of which it speaks [s]; None where it is about the whole clip."""

    text: str
    start_s: float | None = None


@dataclass
class CleaningEvents:
    """What the command has said so far.

    Attributes:
        stage: Name of the stage that runs.
        share: Share of the whole time that has passed, 0 to 1.
        seconds_left: Time that it will still take [s]; None before it is known.
        notices: Lines for the user, in the order in which they came.
        contacts: Foot, "left" or "right" -> spans in which it stands [s].
        restarts_s: Times at which the simulation began again [s].
        summary: Line on what was done; empty until it is.
        error: Line on what went wrong; empty if nothing did.
    """

    stage: str = "starting"
    share: float = 0.0
    seconds_left: float | None = None
    notices: list[Notice] = field(default_factory=list)
    contacts: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    restarts_s: list[float] = field(default_factory=list)
    summary: str = ""
    error: str = ""

    def take(self, line: str) -> None:
        """Take note of a line; whatever is no event of a known kind says nothing."""
        try:
            event = json.loads(line)
        except ValueError:
            return
        if not isinstance(event, dict):
            return
        takers = {"stage": self._take_stage, "notice": self._take_notice, "result": self._take_result, "error": self._take_error}
        taker = takers.get(event.get("event", ""))
        if taker:
            taker(event)

    def _take_stage(self, event: dict[str, Any]) -> None:
        self.stage = str(event.get("stage", self.stage))
        self.share = min(max(_number(event.get("overall")) or 0.0, self.share), 1.0)
        self.seconds_left = _number(event.get("seconds_left"))

    def _take_notice(self, event: dict[str, Any]) -> None:
        self.notices.append(Notice(_line(event.get("text")), _number(event.get("start_s"))))

    def _take_error(self, event: dict[str, Any]) -> None:
        self.error = _line(event.get("text"))

    def _take_result(self, event: dict[str, Any]) -> None:
        self.contacts = {foot: _spans(spans) for foot, spans in event.get("contacts", {}).items() if foot in FEET}
        self.restarts_s = [time for time in map(_number, event.get("restarts_s", [])) if time is not None]
        physics, seconds = _number(event.get("physics_share")) or 0.0, _number(event.get("seconds")) or 0.0
        took, restarts = _number(event.get("took_s")) or 0.0, len(self.restarts_s)
        told = f", restarted {restarts} times" if restarts else ""
        self.summary = f"{seconds:.1f} s cleaned in {took:.1f} s; {100.0 * physics:.0f} % of it is physics{told}"
        if event.get("read_as"):
            self.notices.insert(0, Notice(_line(event["read_as"])))

    def listed(self) -> list[Notice]:
        """Return the notices and the restarts: first those about the whole clip, then the others in the order of time."""
        every = [*self.notices, *(Notice("Restart of the simulation", time) for time in self.restarts_s)]
        return sorted(every, key=lambda one: (one.start_s is not None, one.start_s or 0.0))


def marker_times(events: CleaningEvents) -> list[tuple[float, str]]:
    """Return the markers of a cleaned clip in the order of time, each the time in the file [s] and its name: foot contacts and restarts."""
    steps = [(span, FEET[foot]) for foot, spans in events.contacts.items() for span in spans]
    found = [(time, f"{foot} {what}") for span, foot in steps for time, what in zip(span, (DOWN, UP), strict=True)]
    return sorted([*found, *((time, RESTART) for time in events.restarts_s)])


def frame_at(seconds: float, first_frame: int, fps: float) -> int:
    """Return the frame of the scene that is nearest to a time in the file [s]."""
    return first_frame + round(seconds * fps)


def _number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _spans(spans: Any) -> list[tuple[float, float]]:
    return [(float(start), float(stop)) for start, stop in spans]


def _line(text: Any) -> str:
    """Return a text as one line."""
    return " ".join(str(text).split())[:MAX_TEXT]
