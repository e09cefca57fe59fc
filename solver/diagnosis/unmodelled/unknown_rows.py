"""Rows of forces and moments of unknown time history: splines times levers, each for a few windows.

Only these windows are kept, and all points of a trial share them.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from solver.diagnosis.noise.rows import TrialRows

Place = tuple[str, bytes]  # body, point on it
MOMENT: Place = ("", b"")


@dataclass(frozen=True, eq=False)
class TimeHistories:
    """Splines of one trial and the windows for which each lasts; a constant is their sum."""

    trial: TrialRows
    span: slice  # rows of the trial
    splines: Float[np.ndarray, "frames splines"]

    @property
    def count(self) -> int:
        """How many."""
        return self.splines.shape[1]

    @cached_property
    def windows(self) -> Int[np.ndarray, "splines some"]:
        """Those of each, all equally many."""
        there = self.trial.windows.means(self.splines) > 0
        every = len(there)
        first = np.where(there.any(axis=0), there.argmax(axis=0), 0)
        last = np.where(there.any(axis=0), every - there[::-1].argmax(axis=0), 1)
        length = int((last - first).max())
        return np.asarray(np.minimum(first, every - length)[:, None] + np.arange(length))

    def means(self, lever: Float[np.ndarray, " frames"] | float = 1.0) -> Float[np.ndarray, "splines some"]:
        """Of each spline times a lever, over its windows."""
        whole = self.trial.windows.means(np.multiply(lever, self.splines.T).T)
        return np.asarray(whole[self.windows, np.arange(self.count)[:, None]])

    def moments(self) -> Float[np.ndarray, "splines 3 rows"]:
        """Moments about the ground's axes."""
        means = self.means()
        rows = np.zeros((*means.shape, 3, 6))
        for axis in range(3):
            rows[:, :, axis, 3 + axis] = means
        return _by_rows(rows)

    def forces(self, arm_ground: Float[np.ndarray, "frames 3"]) -> Float[np.ndarray, "splines 3 rows"]:
        """Forces along them, this far from the centre of mass [m], and their moments about it."""
        force = self.means()
        x, y, z = (self.means(arm_ground[:, i]) for i in range(3))
        rows = np.zeros((*force.shape, 3, 6))
        for axis in range(3):
            rows[:, :, axis, axis] = force
        rows[:, :, 0, 4], rows[:, :, 0, 5] = z, -y
        rows[:, :, 1, 3], rows[:, :, 1, 5] = -z, x
        rows[:, :, 2, 3], rows[:, :, 2, 4] = y, -x
        return _by_rows(rows)


@dataclass(frozen=True, eq=False)
class Located:
    """Splines along the ground's axes at some places of one trial, on the rows of their windows alone."""

    time_histories: TimeHistories
    places: tuple[Place, ...]
    columns: Float[np.ndarray, "splines axes rows"]  # three axes of each place, one place after the other

    def axes(self, place: Place) -> slice:
        """Of one place."""
        k = 3 * self.places.index(place)
        return slice(k, k + 3)

    def times(
        self, rows: Float[np.ndarray, "own some"], axes: slice = slice(None)
    ) -> Float[np.ndarray, "axes splines some"]:
        """Columnsᵀ rows."""
        columns = self.columns[:, axes]
        found = np.empty((columns.shape[1], len(columns), rows.shape[1]))
        for k, first in enumerate(6 * self.time_histories.windows[:, 0]):
            found[:, k] = columns[k] @ rows[first : first + columns.shape[2]]
        return found

    def sum(self, sizes: Float[np.ndarray, "axes splines"], axes: slice) -> Float[np.ndarray, " own"]:
        """All columns of some axes together, each of some size."""
        span = self.time_histories.span
        rows = np.zeros(span.stop - span.start)
        for k, first in enumerate(6 * self.time_histories.windows[:, 0]):
            part = self.columns[k, axes]
            rows[first : first + part.shape[1]] += sizes[:, k] @ part
        return rows


def with_constants(values: Float[np.ndarray, "axes splines *rest"]) -> Float[np.ndarray, "columns *rest"]:
    """Something linear in columns, before each axis' splines that of their sum."""
    whole = np.concatenate([values.sum(axis=1, keepdims=True), values], axis=1)
    return whole.reshape(whole.shape[0] * whole.shape[1], *values.shape[2:])


def _by_rows(columns: Float[np.ndarray, "splines some 3 6"]) -> Float[np.ndarray, "splines 3 rows"]:
    """Six rows a window."""
    splines, some = columns.shape[:2]
    return np.ascontiguousarray(columns.transpose(0, 2, 1, 3)).reshape(splines, 3, 6 * some)
