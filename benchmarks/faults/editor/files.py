"""TRC and MOT as they come from laboratories, and a subject's folder as one hands it in."""

import re
import shutil
from pathlib import Path

import numpy as np

from benchmarks.faults.editor.recording import Plate, Recording, Trial

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
