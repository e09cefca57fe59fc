"""What the residual would be with other flags: keeps a subject's fit in memory and answers lines of JSON.

`python -m` this module with SUBJECT, RESULTS and the folder of the fit. Asked {"trial": …, "present": {…},
"instead": {…}}, each a `ForceReview`, it answers {"present": {…}, "instead": {…}, "seconds": …} in figures,
or {"error": …}. Told {"prepare": trial, "present": {…}} it computes that side and answers nothing.
"""

import contextlib
import json
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from addb_viewer.jobs.solving import Job, job_for
from solver.contact.force_review import from_plain
from solver.dynamics.extension import Extension
from solver.errors import SolverError
from solver.fit import Fit, TrialFit
from solver.pipeline import resolve
from solver.results.store import load_fit
from solver.settings import Settings

Figures = dict[str, float | None]


class Asked:
    """One subject's fit, and what was asked of it."""

    def __init__(self, fit: Fit, settings: Settings, extension: Extension | None) -> None:
        self.fit, self.settings, self.extension = fit, settings, extension
        self.known: dict[str, Figures] = {}

    def answer(self, question: dict[str, Any]) -> dict[str, Any]:
        """Both sides of a question, in figures of the trial."""
        began = time.monotonic()
        trial = question["trial"]
        sides = {side: self._figures(trial, question[side]) for side in ("present", "instead")}
        return {**sides, "seconds": time.monotonic() - began}

    def prepare(self, question: dict[str, Any]) -> None:
        """Compute the present side of a question that will come; it fails when that comes, not now."""
        with contextlib.suppress(SolverError):
            self._figures(question["prepare"], question["present"])

    def _figures(self, trial: str, said: dict[str, Any]) -> Figures:
        key = json.dumps([trial, said])
        if key not in self.known:
            alone = replace(self.fit, trials=tuple(t for t in self.fit.trials if t.capture.name == trial))
            solved = resolve(alone, {trial: from_plain(said)}, self.settings, extension=self.extension)
            self.known[key] = figures_of(solved.trials[0])
        return self.known[key]


def figures_of(trial: TrialFit) -> Figures:
    """Root mean squares over the frames that count, and over all frames of the marker errors."""
    seen = trial.marker_errors.distance[np.isfinite(trial.marker_errors.distance)]
    told: Figures = {"frames": 0.0, "marker_rms_m": _rms(seen), "force_N": None, "moment_Nm": None}
    if trial.dynamics is not None and trial.dynamics.used.any():
        residual = trial.dynamics.residual_root[trial.dynamics.used]
        told |= {
            "frames": float(trial.dynamics.used.sum()),
            "force_N": _rms(np.linalg.norm(residual[:, :3], axis=1)),
            "moment_Nm": _rms(np.linalg.norm(residual[:, 3:], axis=1)),
        }
    return told


def _rms(values: np.ndarray) -> float | None:
    return float(np.sqrt(np.mean(values**2))) if values.size else None


def main() -> int:
    """Answer until the input ends."""
    folder, results, fit_folder = (Path(place) for place in sys.argv[1:4])
    try:
        job: Job = job_for(folder, out=results)
        fit = load_fit(fit_folder, folder)
        asked = Asked(replace(fit, subject=job.subject), job.settings, job.extension)
    except SolverError as error:
        print(json.dumps({"error": str(error)}), flush=True)
        return 1
    print(json.dumps({"ready": True}), flush=True)
    for line in sys.stdin:
        question = json.loads(line)
        if "prepare" in question:
            asked.prepare(question)
            continue
        try:
            told = asked.answer(question)
        except SolverError as error:
            told = {"error": str(error)}
        print(json.dumps(told), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
