"""What a cause looks like in the scene, as data: an arrow, a ball, segments, markers, plates.

Fields name parameters of the cause, with {} for the axis; empty where it has none. Where the target is a
body, all is drawn there.
"""

from dataclasses import dataclass


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
