"""What the residual would be with other flags: keeps a subject's fit in memory and answers lines of JSON.

`python -m` this module with SUBJECT and RESULTS. Asked {"trial": …, "present": {…}, "instead": {…}}, each a
`ForceReview`, it answers {"present": {…}, "instead": {…}, "seconds": …} in figures, or {"error": …}. Told
{"prepare": trial, "present": {…}} it computes that side and answers nothing.
"""

import contextlib
import json
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from addb_viewer.jobs.solving import Job, job_for, resolved
from annotations.errors import ReviewError
from solver.common.errors import FitError, SolverError
from solver.contact.force_review import ForceReview, as_plain, from_plain
from solver.fitting.fit import Fit, TrialFit
from solver.fitting.results.store import load_fit

Figures = dict[str, float | None]


class Asked:
    """One subject's kept fit, and what was asked of it: answered as a solve for the app would."""

    def __init__(self, fit: Fit, job: Callable[[], Job]) -> None:
        """Solve nothing yet.

        Args:
            fit: kept.
            job: of the subject as it is when it is called, with what people say now of all its trials.
        """
        self.fit, self.job = fit, job
        self.known: dict[str, dict[str, Figures]] = {}  # by what is said of all trials, by trial

    def answer(self, question: dict[str, Any]) -> dict[str, Any]:
        """Both sides of a question, in figures of the trial."""
        began = time.monotonic()
        trial = question["trial"]
        sides = {side: self._figures(trial, question[side]) for side in ("present", "instead")}
        return {**sides, "seconds": time.monotonic() - began}

    def prepare(self, question: dict[str, Any]) -> None:
        """Compute the present side of a question that will come; it fails when that comes, not now."""
        with contextlib.suppress(SolverError, ReviewError):
            self._figures(question["prepare"], question["present"])

    def _figures(self, trial: str, said: dict[str, Any]) -> Figures:
        job = self.job()
        all_said = {**job.reviews, trial: from_plain(said)}
        reviews = {name: review for name, review in all_said.items() if review != ForceReview()}
        key = json.dumps({name: as_plain(review) for name, review in reviews.items()}, sort_keys=True)
        if key not in self.known:
            solved = resolved(replace(job, reviews=reviews), self.fit)
            if solved is None:
                raise FitError(
                    "recordings, settings or accepted causes have changed since the kept fit: keep another "
                    "one first (G solves)"
                )
            self.known[key] = {each.capture.name: figures_of(each) for each in solved.trials}
        return self.known[key][trial]


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
    folder, results = (Path(place) for place in sys.argv[1:3])
    try:
        asked = Asked(load_fit(results, folder), lambda: job_for(folder, out=results))
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
        except (SolverError, ReviewError) as error:
            told = {"error": str(error)}
        print(json.dumps(told), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
