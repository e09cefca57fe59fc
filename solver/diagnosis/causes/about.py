"""Everything about a cause that is no mathematics: names, words, odds, sizes, readings and picture.

It stands beside the cause, in the file of its effect. Diagnosis and app ask here, never for an id.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from enum import Enum

OF_EACH_TRIAL = "{trial}"  # in the name of a parameter that each trial has, and in its text
NOT_SHOWN = "this recording does not show"
ON_SEGMENT = "{distance} from the segment's origin, at {point} in its axes"


class AtFault(Enum):
    """What is not as it should be."""

    RECORDING = "recording"
    MODEL = "model"
    MOVEMENT = "movement"


class TimeHistory(Enum):
    """How a cause acts over time."""

    BY_LAW = "by a law"  # a few parameters tell it in every frame
    ALL_ALONG = "any, all along"  # it may change in any way: never described to the last newton
    NOW_AND_THEN = "any, now and then"  # likewise, and each time with a force of its own
    EVENT = "from a moment on"  # of markers


class Weight(Enum):
    """What the person's masses, adjusted to the rest of the recording, take in whether it is named or not."""

    MASS = "mass"
    SUPPORT = "support"


class CorrectedBy(Enum):
    """How it is corrected in later fits of the same recording."""

    ACCEPTED = "accepted"  # its parameters become part of the fit
    FLAGGED = "flagged"  # its frames are flagged; may be accepted as well
    LABELS = "labels"  # exchanged back
    FILES = "files"  # corrected in the files
    NOTHING = "nothing"  # nothing corrects it afterwards


class Named(Enum):
    """What its target names."""

    ALL = "all"
    PLATES = "plates"
    BODIES = "bodies"
    MARKERS = "markers"


@dataclass(frozen=True)
class Reading:
    """How one parameter is said: `{amount}`, `{signed}`, and `{which}` by its sign (above zero, below)."""

    parameter: str
    text: str
    unit: str
    factor: float = 1.0  # from the parameter's unit to `unit`
    zero: float = 0.0  # what no effect is
    which: tuple[str, str] | None = None


@dataclass(frozen=True)
class Place:
    """How three parameters that make one point are said together: `{distance}` and `{point}`."""

    parameters: str  # with {} for the axis
    text: str
    unit: str
    factor: float = 1.0
    unknown: str = ""  # said instead of a point whose spread is larger than its distance


def along(
    parameters: str, text: str, unit: str, factor: float = 1.0, axes: str = "xyz"
) -> tuple[Reading, ...]:
    """One reading an axis, its sign told as the end of the axis that it points to.

    Args:
        parameters: their names, with {} for the axis.
        text: likewise.
        unit: as said.
        factor: from the parameters' unit to that.
        axes: of these.
    """
    return tuple(
        Reading(parameters.format(a), text.format(a), unit, factor, which=(f"+{a}", f"−{a}")) for a in axes
    )


def of_each_trial(readings: Iterable[Reading | Place], parameters: Iterable[str]) -> list[Reading | Place]:
    """Readings of a parameter that each trial has, one for each trial; the others as they are.

    Args:
        readings: of a cause.
        parameters: names in its answer.
    """
    said: list[Reading | Place] = []
    for reading in readings:
        if isinstance(reading, Place) or OF_EACH_TRIAL not in reading.parameter:
            said.append(reading)
            continue
        before, after = reading.parameter.split(OF_EACH_TRIAL)
        for name in parameters:
            if name.startswith(before) and name.endswith(after):
                trial = name[len(before) : len(name) - len(after)]
                said.append(replace(reading, parameter=name, text=reading.text.replace(OF_EACH_TRIAL, trial)))
    return said


# What a cause looks like in the scene. Fields name its parameters, with {} for the axis; empty where it has
# none. Where the target is a body, all is drawn there.


@dataclass(frozen=True)
class Steady:
    """A force that stays the same: along the ground's axes [N], or upward."""

    vector: str = ""
    upward: str = ""


@dataclass(frozen=True)
class Band:
    """A tension along the line to a point of the room [m]: mean [N], stiffness [N/m], rest length [m]."""

    mean: str
    stiffness: str
    rest_length: str
    anchor: str


@dataclass(frozen=True)
class AgainstMotion:
    """A force against the velocity v: b |v|^exponent."""

    b: str
    exponent: str


@dataclass(frozen=True)
class Arrow:
    """A force on a body, from where it acts; its time history, if the answer has one, goes before all."""

    force: Steady | Band | AgainstMotion
    point: str = ""  # [m] in the body's frame; its centre of mass where empty
    like_ground_force: bool = False  # drawn at the scale of ground forces
    mean_on_label: bool = False  # the parameters' own mean, not that of the frames drawn


@dataclass(frozen=True)
class Ball:
    """A mass [kg] at a point of the body [m]."""

    mass: str
    point: str = ""


@dataclass(frozen=True)
class Segments:
    """The target's segments, marked."""


@dataclass(frozen=True)
class Markers:
    """The target's markers, marked."""


@dataclass(frozen=True)
class Plates:
    """Outlines of the target's plates; shifted [m] or turned about the vertical [°], as they really lie."""

    shift: str = ""
    yaw: str = ""


Picture = Arrow | Ball | Segments | Markers | Plates


@dataclass(frozen=True)
class Entry:
    """Its row in the catalogue of the documentation, in Markdown."""

    target: str = ""  # what may be named: `plate_k`, a body, markers
    happened: str = ""  # best as an equation between what was recorded and what is true
    parameters: str = ""  # names of what `estimates` tells


@dataclass(frozen=True)
class Size:
    """How large a parameter is where the cause is there, counted from no effect, in the parameter's unit."""

    parameter: str
    usual: float
    rare: float  # beyond it 1 in 100
    most: float  # beyond it nobody has seen it, or physics forbids it
    why: str


@dataclass(frozen=True)
class About:
    """One cause of the catalogue."""

    id: str
    entry: Entry = Entry()
    title: str = ""  # a few words; {target} is filled in
    sentence: str = ""  # what it means, for people; {target} is filled in
    remedy: str = ""  # what to do about it in the laboratory
    separate_by: str = ""  # what to record so that it can be told from what looks alike
    branch: str = ""  # in the tree of names
    at_fault: AtFault = AtFault.RECORDING
    names: Named = Named.ALL
    time_history: TimeHistory = TimeHistory.BY_LAW
    weight: Weight | None = None
    corrected_by: CorrectedBy = CorrectedBy.ACCEPTED
    in_markers: bool = False  # seen in the markers, before any force
    seen_standing: bool = False  # the motion shows it as well: no unknown force takes its place
    is_a_clock: bool = False  # of all plates: two of such beside each other are one, told twice
    doubts_angles: bool = False  # joint angles are wrong with it
    odds_against: float = 0.0  # log prior odds [nats]: rare, or what generic models imitate
    less_at_first: float = 0.0  # [nats] less is asked of it as first cause: no model's error looks like it
    usual_std: float = 0.0  # of its parameters, what every laboratory has [their unit]
    asked_up_to: float | None = None  # a sound recording tells from which size on it would have been found,
    # up to this, in the unit of its readings: larger ones would be seen at once, or cannot be
    sizes: tuple[Size, ...] = ()
    readings: tuple[Reading | Place, ...] = ()
    targets: dict[str, str] = field(default_factory=dict, hash=False)  # targets that have words of their own
    picture: Picture | None = None  # None: a label alone

    @property
    def free(self) -> bool:
        """Whether it may change in any way over time."""
        return self.time_history in (TimeHistory.ALL_ALONG, TimeHistory.NOW_AND_THEN)

    @property
    def at_certain_frames(self) -> bool:
        """Whether its frames are told one stretch after the other."""
        return self.time_history in (TimeHistory.NOW_AND_THEN, TimeHistory.EVENT)
