"""What is wrong before any cause is named: how large the residual is, where, when and in which direction.

The residual is what the motion demands less what the plates measured, in the short windows that the causes
are judged by. Beside each size stands the noise floor: the size that a sound recording of the same motion
would have, from the balance's own covariance at the typical scale of model errors.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.contact.wrenches import TWO_FEET
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.noise.balance_rows import TrialRows
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.terms import Solved, Term

WORST_S = 0.5  # a stance or a push: what people can look up in a video
WHOLE_SHARE = 0.5  # of the worst half second at least has windows
TYPICAL_SCALE = 1.0  # of model errors, the middle of their prior
LEAST_SPEED_M_PER_S = 0.3  # over the standing foot; somebody slower goes nowhere
LEAST_ALONG = 0.9  # cosine between the way and an axis of the ground, for the axis to be called forward

Direction = Literal["forward", "sideways", "vertical"]

SINGLE, DOUBLE = "single_support", "double_support"
ON_NO_FOOT, NO_LOAD = "load_on_no_foot", "no_load"
_WITHOUT_ONE_FOOT = {-1: DOUBLE, -2: ON_NO_FOOT, -3: NO_LOAD}


@dataclass(frozen=True)
class ResidualSize:
    """Root mean squares of the force and of the moment about the centre of mass, beside the noise floor."""

    seconds: float  # that were looked at
    force_N: float
    force_floor_N: float
    moment_Nm: float
    moment_floor_Nm: float


@dataclass(frozen=True, kw_only=True)
class PhaseResidual(ResidualSize):
    """While one foot is loaded, several are, a load is on no foot, or no plate is loaded."""

    phase: str
    foot: str | None  # that bears the load, in single support


@dataclass(frozen=True, kw_only=True)
class AxisResidual(ResidualSize):
    """Components along one axis of the ground."""

    axis: str
    direction: str | None  # of the person; None: where it goes does not follow an axis, or is unknown
    mean_force_N: float  # required beyond the measured


@dataclass(frozen=True, kw_only=True)
class WorstResidual(ResidualSize):
    """The worst half second of a trial."""

    frames: tuple[int, int]


@dataclass(frozen=True)
class ResidualOverTime:
    """Norms over time; `after` is what the named causes leave, as they were fitted."""

    time_s: tuple[float, ...]  # from the trial's start, the middle of each window
    force_N: tuple[float, ...]
    force_after_N: tuple[float, ...]
    force_floor_N: tuple[float, ...]
    moment_Nm: tuple[float, ...]
    moment_after_Nm: tuple[float, ...]
    moment_floor_Nm: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class TrialResidual(ResidualSize):
    """One trial, and its worst half second."""

    trial: str
    worst: WorstResidual
    time_history: ResidualOverTime


@dataclass(frozen=True, kw_only=True)
class Residual(ResidualSize):
    """The residual of all trials together without any cause, and its parts."""

    phases: tuple[PhaseResidual, ...]  # those that occur, the one that lasts longest first
    axes: tuple[AxisResidual, ...]
    trials: tuple[TrialResidual, ...]


def describe_residual(balance: Balance, solved: Solved, uncorrected: Sequence[Term] = ()) -> Residual:
    """Describe the residual that the recordings have without any cause.

    Args:
        balance: of all trials, markers repaired.
        solved: the named causes, fitted together.
        uncorrected: what reading the files corrected already; it is described as if it had not been.
    """
    rows = balance.residual - sum((t.fixed for t in uncorrected if t.fixed is not None), np.zeros(1))
    firsts = balance.start[: len(balance.trials) + 1] // 6
    parts = _Parts(
        before=rows.reshape(-1, 6),
        after=solved.left_of(balance.residual).reshape(-1, 6),
        variance=_variance(balance).reshape(-1, 6),
        seconds=np.concatenate([np.full(t.windows.count, _step_s(t)) for t in balance.trials]),
    ).of(slice(firsts[-1]))
    own = [slice(first, last) for first, last in pairwise(firsts)]
    phases = np.concatenate([_phase_of_windows(trial) for trial in balance.trials])
    return Residual(
        **vars(parts.size()),
        phases=_by_phase(parts, phases, _feet(balance.scenes)),
        axes=_by_axis(parts, balance.scenes),
        trials=tuple(_of_trial(t, parts.of(k)) for t, k in zip(balance.trials, own, strict=True)),
    )


@dataclass(frozen=True, eq=False)
class _Parts:
    """Windows of any trials: wrenches about the centre of mass, ground frame."""

    before: Float[np.ndarray, "windows 6"]
    after: Float[np.ndarray, "windows 6"]
    variance: Float[np.ndarray, "windows 6"]  # of a sound recording
    seconds: Float[np.ndarray, " windows"]  # that each window stands for

    def of(self, chosen: slice | Bool[np.ndarray, " windows"]) -> "_Parts":
        return _Parts(self.before[chosen], self.after[chosen], self.variance[chosen], self.seconds[chosen])

    def size(self, axes: slice = slice(0, 3)) -> ResidualSize:
        """Of force and moment; of some of their components only, if told which."""
        (force, moment), (force_floor, moment_floor) = (
            np.sqrt(squares[:, :, axes].sum(axis=2).mean(axis=0)).tolist() for squares in self._squares
        )
        return ResidualSize(float(self.seconds.sum()), force, force_floor, moment, moment_floor)

    @property
    def scores(self) -> Float[np.ndarray, " windows"]:
        """Squares over the noise floor's, force and moment added."""
        before, floor = (squares.sum(axis=2) for squares in self._squares)
        return np.asarray((before / floor.mean(axis=0)).sum(axis=1))

    @property
    def _squares(self) -> tuple[Float[np.ndarray, "windows 2 3"], Float[np.ndarray, "windows 2 3"]]:
        return (self.before**2).reshape(-1, 2, 3), self.variance.reshape(-1, 2, 3)


def _variance(balance: Balance) -> Float[np.ndarray, " rows"]:
    """Of a sound recording's rows: the diagonal of K."""
    typical = balance.noise_grid.nearest(TYPICAL_SCALE, 1.0)
    return balance.basis.of.variance(typical.scale, typical.slack)


def _step_s(trial: TrialRows) -> float:
    """From window to window of an unbroken stretch."""
    starts = trial.windows.start
    frames = np.diff(starts).min() if len(starts) > 1 else trial.windows.length
    return float(frames / trial.scene.rate)


def _of_trial(trial: TrialRows, parts: _Parts) -> TrialResidual:
    first, last = _worst(trial, parts)
    start = trial.windows.start
    inside = np.zeros(trial.windows.count, dtype=bool)
    inside[first : last + 1] = True
    (force, moment), (force_after, moment_after), (force_floor, moment_floor) = (
        np.linalg.norm(values.reshape(-1, 2, 3), axis=2).T.tolist()
        for values in (parts.before, parts.after, np.sqrt(parts.variance))
    )
    frames = int(start[first]), int(start[last]) + trial.windows.length
    return TrialResidual(
        **vars(parts.size()),
        trial=trial.scene.name,
        worst=WorstResidual(**vars(parts.of(inside).size()), frames=frames),
        time_history=ResidualOverTime(
            time_s=tuple((trial.windows.centre / trial.scene.rate).tolist()),
            force_N=tuple(force),
            force_after_N=tuple(force_after),
            force_floor_N=tuple(force_floor),
            moment_Nm=tuple(moment),
            moment_after_Nm=tuple(moment_after),
            moment_floor_Nm=tuple(moment_floor),
        ),
    )


def _worst(trial: TrialRows, parts: _Parts) -> tuple[int, int]:
    """First and last window of the half second that exceeds the noise floor most."""
    start = trial.windows.start
    room = round(WORST_S * trial.scene.rate) - trial.windows.length
    last = np.searchsorted(start, start + max(room, 0), side="right") - 1
    count = last - np.arange(len(start)) + 1
    total = np.concatenate([[0.0], np.cumsum(parts.scores)])
    mean = (total[last + 1] - total[:-1]) / count
    mean[count < WHOLE_SHARE * count.max()] = -np.inf
    first = int(mean.argmax())
    return first, int(last[first])


def _feet(scenes: Sequence[Scene]) -> tuple[str, ...]:
    return tuple(sole.foot_body for sole in scenes[0].soles)


def _phase_of_windows(trial: TrialRows) -> Int[np.ndarray, " windows"]:
    """At each window's middle: the index of the one loaded foot; else below zero, see `_WITHOUT_ONE_FOOT`."""
    middle = np.clip(np.rint(trial.windows.centre).astype(int), 0, trial.scene.frames - 1)
    return _phase_of_frames(trial.scene)[middle]


def _phase_of_frames(scene: Scene) -> Int[np.ndarray, " frames"]:
    contacts = scene.contacts
    loaded = np.stack(
        [contacts.in_contact[:, _of_sole(scene, k)].any(axis=1) for k in range(len(scene.soles))], axis=1
    )
    plates = np.stack([plate.loaded for plate in scene.plates], axis=1)
    shared = (plates & (contacts.plate == TWO_FEET)).any(axis=1)
    phase = np.where(plates.any(axis=1), -2, -3)
    count = loaded.sum(axis=1)
    phase[count == 1] = loaded.argmax(axis=1)[count == 1]
    phase[(count > 1) | shared] = -1
    return phase


def _of_sole(scene: Scene, k: int) -> list[int]:
    """Columns of the contacts that are part of the k-th sole: toes go with their foot."""
    sole = scene.soles[k]
    own = {sole.foot_body, *(scene.skeleton.body_names[part.body] for part in sole.parts)}
    return [i for i, name in enumerate(scene.contacts.foot_bodies) if name in own]


def _by_phase(
    parts: _Parts, phases: Int[np.ndarray, " windows"], feet: tuple[str, ...]
) -> tuple[PhaseResidual, ...]:
    found = []
    for phase in np.unique(phases):
        foot = feet[phase] if phase >= 0 else None
        name = _WITHOUT_ONE_FOOT.get(int(phase), SINGLE)
        found.append(PhaseResidual(**vars(parts.of(phases == phase).size()), phase=name, foot=foot))
    return tuple(sorted(found, key=lambda f: -f.seconds))


def _by_axis(parts: _Parts, scenes: Sequence[Scene]) -> tuple[AxisResidual, ...]:
    directions = _directions(scenes)
    return tuple(
        AxisResidual(
            **vars(parts.size(slice(i, i + 1))),
            axis=axis,
            direction=directions.get(axis),
            mean_force_N=float(parts.before[:, i].mean()),
        )
        for i, axis in enumerate("xyz")
    )


def _directions(scenes: Sequence[Scene]) -> dict[str, Direction]:
    """What the axes of the ground are to the person, where all trials agree about that."""
    along = {_way(scene) for scene in scenes}
    if along == {"x"}:
        return {"x": "forward", "y": "vertical", "z": "sideways"}
    if along == {"z"}:
        return {"x": "sideways", "y": "vertical", "z": "forward"}
    return {"y": "vertical"}


def _way(scene: Scene) -> str | None:
    """The axis that the centre of mass moves along over the loaded feet, also on a belt."""
    speed, frames = np.zeros(3), 0
    centre = np.gradient(scene.com_ground, 1 / scene.rate, axis=0)
    for i, name in enumerate(scene.contacts.foot_bodies):
        foot = scene.p_ground_body[:, scene.skeleton.body_index(name)]
        inside = scene.contacts.in_contact[:, i] & scene.counts
        speed += (centre - np.gradient(foot, 1 / scene.rate, axis=0))[inside].sum(axis=0)
        frames += int(inside.sum())
    level = speed[[0, 2]] / max(frames, 1)
    size = float(np.linalg.norm(level))
    if size < LEAST_SPEED_M_PER_S:
        return None
    share = np.abs(level) / size
    return None if share.max() < LEAST_ALONG else "xz"[int(share.argmax())]
