"""What the whole fit makes of every recording of a person, by its labels alone, forces and all."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.fit_agreement import marker_distances, rms
from benchmarks.recordings import data_folder, described_folders, recordings_of, without_model
from solver.capture.capture import Subject
from solver.capture.subject.subject import open_subject
from solver.common.errors import SolverError
from solver.fitting.fit import Fit
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings
from solver.markers.understanding import understand


def _everyone() -> Iterator[Path]:
    """Folders with recordings of a person."""
    root = data_folder()
    yield from described_folders()
    yield from sorted(p for p in (root / "c3d_conformance").iterdir() if p.is_dir())
    yield root / "format_trc_mot"


def print_everyone() -> None:
    """A row for each recording, as a table of a page."""
    print("| recording | family | markers used | RMS cm | maximum cm | residual N | residual N·m |")
    print("|---|---|---|---|---|---|---|")
    for folder in _everyone():
        try:
            subject = without_model(open_subject(folder))
        except SolverError as error:
            print(f"{folder.name}: {error}")
            continue
        for files in subject.trials:
            print(_row(subject, files.name), flush=True)


def _row(subject: Subject, trial: str) -> str:
    name = f"{subject.folder.name}/{trial}"
    try:
        recordings = recordings_of(subject, trial)
    except SolverError as error:
        return f"| {name} | cannot be read: {str(error).split(': ', 1)[-1][:60]} |"
    seen = recordings[0]
    family = understand([n for m in recordings for n in m.names], recordings).family or "none"
    try:
        fit = solve(subject, Settings(), trials=[trial])
    except SolverError as error:
        return f"| {name} | {family} | 0 of {len(seen.names)} | {str(error)[:60]} |"
    errors = marker_distances(fit)
    used = int(np.isfinite(errors).any(axis=0).sum())
    return (
        f"| {name} | {family} | {used} of {len(seen.names)} | {100 * np.sqrt(np.nanmean(errors**2)):.2f} | "
        f"{100 * np.nanmax(errors):.1f} | {_residuals(fit)} |"
    )


def _residuals(fit: Fit) -> str:
    """RMS of the root's residual force [N] and moment [N·m], where there are forces."""
    dynamics = fit.trials[0].dynamics
    if dynamics is None or not dynamics.used.any():
        return "– | –"
    residual = dynamics.residual_root[dynamics.used]
    force, moment = (rms(np.linalg.norm(part, axis=1)) for part in (residual[:, :3], residual[:, 3:]))
    return f"{force:.1f} | {moment:.1f}"
