"""Every force of unknown course against the balance, at all its sizes, beside any accepted causes.

A force's columns are splines times levers, each of which lasts for a few windows: only these are kept. Their
product with the precision of a rung is made once for each point of a body and serves every direction, every
size, and whatever is accepted, which only takes a matrix of low rank off it (see `screening`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg.lapack import dpotrf, dtrtrs

from solver.diagnosis.balance import Balance
from solver.diagnosis.covariances import Rung
from solver.diagnosis.remainder import Unknown, UnknownForce, UnknownMoment, unknown_forces
from solver.diagnosis.rows import TrialRows
from solver.diagnosis.screening import Beside
from solver.diagnosis.unknown_course import courses_of
from solver.effects.effect import Eta

Key = tuple[str, str, int, bytes]  # trial, body, courses, point


@dataclass(frozen=True, eq=False)
class Tried:
    """An unknown force or moment at its best size."""

    candidate: Unknown
    eta: Eta
    gain: float  # log evidence beyond the accepted causes, at the same rung
    x: Float[np.ndarray, " parameters"]


@dataclass(frozen=True, eq=False)
class Local:
    """Splines along the axes of force, then of moment, on the rows of one trial; a constant is their sum.

    Each spline lasts for some windows: of its rows only those are kept, from `first` on.
    """

    key: Key
    span: slice
    first: Int[np.ndarray, " splines"]
    columns: Float[np.ndarray, "splines axes some"]

    @staticmethod
    def of(key: Key, span: slice, columns: Float[np.ndarray, "windows 6 axes splines"]) -> "Local":
        """From all windows."""
        windows, axes = columns.shape[0], columns.shape[2]
        there = np.abs(columns).max(axis=(1, 2), initial=0.0) > 0
        first = np.where(there.any(axis=0), there.argmax(axis=0), 0)
        last = np.where(there.any(axis=0), windows - there[::-1].argmax(axis=0), 1)
        length = int((last - first).max())
        first = np.minimum(first, windows - length)
        of_each = [columns[f : f + length, :, :, k].reshape(-1, axes).T for k, f in enumerate(first)]
        return Local(key, span, 6 * first, np.stack(of_each))

    @property
    def splines(self) -> int:
        """How many."""
        return len(self.first)

    @property
    def axes(self) -> int:
        """How many each has."""
        return self.columns.shape[1]

    def times(self, rows: Float[np.ndarray, "own *some"]) -> Float[np.ndarray, "columns *some"]:
        """Columnsᵀ rows, one axis after the other."""
        found = np.empty((self.axes, self.splines, *rows.shape[1:]))
        for k, (first, columns) in enumerate(zip(self.first.tolist(), self.columns, strict=True)):
            found[:, k] = columns @ rows[first : first + columns.shape[1]]
        return found.reshape(self.axes * self.splines, *rows.shape[1:])

    def sum(self, sizes: Float[np.ndarray, "axes splines"]) -> Float[np.ndarray, " own"]:
        """All columns together, each of some size."""
        rows = np.zeros(self.span.stop - self.span.start)
        for k, (first, columns) in enumerate(zip(self.first.tolist(), self.columns, strict=True)):
            rows[first : first + columns.shape[1]] += sizes[:, k] @ columns
        return rows

    def with_constants(self, values: Float[np.ndarray, "columns *rest"]) -> Float[np.ndarray, "more *rest"]:
        """Something linear in columns, before each axis' splines that of their sum."""
        by_axis = values.reshape(len(values) // self.splines, self.splines, *values.shape[1:])
        whole = np.concatenate([by_axis.sum(axis=1, keepdims=True), by_axis], axis=1)
        return whole.reshape(whole.shape[0] * whole.shape[1], *values.shape[1:])


class UnknownScreen:
    """Unknown forces of all trials, each against the balance."""

    def __init__(self, balance: Balance) -> None:
        self._balance = balance
        self.free = unknown_forces(balance.scenes)  # at no point in particular yet
        self._trials = {t.scene.name: k for k, t in enumerate(balance.trials)}
        self._courses: dict[tuple[str, float, float | None], np.ndarray] = {}
        self._local: dict[Key, Local] = {}
        self._products: dict[tuple[int, Key], np.ndarray] = {}

    def at(self, candidates: Sequence[Unknown], beside: Beside) -> list[Tried]:
        """Each candidate at its best size, greatest gain first.

        Args:
            candidates: of any trials.
            beside: accepted causes at one scale of the model error.
        """
        tried = {c: self._tried(c, beside) for c in dict.fromkeys(candidates)}
        return sorted((tried[c] for c in candidates), key=lambda t: -t.gain)

    def course_ground(self, one: Tried) -> Float[np.ndarray, "frames 3"]:
        """The force [N] or the moment [N·m] over the trial."""
        return self._splines(one.candidate) @ self._coefficients(one)[:3].T

    def explained(self, one: Tried) -> Float[np.ndarray, " rows"]:
        """What it takes off the residual, in all trials' rows."""
        local = self._local_of(one.candidate)
        rows = np.zeros(int(self._balance.start[-1]))
        rows[local.span] = local.sum(self._coefficients(one)[: local.axes])
        return rows

    def _coefficients(self, one: Tried) -> Float[np.ndarray, "6 splines"]:
        """Of the splines along the axes of force, then of moment; of a moment its axes alone."""
        axes, _ = _axes(one.candidate)
        by_axis = one.x.reshape(len(axes), -1)
        whole = np.zeros((6, by_axis.shape[1] - 1))
        whole[axes] = by_axis[:, :1] + by_axis[:, 1:]
        return whole

    def _tried(self, candidate: Unknown, beside: Beside) -> Tried:
        local = self._local_of(candidate)
        axes, sizes = _axes(candidate)
        own = (axes[:, None] * (1 + local.splines) + np.arange(1 + local.splines)).ravel()
        scale = np.repeat(sizes, 1 + local.splines) * self._trial(candidate).scene.weight_N
        of_accepted, left = (part[local.span] for part in beside.by_rows)
        W = scale[:, None] * local.with_constants(local.times(of_accepted))[own]
        b = scale * local.with_constants(local.times(left))[own]
        whole = self._product(beside.rung, local)
        information = whole.copy() if len(own) == len(whole) else whole[np.ix_(own, own)]
        information *= scale[:, None]
        information *= scale
        information -= W @ W.T
        eta, gain, u = _at_its_size(information, b, candidate.starts(self._balance.scenes))
        return Tried(candidate, eta, gain, eta[0] * scale * u)

    def _product(self, rung: Rung, local: Local) -> Float[np.ndarray, "columns columns"]:
        """Columnsᵀ P columns with constants, nothing accepted."""
        key = id(rung), local.key
        if key not in self._products:
            half = local.times(rung.precision_at(local.span))
            whole = local.with_constants(local.times(np.ascontiguousarray(half.T)))
            self._products[key] = local.with_constants(np.ascontiguousarray(whole.T))
        return self._products[key]

    def _trial(self, candidate: Unknown) -> TrialRows:
        return self._balance.trials[self._trials[candidate.trial]]

    def _local_of(self, candidate: Unknown) -> Local:
        trial, start = self._trial(candidate), self._balance.start
        scene = trial.scene
        splines = self._splines(candidate)
        centre = point = np.zeros(3)
        if isinstance(candidate, UnknownForce):
            centre = scene.skeleton.bodies[scene.skeleton.body_index(candidate.target)].com_body
            point = centre if candidate.point_body is None else np.array(candidate.point_body)
        key = candidate.trial, candidate.target, splines.shape[1], point.tobytes()
        if key not in self._local:
            k = self._trials[candidate.trial]
            span = slice(int(start[k]), int(start[k + 1]))
            moments = _moments(trial, splines)
            if isinstance(candidate, UnknownMoment):
                columns = moments
            else:
                columns = _forces(trial, splines, candidate.place_ground(scene) - scene.com_ground)
                if np.array_equal(point, centre):
                    columns = np.concatenate([columns, candidate.reach_m(scene) * moments], axis=2)
            self._local[key] = Local.of(key, span, columns)
        return self._local[key]

    def _splines(self, candidate: Unknown) -> Float[np.ndarray, "frames splines"]:
        """Its courses but for the constant."""
        key = candidate.trial, candidate.knot_s, candidate.frequency_Hz
        if key not in self._courses:
            scene = self._trial(candidate).scene
            self._courses[key] = courses_of(scene, candidate.knot_s, candidate.frequency_Hz)[:, 1:]
        return self._courses[key]


def _at_its_size(
    information: Float[np.ndarray, "own own"], b: Float[np.ndarray, " own"], sizes: Sequence[Eta]
) -> tuple[Eta, float, Float[np.ndarray, " own"]]:
    """The best of ascending sizes, sought from the middle one both ways as long as the next is better.

    Returns:
        The size, the log evidence that it adds, and the coefficients over the size.
    """

    def at(k: int) -> tuple[float, np.ndarray, np.ndarray]:
        (size,) = sizes[k]
        S = size**2 * information
        S[np.arange(len(S)), np.arange(len(S))] += 1.0
        L, _ = dpotrf(S.T, lower=1, clean=0, overwrite_a=1)
        u, _ = dtrtrs(L, size * b, lower=1)
        return 0.5 * float(u @ u) - float(np.log(np.diag(L)).sum()), L, u

    middle = len(sizes) // 2
    k, best = middle, (begun := at(middle))
    for way in (-1, 1):
        at_way, here = middle, begun
        while 0 <= at_way + way < len(sizes) and (further := at(at_way + way))[0] > here[0]:
            at_way, here = at_way + way, further
        if here[0] > best[0]:
            k, best = at_way, here
    gain, L, u = best
    x, _ = dtrtrs(L, u, lower=1, trans=1)
    return sizes[k], gain, x


def _axes(candidate: Unknown) -> tuple[Int[np.ndarray, " axes"], Float[np.ndarray, " axes"]]:
    """Which of a point's axes a candidate has, and their relative sizes."""
    if isinstance(candidate, UnknownMoment):
        return np.arange(3), np.ones(3)
    if candidate.point_body is None:
        return np.arange(6), np.ones(6)
    sizes = np.array(candidate.directions)
    return np.flatnonzero(sizes), sizes[sizes != 0]


def _forces(
    trial: TrialRows, splines: Float[np.ndarray, "frames splines"], arm_ground: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, "windows 6 3 splines"]:
    """Forces along the ground's axes, this far from the centre of mass [m], and their moments about it."""
    force = trial.windows.means(splines)
    x, y, z = (trial.windows.means(arm_ground[:, i : i + 1] * splines) for i in range(3))
    rows = np.zeros((len(force), 6, 3, force.shape[1]))
    for axis in range(3):
        rows[:, axis, axis] = force
    rows[:, 4, 0], rows[:, 5, 0] = z, -y
    rows[:, 3, 1], rows[:, 5, 1] = -z, x
    rows[:, 3, 2], rows[:, 4, 2] = y, -x
    return rows


def _moments(
    trial: TrialRows, splines: Float[np.ndarray, "frames splines"]
) -> Float[np.ndarray, "windows 6 3 splines"]:
    """Moments about the ground's axes."""
    means = trial.windows.means(splines)
    rows = np.zeros((len(means), 6, 3, means.shape[1]))
    for axis in range(3):
        rows[:, 3 + axis, axis] = means
    return rows
