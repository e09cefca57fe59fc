"""What acts on the body beside the recorded forces, as the trajectory fit takes it; whatever it is due to."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from solver.dynamics.dynamics import BodyLoad, Dynamics
from solver.dynamics.root_wrench import about_point
from solver.dynamics.trajectory.trial_data import ExtraParameters, TrialData
from solver.kinematics.label_faults.fault import Exchange


@dataclass(frozen=True)
class Cause:
    """What an extension is made of, for people."""

    id: str  # of the catalogue
    target: str
    parameters: dict[str, tuple[float, float]]  # value and standard deviation, in the unit that the name has


@dataclass(frozen=True, eq=False)
class BodyWrench:
    """fixed + columns x, on one segment: force [N], moment about the ground origin [N·m]."""

    body: str | None  # None: on none in particular; counts for F = ma, not for joint torques
    fixed_ground: Float[np.ndarray, "frames 6"]
    columns_ground: Float[np.ndarray, "frames 6 extra"]

    def at(self, x: Float[np.ndarray, " extra"]) -> Float[np.ndarray, "frames 6"]:
        """For values of x."""
        return self.fixed_ground + self.columns_ground @ x


@dataclass(frozen=True, eq=False)
class TrialExtension:
    """What acts beside the recorded forces of one trial."""

    parts: tuple[BodyWrench, ...]
    known: Bool[np.ndarray, " frames"]  # False: the extended recording says nothing (a clock that ran out)
    evidence: Bool[np.ndarray, " frames"]  # recorded, tracked, and not taken out by a person

    def between(self, start: int, end: int) -> "TrialExtension":
        """Frames `start` to `end` (excluded); itself where these are all."""
        if (start, end) == (0, len(self.known)):
            return self
        parts = (
            replace(
                part, fixed_ground=part.fixed_ground[start:end], columns_ground=part.columns_ground[start:end]
            )
            for part in self.parts
        )
        return TrialExtension(tuple(parts), self.known[start:end], self.evidence[start:end])

    def loads(self, x: Float[np.ndarray, " extra"]) -> list[BodyLoad]:
        """What acts on segments, for values of x; what acts on none in particular bends no joint."""
        return [(part.body, part.at(x)) for part in self.parts if part.body is not None]

    @cached_property
    def fixed_ground(self) -> Float[np.ndarray, "frames 6"]:
        """Of all segments together."""
        return np.sum([part.fixed_ground for part in self.parts], axis=0)

    @cached_property
    def columns_ground(self) -> Float[np.ndarray, "frames 6 extra"]:
        """Of all segments together."""
        return np.sum([part.columns_ground for part in self.parts], axis=0)

    def added_to(self, data: TrialData, gain: float = 1.0) -> TrialData:
        """What the trial gives to the trajectory fit, with this beside its forces.

        Args:
            data: of the trial.
            gain: of its plates, that the recorded forces were divided by.
        """
        return replace(
            data,
            counts=data.counts & self.known,
            extra_wrench_ground=self.fixed_ground / gain,
            extra_columns_ground=self.columns_ground / gain,
        )


@dataclass(frozen=True, eq=False)
class Extension:
    """Causes that were found in a subject's trials: beside the forces, where they share x, and in labels."""

    causes: tuple[Cause, ...]
    prior_std: Float[np.ndarray, " extra"]
    x: Float[np.ndarray, " extra"]  # as the diagnosis found it; each fit finds it anew
    trials: Mapping[str, TrialExtension] = field(default_factory=dict)  # by name
    exchanges: tuple[Exchange, ...] = ()  # of labels, to be undone before anything is fitted

    @property
    def parameters(self) -> ExtraParameters | None:
        """As the trajectory fit takes them; None where nothing acts beside the forces."""
        return ExtraParameters(self.prior_std, self.x) if len(self.prior_std) else None

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256 of all that a fit takes from it."""
        digest = hashlib.sha256(repr((self.causes, sorted(self.trials))).encode())
        if self.exchanges:
            digest.update(repr(self.exchanges).encode())
        for values in (self.prior_std, self.x):
            digest.update(np.ascontiguousarray(values).tobytes())
        for name in sorted(self.trials):
            trial = self.trials[name]
            digest.update(trial.known.tobytes())
            for part in trial.parts:
                digest.update(str(part.body).encode())
                digest.update(np.ascontiguousarray(part.fixed_ground).tobytes())
                digest.update(np.ascontiguousarray(part.columns_ground).tobytes())
        return digest.hexdigest()

    @property
    def sentence(self) -> str:
        """Its causes in one line."""
        return ", ".join(f"{cause.id} ({cause.target})" for cause in self.named)

    @property
    def named(self) -> tuple[Cause, ...]:
        """All that a diagnosis named, exchanged labels included, each pair once."""
        pairs = dict.fromkeys("+".join(exchange.labels) for exchange in self.exchanges)
        return (*self.causes, *(Cause("marker_swap", pair, {}) for pair in pairs))


def with_extra_wrench(dynamics: Dynamics, extra: TrialExtension, x: Float[np.ndarray, " extra"]) -> Dynamics:
    """Residuals if this acts as well: less Σ w_b. Torques are those under the recorded forces still.

    Args:
        dynamics: under the recorded forces.
        extra: of the same trial.
        x: its parameters.
    """
    total = about_point(np.sum([part.at(x) for part in extra.parts], axis=0), dynamics.root_ground)
    return replace(
        dynamics,
        residual_root=dynamics.residual_root - total,
        residual_raw_root=dynamics.residual_raw_root - total,
        used=dynamics.used & extra.known,
    )
