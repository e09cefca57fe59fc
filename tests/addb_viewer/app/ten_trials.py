"""Ten short trials of five real recordings: windows of the files, nothing else changed; fitted."""

import multiprocessing
import re
from dataclasses import dataclass
from pathlib import Path

from solver.capture.subject.opened_subject import open_subject
from solver.fitting.pipeline import solve
from solver.fitting.results.store import save_fit
from solver.fitting.settings import settings_for

NO_HELD_OUT = "[trajectory]\nheld_out = false\n"
BESIDE_S = 0.02  # forces of so long before and after the markers


@dataclass(frozen=True)
class Recording:
    """A trial of the shared data, and the windows [s] that are trials here."""

    folder: str
    markers: str
    forces: str
    model: str | None
    windows: tuple[tuple[float, float], ...]
    facts: str = ""


RECORDINGS = {
    "walks": Recording(
        "overground_falisse_AdDB", "Gait_7_markers.trc", "Gait_7_grf.mot", None,
        ((0.0, 1.0), (1.7, 2.75)), "mass_kg = 62.7",
    ),
    "steps": Recording(
        "walk_rajagopal2015", "markers.trc", "grf.mot", "unscaled_generic.osim",
        ((0.0, 0.9), (1.3, 2.3)), "mass_kg = 85.07\nheight_m = 1.829",
    ),
    "runs": Recording(
        "run_treadmill_hamner2013_subject04", "run400/markers.trc", "run400/grf.mot", "unscaled_generic.osim",
        ((0.7, 1.4), (1.6, 2.3)), "mass_kg = 80.47\nheight_m = 1.772",
    ),
    "belt": Recording(
        "walk_treadmill_stepwidth", "example1/markers.trc", "example1/grf.mot",
        "unscaled_generic_32markers.osim", ((0.5, 1.4), (2.0, 2.9)), "",
    ),
    "gait": Recording(
        "walk_gait2354_subject01", "subject01_walk1.trc", "subject01_walk1_grf.mot",
        "reference/subject01_simbody.osim", ((0.0, 1.2), (1.25, 2.45)), "mass_kg = 72.6",
    ),
}  # fmt: skip


def write_trials(data: Path, folder: Path, name: str) -> None:
    """Cut one recording's windows out of the shared data, and fit them without held-out blocks."""
    write_windows(RECORDINGS[name], data / RECORDINGS[name].folder, folder)
    (folder / "settings.toml").write_text(NO_HELD_OUT)
    _fit(folder)


def write_ten_trials(data: Path, root: Path) -> None:
    """Cut the windows out of the shared data, and fit every subject, two at a time."""
    for name, recording in RECORDINGS.items():
        write_windows(recording, data / recording.folder, root / name)
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        pool.map(_fit, [root / name for name in RECORDINGS], chunksize=1)


def write_windows(recording: Recording, source: Path, folder: Path) -> None:
    folder.mkdir(parents=True)
    lines = [recording.facts, 'foot_bodies = ["calcn_r", "calcn_l"]']
    if recording.model is not None:
        (folder / "model.osim").write_bytes((source / recording.model).read_bytes())
        lines.append('model = "model.osim"')
    for number, (start, end) in enumerate(recording.windows, start=1):
        trial = f"part{number}"
        (folder / f"{trial}.trc").write_text(_markers((source / recording.markers).read_text(), start, end))
        forces = _forces((source / recording.forces).read_text(), start - BESIDE_S, end + BESIDE_S)
        (folder / f"{trial}_grf.mot").write_text(forces)
        lines.append(f'[trials.{trial}]\nmarkers = "{trial}.trc"\nforces = "{trial}_grf.mot"')
    (folder / "subject.toml").write_text("\n".join(lines) + "\n")


def _markers(text: str, start: float, end: float) -> str:
    """A TRC file's rows of a window; its header says how many."""
    lines = text.splitlines()
    first = next(k for k, line in enumerate(lines) if re.match(r"\s*\d+\s+[-\d.]", line) and k > 3)
    rows = [row for row in lines[first:] if row.strip() and start <= float(row.split()[1]) <= end]
    keys, values = lines[1].split(), lines[2].split()
    values[keys.index("NumFrames")] = str(len(rows))
    return "\n".join([*lines[:2], "\t".join(values), *lines[3:first], *rows]) + "\n"


def _forces(text: str, start: float, end: float) -> str:
    """A MOT file's rows of a window; its header says how many."""
    lines = text.splitlines()
    first = next(k for k, line in enumerate(lines) if line.split()[:1] == ["time"]) + 1
    rows = [row for row in lines[first:] if row.strip() and start <= float(row.split()[0]) <= end]
    count = re.compile(r"^((?:nRows|datarows)\s*=?\s*)\d+", re.IGNORECASE)
    head = [count.sub(rf"\g<1>{len(rows)}", line) for line in lines[:first]]
    return "\n".join([*head, *rows]) + "\n"


def _fit(folder: Path) -> None:
    save_fit(solve(open_subject(folder), settings_for(folder)), folder / "results")
