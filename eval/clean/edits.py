"""What a person changed on one clip: foot contacts, spans, misalignments and the ground, with the settings that the clip is cleaned by.

All times are those of the clip's file [s]. A frame at time t lies in a span if start_s <= t < stop_s.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace

from configs.errors import InputError, require
from datasets.motion.humanoid import BODY_NAMES, split_side
from datasets.performer.reading_options import ReadingOptions
from eval.clean.quality import QUALITIES

RESTORE, PHYSICS = "restore", "physics"
STAGES = (RESTORE, PHYSICS)  # that can be left out
LEFT, RIGHT = "left", "right"
FEET = (LEFT, RIGHT)  # in the order of every array of contacts
MAX_TIME_S = 86_400.0  # s, of an edit: a day, longer than any take
MAX_GROUND_M = 10.0  # m, up and down
MAX_MISALIGNMENT_DEG = 180.0  # deg, of a rotation vector: half a turn reaches every rotation
MAX_EDITS = 10_000  # of each kind
CORRECTABLE_BODIES = tuple(name for name in BODY_NAMES if split_side(name)[0] != "hand")  # hands follow their forearms


class EditError(InputError):
    """An edit that does not fit its clip."""


@dataclass(frozen=True)
class ContactEdit:
    """Span of time in which a foot stands, or does not, because a person says so.

    Attributes:
        foot: ``LEFT`` or ``RIGHT``.
        start_s: First instant [s].
        stop_s: Instant after the last [s].
        stands: Whether the foot stands.
    """

    foot: str
    start_s: float
    stop_s: float
    stands: bool

    def __post_init__(self) -> None:
        """Check the values."""
        require(self.foot in FEET, "foot", repr(self.foot), f"one of {', '.join(FEET)}")
        require(isinstance(self.stands, bool), "stands", repr(self.stands), "true or false")
        _check_span(self.start_s, self.stop_s)


@dataclass(frozen=True)
class SpanEdit:
    """Span of time that is kept as recorded, or cleaned with settings of its own.

    Attributes:
        start_s: First instant [s].
        stop_s: Instant after the last [s].
        keep: Whether the span comes back as it was recorded; then nothing else counts.
        without: Stages of ``STAGES`` that are left out in the span.
        quality: Quality of the simulation in the span, one of ``QUALITIES``; None for the clip's.
    """

    start_s: float
    stop_s: float
    keep: bool = False
    without: tuple[str, ...] = ()
    quality: str | None = None

    def __post_init__(self) -> None:
        """Check the values."""
        require(isinstance(self.keep, bool), "keep", repr(self.keep), "true or false")
        _check_span(self.start_s, self.stop_s)
        _check_settings(self.without, self.quality)


@dataclass(frozen=True)
class MisalignmentEdit:
    """Constant misalignment of a segment that a person saw: the rotation that it is wrong by, on top of what was found.

    Attributes:
        body: Name of the body, one of ``CORRECTABLE_BODIES``.
        degrees: Rotation vector in the body's own frame [deg].
    """

    body: str
    degrees: tuple[float, float, float]

    def __post_init__(self) -> None:
        """Check the values."""
        require(self.body in CORRECTABLE_BODIES, "body", repr(self.body), f"one of {', '.join(CORRECTABLE_BODIES)}")
        right = len(self.degrees) == 3 and all(map(math.isfinite, self.degrees)) and math.hypot(*self.degrees) <= MAX_MISALIGNMENT_DEG
        require(right, f"degrees of {self.body}", list(self.degrees), f"three numbers of a rotation of {MAX_MISALIGNMENT_DEG:g} at most")


@dataclass(frozen=True)
class Edits:
    """What a person changed on one clip.

    Attributes:
        contacts: Feet that stand or do not; later ones win over earlier.
        spans: Spans that are kept, or cleaned otherwise; later ones win over earlier.
        misalignments: Misaligned segments, one for each body at most.
        ground_m: Height of the ground above the one that was found, in the file's world [m].
        reading: What the file was said to be.
        quality: Quality of the simulation, one of ``QUALITIES``; None for that of the pipeline.
        without: Stages of ``STAGES`` that are left out of the whole clip.
    """

    contacts: tuple[ContactEdit, ...] = ()
    spans: tuple[SpanEdit, ...] = ()
    misalignments: tuple[MisalignmentEdit, ...] = ()
    ground_m: float = 0.0
    reading: ReadingOptions = field(default_factory=ReadingOptions)
    quality: str | None = None
    without: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the values; lists become tuples."""
        for name in ("contacts", "spans", "misalignments", "without"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
            require(len(getattr(self, name)) <= MAX_EDITS, f"the number of {name}", len(getattr(self, name)), f"at most {MAX_EDITS}")
        bodies = [one.body for one in self.misalignments]
        require(len(set(bodies)) == len(bodies), "misalignments", "of one body twice", "one for each body")
        right = math.isfinite(self.ground_m) and abs(self.ground_m) <= MAX_GROUND_M
        require(right, "ground_m", self.ground_m, f"a height from -{MAX_GROUND_M:g} to {MAX_GROUND_M:g}")
        _check_settings(self.without, self.quality)

    @property
    def changes_nothing(self) -> bool:
        """Whether a clip is cleaned as without edits, but for how it is read and by which settings."""
        return not (self.contacts or self.spans or self.misalignments or self.ground_m)


def check_within(edits: Edits, start_s: float, stop_s: float) -> None:
    """Check that every edit touches the clip that it is of.

    Args:
        edits: Edits.
        start_s: Time of the clip's first frame [s].
        stop_s: Time of its last frame [s].

    Raises:
        EditError: If one does not; names it.
    """
    for kind, several in (("contacts", edits.contacts), ("spans", edits.spans)):
        for number, one in enumerate(several, 1):
            if one.start_s > stop_s or one.stop_s <= start_s:
                where, clip = f"{one.start_s:g} to {one.stop_s:g} s", f"{start_s:.2f} to {stop_s:.2f} s"
                raise EditError(f"{kind}, entry {number}, is from {where}, should be within the clip, from {clip}")


def combine_reading(told: ReadingOptions, edited: ReadingOptions) -> ReadingOptions:
    """Return what is said of a file by a command and by its edits; where both say something the command counts."""
    default = ReadingOptions()
    said = {one.name: getattr(told, one.name) for one in fields(told) if getattr(told, one.name) != getattr(default, one.name)}
    return replace(edited, **said | {"joints": {**edited.joints, **told.joints}})


def _check_span(start_s: float, stop_s: float) -> None:
    right = all(map(math.isfinite, (start_s, stop_s))) and 0.0 <= start_s < stop_s <= MAX_TIME_S
    require(right, "the span", f"from {start_s:g} to {stop_s:g} s", "one that ends after it begins, at 0 s or later")


def _check_settings(without: Sequence[str], quality: str | None) -> None:
    for stage in without:
        require(stage in STAGES, "a stage in 'without'", repr(stage), f"one of {', '.join(STAGES)}")
    require(quality is None or quality in QUALITIES, "quality", repr(quality), f"one of {', '.join(QUALITIES)}")
