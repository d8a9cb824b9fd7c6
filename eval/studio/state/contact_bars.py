"""Contacts of a foot as bars of frames, and the edits that move, add and remove them."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from datasets.motion.clip import FPS
from datasets.motion.frame_spans import true_spans
from eval.clean.edits import FEET, ContactEdit, Edits

TIME_DECIMALS = 4  # of an edit's times [s]


class Bar(NamedTuple):
    """A foot's contact: frames from ``start`` up to ``stop``."""

    foot: str
    start: int
    stop: int


class ContactTrack(NamedTuple):
    """Contacts of both feet and the time of their first frame.

    Attributes:
        contacts: Whether the left and the right foot stand, at 60 fps, shape (T, 2).
        start_s: Time of the first frame in the file [s].
    """

    contacts: np.ndarray
    start_s: float

    def bars(self, foot: str) -> list[Bar]:
        """Return the bars of a foot in the order of time."""
        return [Bar(foot, int(start), int(stop)) for start, stop in true_spans(self.contacts[:, FEET.index(foot)])]

    def bar_at(self, foot: str, frame: int) -> Bar | None:
        """Return the bar of a foot that a frame lies in, if there is one."""
        return next((bar for bar in self.bars(foot) if bar.start <= frame < bar.stop), None)

    def edit(self, foot: str, start: int, stop: int, stands: bool) -> ContactEdit:
        """Return the edit by which a foot stands, or does not, in frames from ``start`` up to ``stop``.

        Its ends lie half-way between frames, so that no rounding decides about a frame.
        """
        first, last = (max(0.0, round(self.start_s + (frame - 0.5) / FPS, TIME_DECIMALS)) for frame in (start, stop))
        return ContactEdit(foot, first, last, stands)


def with_contact(edits: Edits, contact: ContactEdit) -> Edits:
    """Return edits with one more contact; earlier ones that it hides are left out."""

    def is_hidden(other: ContactEdit) -> bool:
        return other.foot == contact.foot and contact.start_s <= other.start_s and other.stop_s <= contact.stop_s

    return replace(edits, contacts=(*(other for other in edits.contacts if not is_hidden(other)), contact))


def without_edits_in(edits: Edits, start_s: float, stop_s: float) -> Edits:
    """Return edits without those contacts and spans that begin within a span [s]."""
    contacts = tuple(one for one in edits.contacts if not start_s <= one.start_s < stop_s)
    return replace(edits, contacts=contacts, spans=tuple(one for one in edits.spans if not start_s <= one.start_s < stop_s))


def moved_bar(edits: Edits, track: ContactTrack, bar: Bar, start: int, stop: int) -> Edits:
    """Return edits by which a bar has other ends; only the frames that differ are edited."""
    changes = [
        (bar.start, min(start, bar.stop), False),
        (max(stop, bar.start), bar.stop, False),
        (start, min(bar.start, stop), True),
        (max(bar.stop, start), stop, True),
    ]
    for first, last, stands in changes:
        if first < last:
            edits = with_contact(edits, track.edit(bar.foot, first, last, stands))
    return edits
