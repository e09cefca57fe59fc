"""What a direct check says: a figure measured without a model of the body, and what it speaks for."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum


class About(StrEnum):
    """Classes of causes that a direct check can speak for or against."""

    ENTERED_MASS = "entered_mass"  # the mass that was entered is not this person's
    LOAD = "load"  # a load, an object on a plate or another person, in one trial
    OFF_PLATE = "off_plate"  # a foot beside the plates
    CLOCK = "clock"
    FILTER = "filter"
    PLATE_SIGN = "plate_sign"
    PLATE_ZERO = "plate_zero"
    PLATE_SCALE = "plate_scale"
    PLATE_PLACE = "plate_place"
    PLATE_TURN = "plate_turned_or_mirrored"  # turned about the vertical, or mirrored
    SLIP = "slip"  # of one marker
    SEGMENT = "segment"  # several markers that moved together


# 150 to 1: what a direct check says for a class is stated from here on; each trial has ten figures
STATED_NATS = 5.0
REFUTING_NATS = 10.0  # 20 000 to 1; one step that carries the entered mass has 13 against half or double
SOUND_DOF = 8.0  # tails of what sound recordings show: real ones stray, some far
FAULTY_DOF = 2.0  # and of the sizes of faults: some are huge
MOST_NATS = 50.0  # samples that a program set leave no doubt at all; evidence elsewhere does


@dataclass(frozen=True)
class Statement:
    """One figure of one direct check.

    `nats` is the log of how much likelier the figure is if something of a class is wrong than if all is
    sound; negative where it speaks against it.
    """

    direct_check: str
    sentence: str  # for people: what was measured, with its doubt, and what a sound recording shows
    nats: Mapping[About, float]
    figures: Mapping[str, float]  # by name with unit
    trial: str | None = None
    target: str | None = None  # "plate_1", a marker
    against: tuple[str, ...] = field(default=())  # other trials that it was held against

    @property
    def loudest(self) -> float:
        """The most that it says for any class [nats]."""
        return max(self.nats.values(), default=0.0)

    def spoken_for(self, least_nats: float) -> tuple[About, ...]:
        """Classes that it speaks for by so much, the clearest first."""
        loud = [about for about, nats in self.nats.items() if nats >= least_nats]
        return tuple(sorted(loud, key=lambda about: -self.nats[about]))


def nats_of(figure: float, std: float, sound: float, usual: float, axes: int = 1) -> float:
    """How much likelier a figure is if something is wrong than if all is sound [nats].

    Both are Student's t about zero, the one as wide as faults usually are, the other as sound recordings
    scatter, each with the figure's own error. A distance in a plane is of two coordinates together, and is
    seldom as small as either.

    Args:
        figure: measured; 0 is sound.
        std: of its own error.
        sound: scale of what sound recordings show beyond it.
        usual: scale of faults.
        axes: how many coordinates make the figure; scales are of each.
    """
    faulty, whole = math.hypot(std, usual), math.hypot(std, sound)
    return _log_t(figure, faulty, FAULTY_DOF, axes) - _log_t(figure, whole, SOUND_DOF, axes)


def _log_t(size: float, scale: float, dof: float, axes: int) -> float:
    """Log density of Student's t in so many dimensions at a distance from its middle."""
    constant = math.lgamma(0.5 * (dof + axes)) - math.lgamma(0.5 * dof) - 0.5 * axes * math.log(math.pi * dof)
    return constant - axes * math.log(scale) - 0.5 * (dof + axes) * math.log1p((size / scale) ** 2 / dof)
