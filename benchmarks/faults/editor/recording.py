"""A person's recording in plain numbers: what was read from the files, and what an edit changes."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Plate:
    """One force plate, y up: the force on the person, its moment about the laboratory's origin."""

    force: np.ndarray  # (samples, 3) [N]
    moment: np.ndarray  # (samples, 3) [N·m]
    height: float  # [m] of the surface that is pressed

    @property
    def loaded(self) -> np.ndarray:
        """Samples in which somebody presses on it."""
        return self.force[:, 1] > 20.0  # [N] the usual threshold of gait laboratories

    @property
    def pressure(self) -> np.ndarray:
        """Centre of pressure on the surface (samples, 3) [m]; zero where nothing presses, as exporters do."""
        up = np.where(np.abs(self.force[:, 1]) > 1.0, self.force[:, 1], np.inf)
        about = self.moment - np.cross([0.0, self.height, 0.0], self.force)
        x, z = about[:, 2] / up, -about[:, 0] / up
        return np.stack([x, np.where(np.isfinite(up), self.height, 0.0), z], axis=1)

    @property
    def centre(self) -> np.ndarray:
        """Middle of all places that were pressed while loaded [m]."""
        pressed = self.pressure[self.force[:, 1] > 0.2 * self.force[:, 1].max()]
        return (pressed.min(axis=0) + pressed.max(axis=0)) / 2


@dataclass(frozen=True)
class Trial:
    """Markers and plates of one trial, each on its own times."""

    name: str
    labels: tuple[str, ...]
    positions: np.ndarray  # (frames, markers, 3) [m], NaN where unseen
    times: np.ndarray  # (frames,) [s]
    plates: tuple[Plate, ...]
    force_times: np.ndarray  # (samples,) [s]

    def with_plate(self, k: int, plate: Plate) -> "Trial":
        """The same with plate k, counted from 0, in another's place."""
        return replace(self, plates=(*self.plates[:k], plate, *self.plates[k + 1 :]))

    def cut(self, start: float, end: float, name: str | None = None) -> "Trial":
        """The part between two times; half a marker frame more of the forces on either side."""
        frames = (self.times >= start - 1e-9) & (self.times <= end + 1e-9)
        margin = 0.5 / self.rate
        samples = (self.force_times >= start - margin) & (self.force_times <= end + margin)
        return replace(
            self,
            name=name or self.name,
            positions=self.positions[frames],
            times=self.times[frames],
            plates=tuple(replace(p, force=p.force[samples], moment=p.moment[samples]) for p in self.plates),
            force_times=self.force_times[samples],
        )

    @property
    def rate(self) -> float:
        """Of the markers [Hz]."""
        return (len(self.times) - 1) / (self.times[-1] - self.times[0])

    @property
    def force_rate(self) -> float:
        """Of the plates [Hz]."""
        return (len(self.force_times) - 1) / (self.force_times[-1] - self.force_times[0])


@dataclass(frozen=True)
class Recording:
    """Everything that is handed over of one person."""

    trials: tuple[Trial, ...]
    mass_kg: float | None
    height_m: float | None = None
    sex: str | None = None
    model: Path | None = None
    static: Path | None = None

    def with_trial(self, k: int, trial: Trial) -> "Recording":
        """The same with trial k, counted from 0, in another's place."""
        return replace(self, trials=(*self.trials[:k], trial, *self.trials[k + 1 :]))
