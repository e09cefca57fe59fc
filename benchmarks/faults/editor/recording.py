"""A recording in plain numbers: read from laboratories' files, changed by an edit, written as a folder."""

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field, replace
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

    def with_wrenches(self, change: Callable[[np.ndarray], np.ndarray]) -> "Trial":
        """The same with forces and moments of all plates changed alike."""
        plates = tuple(replace(p, force=change(p.force), moment=change(p.moment)) for p in self.plates)
        return replace(self, plates=plates)

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


class NoPlaceError(Exception):
    """This recording has no place for this fault."""


@dataclass(frozen=True)
class Fault:
    """One fault in one recording; plates are counted from 1, as people count them."""

    what: str  # in plain words, with its size
    size: dict[str, float] = field(default_factory=dict)  # by name with unit
    trials: tuple[str, ...] = ()  # that have it
    plate: int | None = None
    markers: tuple[str, ...] = ()
    times_s: tuple[float, float] | None = None  # of the only stretch that has it


Edit = Callable[[Recording, np.random.Generator], tuple[Recording, Fault]]

USED_S = 0.2  # a plate that is loaded for less tells too little of itself
STANCE_S = 0.3


def used_plates(trial: Trial) -> list[int]:
    """Plates, counted from 0, that bear somebody for long enough."""
    return [k for k, p in enumerate(trial.plates) if p.loaded.sum() / trial.force_rate > USED_S]


def drawn_plate(recording: Recording, rng: np.random.Generator) -> int:
    """A plate, counted from 0, that is used in all trials."""
    shared = set.intersection(*(set(used_plates(trial)) for trial in recording.trials))
    if not shared:
        raise NoPlaceError("no plate is used in all trials")
    return int(rng.choice(sorted(shared)))


def stretches(mask: np.ndarray) -> list[tuple[int, int]]:
    """First and end of each run of True."""
    edges = np.flatnonzero(np.diff(np.r_[False, mask, False].astype(int)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


IN_METRES = {"mm": 1e-3, "m": 1.0}
LEAST_FORCE_N = 1.0  # below it a centre of pressure is noise


def read_trc(path: Path) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    """Labels, positions (frames, markers, 3) in metres, times; a blank, and three zeros, are NaN."""
    lines = path.read_text(errors="replace").splitlines()
    scale = next(IN_METRES[cell.strip()] for cell in lines[2].split("\t") if cell.strip() in IN_METRES)
    labels = tuple(name.strip() for name in lines[3].split("\t")[2:] if name.strip())
    rows = [line.split("\t") for line in lines[5:] if line.split("\t")[0].strip().isdigit()]
    width = 2 + 3 * len(labels)
    values = np.full((len(rows), width), np.nan)
    for n, row in enumerate(rows):
        for k, cell in enumerate(row[:width]):
            if cell.strip():
                values[n, k] = float(cell)
    positions = scale * values[:, 2:].reshape(len(rows), len(labels), 3)
    positions[(positions == 0).all(axis=2)] = np.nan
    return labels, positions, _evened(values[:, 1])


def write_trc(path: Path, trial: Trial) -> None:
    """In millimetres, unseen markers blank."""
    count, frames = len(trial.labels), len(trial.times)
    rate = f"{trial.rate:.6g}"
    head = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate}\t{rate}\t{frames}\t{count}\tmm\t{rate}\t1\t{frames}",
        "Frame#\tTime\t" + "\t\t\t".join(trial.labels),
        "\t\t" + "\t".join(f"{axis}{k}" for k in range(1, count + 1) for axis in "XYZ"),
        "",
    ]
    rows = []
    for n, (time, values) in enumerate(
        zip(trial.times, 1e3 * trial.positions.reshape(frames, -1), strict=True)
    ):
        cells = ["" if np.isnan(value) else f"{value:.5f}" for value in values]
        rows.append("\t".join([str(n + 1), f"{time:.6f}", *cells]))
    path.write_text("\n".join([*head, *rows]) + "\n")


def read_mot(path: Path, moments: str) -> tuple[tuple[Plate, ...], np.ndarray]:
    """Plates and times.

    Args:
        path: of the file.
        moments: what its moment columns are: "free" moments at the centre of pressure, or "contradicting"
            the centres of pressure; then the free moment is left out.
    """
    lines = path.read_text(errors="replace").splitlines()
    end = next(n for n, line in enumerate(lines) if line.strip() == "endheader")
    rest = [line for line in lines[end + 1 :] if line.strip()]
    names = [name.strip() for name in rest[0].split("\t") if name.strip()]
    values = np.array([[float(cell) for cell in line.split("\t")[: len(names)]] for line in rest[1:]])
    at = {name: values[:, k] for k, name in enumerate(names)}
    plates = []
    for name in names:
        if not (found := re.fullmatch(r"(.*force.*)vx", name)):
            continue
        prefix = found[1]
        force = np.stack([at[f"{prefix}v{axis}"] for axis in "xyz"], axis=1)
        point = np.stack([at[f"{prefix}p{axis}"] for axis in "xyz"], axis=1)
        other = prefix.replace("force", "torque")
        moment = np.stack(
            [at[f"{prefix}m{a}"] if f"{prefix}mx" in at else at[f"{other}{a}"] for a in "xyz"], 1
        )
        pressed = force[:, 1] > LEAST_FORCE_N
        moment = np.where(moments == "free", moment, 0.0)
        moment = moment + np.where(pressed[:, None], np.cross(point, force), 0.0)
        force[~pressed & ~(np.abs(force) > LEAST_FORCE_N).any(axis=1)] = 0.0
        height = float(np.median(point[pressed, 1])) if pressed.any() else 0.0
        plates.append(Plate(force, moment, height))
    return tuple(plates), _evened(at["time"])


def write_mot(path: Path, trial: Trial) -> None:
    """Force, centre of pressure and free moment of each plate."""
    columns, names = [trial.force_times[:, None]], ["time"]
    for k, plate in enumerate(trial.plates, start=1):
        point = plate.pressure
        free = plate.moment - np.cross(point, plate.force)
        columns += [plate.force, point, free]
        names += [f"ground_force_{k}_{kind}{axis}" for kind in "vpm" for axis in "xyz"]
    table = np.concatenate(columns, axis=1)
    head = [
        path.name,
        "version=1",
        f"nRows={len(table)}",
        f"nColumns={len(names)}",
        "inDegrees=yes",
        "endheader",
    ]
    rows = ["\t".join([f"{row[0]:.6f}", *(f"{value:.8g}" for value in row[1:])]) for row in table]
    path.write_text("\n".join([*head, "\t".join(names), *rows]) + "\n")


def write_folder(folder: Path, recording: Recording) -> None:
    """subject.toml, model, static trial, and per trial markers and forces."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = [
        f"{key} = {value}"
        for key, value in (("mass_kg", recording.mass_kg), ("height_m", recording.height_m))
        if value is not None
    ]
    if recording.sex:
        lines.append(f'sex = "{recording.sex}"')
    for key, file in (("model", recording.model), ("static", recording.static)):
        if file is not None:
            name = f"{key}{file.suffix.lower()}"
            shutil.copyfile(file, folder / name)
            lines.append(f'{key} = "{name}"')
    for trial in recording.trials:
        write_trc(folder / f"{trial.name}.trc", trial)
        write_mot(folder / f"{trial.name}_grf.mot", trial)
        lines += [
            f"\n[trials.{trial.name}]",
            f'markers = "{trial.name}.trc"',
            f'forces = "{trial.name}_grf.mot"',
        ]
    (folder / "subject.toml").write_text("\n".join(lines) + "\n")


def _evened(times: np.ndarray) -> np.ndarray:
    """Times that were printed with few digits, spread evenly again."""
    even = np.linspace(times[0], times[-1], len(times))
    return even if np.abs(even - times).max() < 0.6 * (even[1] - even[0]) else times
