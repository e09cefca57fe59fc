"""Sound recordings changed by a script into what laboratories also bring, and what is then so.

For kinds of which fewer than two sets lie in the data: a damaged file beside good ones, a plate's zero level,
plates that are copies, several people in one folder, files that are named apart, irregular clocks.
"""

import shutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.recordings import data_folder
from benchmarks.zoo.truth import PersonTruth, TrialTruth, Truth, described_truth, read_truth

Limits = Mapping[str, Any]
SHIFT_N = 71.0


def changed_sets(out: Path, limits: Limits) -> Iterator[tuple[Path, Truth]]:
    """Folders that are laid out below `out`, made once, and what is so of each.

    Args:
        out: where they go.
        limits: of what is nonsense.
    """
    for make in MAKERS:
        folder = out / make.__name__
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        yield folder, make(folder, limits)


def half_a_trc(folder: Path, limits: Limits) -> Truth:
    """One of five trials ends in the middle of a line."""
    source = data_folder() / "opencap_subject4"
    _copy(source, folder)
    broken = folder / "MarkerData" / "DJ1.trc"
    broken.write_bytes(broken.read_bytes()[: broken.stat().st_size // 2 - 7])
    truth = described_truth(source, limits)
    return replace(truth, why="half of DJ1.trc is missing", format_told=("DJ1",))


def half_a_c3d(folder: Path, limits: Limits) -> Truth:
    """One of two C3D files is cut off."""
    source = data_folder() / "wild" / "child_HC031A"
    _copy(source, folder)
    broken = folder / "Straight" / "HC031A06.c3d"
    broken.write_bytes(broken.read_bytes()[: broken.stat().st_size // 3])
    truth = read_truth(source.parent / "truth" / "child_HC031A.toml")
    left = tuple(trial for trial in truth.trials if trial.name != "HC031A06")
    people = tuple(replace(person, trials=("HC031A23",)) for person in truth.people)
    return replace(
        truth, why="HC031A06.c3d is cut off", format_told=("HC031A06",), trials=left, people=people
    )


def zero_level_up(folder: Path, limits: Limits) -> Truth:
    """A belt's vertical force reads 71 N too much throughout."""
    return _shifted(folder, limits, SHIFT_N)


def zero_level_down(folder: Path, limits: Limits) -> Truth:
    """A belt's vertical force reads 71 N too little throughout."""
    return _shifted(folder, limits, -SHIFT_N)


def plates_three_times(folder: Path, limits: Limits) -> Truth:
    """The table holds each plate three times."""
    source = data_folder() / "walk_gait2354_subject01"
    _copy(source, folder)
    head, names, rows = _read(folder / "subject01_walk1_grf.mot")
    copies = [f"copy{k}_{name}" for k in (2, 3) for name in names[1:]]
    _write(
        folder / "subject01_walk1_grf.mot",
        head,
        [*names, *copies],
        np.hstack([rows, rows[:, 1:], rows[:, 1:]]),
    )
    return replace(described_truth(source, limits), why="each plate stands three times in the table")


def three_people(folder: Path, limits: Limits) -> Truth:
    """Trials of three persons, loose in one folder."""
    for marker, force, name in (
        (
            "walk_gait2354_subject01/subject01_walk1.trc",
            "walk_gait2354_subject01/subject01_walk1_grf.mot",
            "P1_walk",
        ),
        (
            "opencap_subject4/MarkerData/walking1.trc",
            "opencap_subject4/ForceData/walking1_grf.mot",
            "P2_walk",
        ),
        (
            "run_treadmill_hamner2013_subject04/run400/markers.trc",
            "run_treadmill_hamner2013_subject04/run400/grf.mot",
            "P3_run",
        ),
    ):
        shutil.copy(data_folder() / marker, folder / f"{name}.trc")
        shutil.copy(data_folder() / force, folder / f"{name}_grf.mot")
    trials = tuple(TrialTruth(name, (f"{name}.trc",)) for name in ("P1_walk", "P2_walk", "P3_run"))
    return Truth(persons=3, why="three persons in one folder", trials=trials, wrong_if=limits)


def named_apart(folder: Path, limits: Limits) -> Truth:
    """One marker file and one force file whose names share little."""
    return _renamed(folder, limits, "walk_rajagopal2015", "A01_PREF_T0015.trc", "A01_T0015_GRF_2plates.mot")


def named_otherwise(folder: Path, limits: Limits) -> Truth:
    """One marker file and one force file whose names share nothing."""
    run = "run_treadmill_hamner2013_subject04"
    return _renamed(folder, limits, run, "run0350cms.trc", "jog_grf.mot")


def irregular_clock(folder: Path, limits: Limits) -> Truth:
    """Force samples at steps of 0.0013 to 0.0021 s, as the file says truly."""
    source = data_folder() / "walk_gait2354_subject01"
    _copy(source, folder)
    file = folder / "subject01_walk1_grf.mot"
    head, names, rows = _read(file)
    steps = np.random.default_rng(1).uniform(0.0013, 0.0021, len(rows))
    times = np.cumsum(steps)
    times = (times - times[0]) / (times[-1] - times[0]) * rows[-1, 0]
    moved = [np.interp(times, rows[:, 0], column) for column in rows[:, 1:].T]
    _write(file, head, names, np.column_stack([times, *moved]))
    return replace(described_truth(source, limits), why="the force file's time stamps are irregular")


MAKERS: tuple[Callable[[Path, Limits], Truth], ...] = (
    half_a_trc,
    half_a_c3d,
    zero_level_up,
    zero_level_down,
    plates_three_times,
    three_people,
    named_apart,
    named_otherwise,
    irregular_clock,
)


def _shifted(folder: Path, limits: Limits, level_N: float) -> Truth:
    source = data_folder() / "overground_falisse_AdDB"
    _copy(source, folder)
    file = folder / "Gait_7_grf.mot"
    head, names, rows = _read(file)
    rows[:, names.index("ground_force_vy")] += level_N
    _write(file, head, names, rows)
    person = PersonTruth(mass_kg=(62.7, 3.0))  # by a squat of the same person
    return replace(described_truth(source, limits), why=f"{level_N:+.0f} N on a plate", people=(person,))


def _renamed(folder: Path, limits: Limits, name: str, markers: str, forces: str) -> Truth:
    source = data_folder() / name
    truth = described_truth(source, limits)
    (trial,) = truth.trials
    shutil.copy(next(source.rglob(trial.files[0])), folder / markers)
    shutil.copy(next(source.rglob("grf.mot")), folder / forces)
    people = tuple(replace(person, static=None, height_m=None) for person in truth.people)
    return replace(
        truth, why="files are named apart", people=people, trials=(replace(trial, files=(markers,)),)
    )


def _copy(source: Path, folder: Path) -> None:
    shutil.copytree(source, folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("reference"))
    for file in folder.rglob("*"):
        file.chmod(0o755 if file.is_dir() else 0o644)


def _read(file: Path) -> tuple[list[str], list[str], np.ndarray]:
    """Head, column names and rows of a table."""
    lines = file.read_text(encoding="utf-8").splitlines()
    end = next(k for k, line in enumerate(lines) if line.strip().lower() == "endheader")
    body = [line for line in lines[end + 1 :] if line.strip()]
    return lines[:end], body[0].split(), np.loadtxt(body[1:])


def _write(file: Path, head: list[str], names: list[str], rows: np.ndarray) -> None:
    kept = [line for line in head if not line.lower().startswith(("ncolumns", "datacolumns"))]
    text = "\n".join("\t".join(f"{value:.8g}" for value in row) for row in rows)
    whole = [*kept, f"nColumns={len(names)}", "endheader", "\t".join(names), text, ""]
    file.write_text("\n".join(whole), encoding="utf-8")
