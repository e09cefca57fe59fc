"""Causes made for tests of the search: wrenches of known time history, some rare, some bounded."""

from dataclasses import dataclass

import numpy as np

from solver.diagnosis.causes.effect import Candidate, Corrected, Estimate, Signature


def named(selection) -> list[tuple[str, str]]:
    return [(f.contender.term.candidate.id, f.contender.term.candidate.target) for f in selection.found]


@dataclass(frozen=True)
class Helper(Candidate):
    """Does what a lighter body does, but for a tenth that only a true cause would explain."""

    id = "helper"

    def signature(self, scene, eta):
        shaken = 0.05 * scene.required_ground * np.sin(20 * scene.times)[:, None]
        return Signature((shaken - 0.05 * scene.required_ground)[:, :, None], np.ones(1))

    parameters = ("size",)

    def is_notable(self, estimates):
        return True


@dataclass(frozen=True)
class Shake(Helper):
    """Shakes what is required, and does nothing else."""

    id = "shake"

    def signature(self, scene, eta):
        shaken = scene.measured_ground * np.sin(20 * scene.times)[:, None]
        return Signature(shaken[:, :, None], np.ones(1))


@dataclass(frozen=True, eq=False)
class TimeHistory(Candidate):
    """A wrench of known time history and unknown size."""

    wrench_ground: np.ndarray

    id = "time_history"

    def signature(self, scene, eta):
        return Signature(self.wrench_ground[:, :, None], np.ones(1))

    parameters = ("size",)
    least = 0.2


@dataclass(frozen=True)
class Shaken(Corrected):
    """Reading the files took 40 N off."""

    id = "shaken"

    def signature(self, scene, eta):
        return Signature.of_fixed(np.zeros((scene.frames, 6)))

    def uncorrected_ground(self, scene):
        return scene.measured_ground + np.array([40.0, 0, 0, 0, 0, 0])

    def estimates(self, scenes, fit):
        return {"force_N": Estimate(40.0, 1.0)}

    def is_notable(self, estimates):
        return True


@dataclass(frozen=True, eq=False)
class SeenElsewhere(TimeHistory):
    """A small one that something else than the balance shows."""

    id = "seen"

    @property
    def seen_elsewhere(self):
        return 1000.0


@dataclass(frozen=True, eq=False)
class Limb(TimeHistory):
    """Rare, seldom large, and never as large as it would have to be alone."""

    id = "limb"

    def signature(self, scene, eta):
        return Signature(self.wrench_ground[:, :, None], np.full(1, 0.3))

    most = 0.9


@dataclass(frozen=True, eq=False)
class Bounded(TimeHistory):
    """Of bounded size, and seldom large."""

    id = "bounded"
    smallest: float = 0.0
    largest: float = 0.0
    usual: float = 1.0

    least = property(lambda self: self.smallest)
    most = property(lambda self: self.largest)

    def signature(self, scene, eta):
        return Signature(self.wrench_ground[:, :, None], np.full(1, self.usual))


@dataclass(frozen=True)
class Swing(Shake):
    """Swings of what the plates measure, at some rates together."""

    rates: tuple[tuple[float, float], ...] = ()  # [rad/s], share

    id = "swing"

    def signature(self, scene, eta):
        return Signature(swung(scene, self.rates)[:, :, None], np.ones(1))


@dataclass(frozen=True)
class RareSwing(Swing):
    """Likewise, but seldom met."""

    id = "rare_swing"


@dataclass(frozen=True)
class SmallSwing(Swing):
    """Likewise, beside it."""

    id = "small_swing"


def swung(scene, rates):
    return scene.measured_ground * sum(share * np.sin(rate * scene.times) for rate, share in rates)[:, None]
