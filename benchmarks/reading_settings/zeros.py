"""Plates that begin with zeros: written before a load by a program, or read before a foot lands."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reading_settings.bench import captures
from solver.capture.capture import ForcePlate
from solver.capture.edge_zeros import EdgeZeroSettings, without_edge_zeros

ZEROS_S = (0.02, 0.08, 0.25)
UNLOADED_N, LOADED_N = 20.0, 200.0


@dataclass(frozen=True, eq=False)
class Beginning:
    """The beginning of a plate's record."""

    person: str
    plate: ForcePlate
    truth: tuple[int]  # rows that were not measured

    def answers(self, settings: EdgeZeroSettings) -> Sequence[object]:
        """Rows that are found not to be."""
        seen, _ = without_edge_zeros(self.plate, settings)
        unmeasured = np.isnan(seen.force_ground).any(axis=1)
        return (int(np.argmin(unmeasured)) if not unmeasured.all() else len(unmeasured),)


def beginnings() -> Iterator[Beginning]:
    """Of every plate: cut where somebody stands on it, after some zeros; and cut before a foot lands."""
    rng = np.random.default_rng(0)
    for person, capture, _ in captures():
        for plate in capture.plates:
            force = np.where(plate.force_ground[:, [1]] > UNLOADED_N, np.nan_to_num(plate.force_ground), 0.0)
            whole = replace(
                plate,
                force_ground=force,
                moment_ground=np.nan_to_num(plate.moment_ground),
                cop_ground=np.nan_to_num(plate.cop_ground),
                point_ground=None,
            )
            inner = slice(0, max(0, len(force) - round(0.3 * plate.rate)))
            loaded = np.flatnonzero(force[inner, 1] > LOADED_N)
            landing = np.flatnonzero((force[:-1, 1] == 0) & (force[1:, 1] > 0))
            for seconds in ZEROS_S if len(loaded) else ():
                rows = round(seconds * plate.rate)
                yield Beginning(person, _begun(whole, int(rng.choice(loaded)), rows), (rows,))
            for at in landing:
                start = max(0, at - round(0.15 * plate.rate))
                if (force[start : at + 1] == 0).all() and at < inner.stop:
                    yield Beginning(person, _begun(whole, int(start), 0), (0,))


def _begun(plate: ForcePlate, at: int, zeros: int) -> ForcePlate:
    """From a row on, after so many of zeros."""

    def cut(rows: np.ndarray) -> np.ndarray:
        return np.concatenate([np.zeros((zeros, 3)), rows[at:]])

    return replace(
        plate,
        force_ground=cut(plate.force_ground),
        moment_ground=cut(plate.moment_ground),
        cop_ground=cut(plate.cop_ground),
    )
