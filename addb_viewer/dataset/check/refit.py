"""A .b3d file fitted anew: what it says of itself beside what this program finds, and what causes it."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from annotations.agreement import agreement
from solver.capture.subject.subject import open_subject
from solver.common.progress import Progress, part, silent
from solver.diagnosis.diagnose import diagnose
from solver.diagnosis.report import as_json
from solver.fitting.fit import TrialFit
from solver.fitting.pipeline import solve
from solver.fitting.settings import settings_for
from solver.fitting.summary import summary

FITTED = 0.3  # share of the work


@dataclass(frozen=True)
class Refitted:
    """One trial: figures of the file's last pass and of our fit, RMS on the frames that our fit uses."""

    trial: str
    stored_pass: str
    marker_cm: tuple[float | None, float | None]  # stored, ours
    force_N: tuple[float | None, float | None]
    moment_Nm: tuple[float | None, float | None]
    counting: tuple[int, int]  # frames
    frames: int
    kappa: float  # between the file's word on which frames count and detection's; NaN: all are the same one


def refitted(path: Path, progress: Progress = silent) -> tuple[list[Refitted], list[dict[str, Any]]]:
    """Fit a file as if nobody had reviewed it, and diagnose it; nothing is written.

    Args:
        path: of the .b3d file.
        progress: told the stage and the fraction done.

    Returns:
        A row a trial, and the causes that the diagnosis names, as `diagnose --json` has them.

    Raises:
        SolverError: it cannot be read or fitted.
    """
    settings = settings_for(path)
    subject = open_subject(path, settings.reading)
    fit = solve(subject, settings, reviews={}, progress=part(progress, 0.0, FITTED))
    told: Any = summary(fit)["trials"]
    rows = [_row(trial, figures) for trial, figures in zip(fit.trials, told, strict=True)]
    found = diagnose(subject, settings, reviews={}, progress=part(progress, FITTED, 1.0))
    named: Any = as_json(found)["effects"]
    return rows, list(named)


def _row(trial: TrialFit, figures: dict[str, Any]) -> Refitted:
    stored = figures["stored"][-1] if figures["stored"] else {}
    missing = trial.capture.imported_missing_force
    said = np.ones(trial.motion.frames, dtype=bool) if missing is None else ~np.asarray(missing)
    ours = trial.forces_known
    return Refitted(
        trial=trial.capture.name,
        stored_pass=stored.get("pass", "none"),
        marker_cm=(_times(stored.get("marker_rms_m"), 100), _times(figures["marker_rms_m"], 100)),
        force_N=(stored.get("force_rms_N"), figures["linear_residual"]["rms_N"]),
        moment_Nm=(stored.get("moment_rms_Nm"), figures["angular_residual"]["rms_Nm"]),
        counting=(int(said.sum()), int(ours.sum())),
        frames=trial.motion.frames,
        kappa=agreement(said[:, None], ours[:, None]).kappa,
    )


def _times(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value


def in_words(rows: list[Refitted], causes: list[dict[str, Any]]) -> Iterator[str]:
    """The table, stored → ours, and a line a cause."""
    yield "trial: marker RMS [cm], residual force [N], residual moment [N·m], frames counting; stored → ours"
    for row in rows:
        figures = ", ".join(
            f"{_number(a)} → {_number(b)}" for a, b in (row.marker_cm, row.force_N, row.moment_Nm)
        )
        kappa = "" if np.isnan(row.kappa) else f", κ {row.kappa:.2f}"
        counts = f"{row.counting[0]} → {row.counting[1]} of {row.frames}"
        yield f"{row.trial} ({row.stored_pass} pass): {figures}, {counts}{kappa}"
    for cause in causes:
        yield f"cause: {cause['id']} {cause['target']}, {100 * cause['confidence']:.0f} % sure"
    if not causes:
        yield "no cause is named"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"
