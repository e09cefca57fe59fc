"""What the app runs in processes of its own: `python -m addb_viewer.app.workers WHAT`, then what it needs.

Progress comes as lines, errors as one line on stderr. `what_if` keeps a subject's fit in memory instead, and
answers lines of JSON. Asked {"trial": …, "present": {…}, "instead": {…}}, each a `ForceReview`, it answers
{"present": {…}, "instead": {…}, "torque": …, "seconds": …} in figures, or {"error": …}; a present of null is
the kept fit.
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import typer

from addb_viewer.jobs.command_errors import errors_as_lines
from addb_viewer.jobs.environment import ENDS_WITH_STDIN, end_with_parent
from addb_viewer.jobs.processes import print_progress
from addb_viewer.jobs.review_store import whole_log
from addb_viewer.jobs.solving import Job, changes, computed, job_for, kept_fit, last_fit, resolved
from addb_viewer.jobs.stored_solves import add
from annotations.review_errors import ReviewError
from solver.capture.atomic import made_folder
from solver.common.errors import FitError, SolverError
from solver.common.operating_system import LOWEST, end_in_order, give_way
from solver.contact.force_review import ForceReview, as_plain, from_plain
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.results.store import check_place, load_fit
from solver.kinematics.frame_solver import root_dofs
from solver.skeleton.skeleton import Skeleton

if TYPE_CHECKING:
    from addb_viewer.trial_view.recorded_subject import Recording

FIT_READ = 0.2  # share of a recording's work before the first file is begun
MOST_KNOWN = 8  # answers whose fits are kept: the sides of the last questions
Figures = dict[str, float | None]


def fit(folder: str, results: str) -> None:
    """A subject's first fit, kept as by `addb-viewer fit`; people's own work goes first."""
    end_in_order()
    give_way(os.getpid(), LOWEST)
    kept_fit(job_for(Path(folder), out=Path(results)), progress=print_progress)


def solve(folder: str, results: str, author: str) -> None:
    """A solve that goes among the others, for somebody to keep or to discard; its number is said last."""
    end_in_order()
    began = time.monotonic()
    job = job_for(Path(folder), out=Path(results))
    check_place(job.results)
    found, _ = computed(job, last_fit(job), print_progress)
    print(add(found, job.results, by=author, seconds=time.monotonic() - began))


def diagnose(folder: str, results: str) -> None:
    """As `addb-viewer diagnose`."""
    from addb_viewer.jobs.diagnosing import diagnosed  # noqa: PLC0415 (slow to load)

    diagnosed(job_for(Path(folder), out=Path(results)), print_progress)


def record(*arguments: str) -> None:
    """Recordings and reports of a fit as it lies on the disk; the files are said. Nothing is solved."""
    end_in_order()
    asked = _arguments(arguments)
    print_progress("reading the fit", 0.0)
    found = load_fit(asked.fit, asked.subject)
    share = (1.0 - FIT_READ) / len(asked.files)
    for i, file in enumerate(asked.files):
        print_progress(f"writing {file.name}", FIT_READ + i * share)
        made_folder(file.parent)
        print(_write(found, asked, file))
    print_progress("written", 1.0)


def _arguments(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    parser.add_argument("subject", type=Path)
    parser.add_argument("results", type=Path, help="where the diagnosis lies")
    parser.add_argument("fit", type=Path, help="folder of the fit")
    parser.add_argument("files", type=Path, nargs="+", help=".html, .rrd or .mcap")
    parser.add_argument("--previous", type=Path, help="folder of the fit that it is compared with")
    parser.add_argument("--trial", help="this one only")
    return parser.parse_args(arguments)


def _write(fit: Fit, asked: argparse.Namespace, file: Path) -> Path:
    if file.suffix == ".html":
        from addb_viewer.report.reporting import page_of  # noqa: PLC0415 (slow to load)
        from addb_viewer.trial_view.recorded_subject import ON_ONE_PAGE  # noqa: PLC0415 (likewise)

        is_form = file.name.endswith(ON_ONE_PAGE)
        return page_of(fit, asked.results, file, trials=_trials(asked), one_page=is_form)[0]
    if file.suffix == ".mcap":
        from addb_viewer.recordings.mcap_recording import write_mcap  # noqa: PLC0415 (slow to load)

        return write_mcap(_recording(fit, asked), file)
    from addb_viewer.recordings.rrd_recording import write_rrd  # noqa: PLC0415 (slow to load)

    return write_rrd(_recording(fit, asked), file)


def _recording(fit: Fit, asked: argparse.Namespace) -> "Recording":
    from addb_viewer.jobs.kept_diagnosis import kept  # noqa: PLC0415 (slow to load)
    from addb_viewer.trial_view.recorded_subject import recording_of  # noqa: PLC0415 (slow to load)

    previous = None if asked.previous is None else load_fit(asked.previous, asked.subject)
    diagnosis = kept(asked.results)
    return recording_of(
        fit,
        trials=_trials(asked),
        previous=previous,
        diagnosis=diagnosis[0] if diagnosis else None,
        edits=whole_log(asked.subject).edits,
    )


def _trials(asked: argparse.Namespace) -> list[str] | None:
    return None if asked.trial is None else [asked.trial]


class Asked:
    """One subject's kept fit, and what was asked of it: answered as a solve for the app would."""

    def __init__(self, fit: Fit, job: Callable[[], Job]) -> None:
        """Solve nothing yet.

        Args:
            fit: kept.
            job: of the subject as it is when it is called, with what people say now of all its trials.
        """
        self.fit, self.job = fit, job
        self.known: dict[str, tuple[TrialFit, ...]] = {}  # by what is said of all trials

    def answer(self, question: dict[str, Any]) -> dict[str, Any]:
        """Both sides of a question, in figures of the trial."""
        began, trial = time.monotonic(), question["trial"]
        present, instead = (self._solved(trial, question[side]) for side in ("present", "instead"))
        return {
            "present": figures_of(present),
            "instead": figures_of(instead),
            "torque": most_changed_torque(present, instead, self.fit.skeleton),
            "seconds": time.monotonic() - began,
        }

    def _solved(self, trial: str, said: dict[str, Any] | None) -> TrialFit:
        if said is None:
            return _named(trial, self.fit.trials)
        job = self.job()
        all_said = {**job.reviews, trial: from_plain(said)}
        reviews = {name: review for name, review in all_said.items() if review != ForceReview()}
        key = json.dumps({name: as_plain(review) for name, review in reviews.items()}, sort_keys=True)
        if key not in self.known:
            job = replace(job, reviews=reviews)
            solved = self.fit if not changes(self.fit, job) else resolved(job, self.fit)
            if solved is None:
                raise FitError(
                    "recordings, settings or accepted causes have changed since the kept fit: keep another "
                    "one first (G solves)"
                )
            while len(self.known) >= MOST_KNOWN:
                del self.known[next(iter(self.known))]
            self.known[key] = solved.trials
        return _named(trial, self.known[key])


def _named(name: str, trials: Sequence[TrialFit]) -> TrialFit:
    return next(trial for trial in trials if trial.capture.name == name)


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


def most_changed_torque(
    present: TrialFit, instead: TrialFit, skeleton: Skeleton
) -> dict[str, float | str] | None:
    """Of the joint and frame whose torque differs most; None where no frame counts in both."""
    one, other = present.dynamics, instead.dynamics
    if one is None or other is None or not (both := one.used & other.used).any():
        return None
    change = np.where(both[:, None], np.abs(other.joint_torques - one.joint_torques), 0.0)
    change[:, root_dofs(skeleton)] = 0.0
    frame, dof = np.unravel_index(np.nanargmax(change), change.shape)
    return {
        "coordinate": skeleton.dofs[dof],
        "Nm": float(change[frame, dof]),
        "frame": int(frame),
    }


def _rms(values: np.ndarray) -> float | None:
    return float(np.sqrt(np.mean(values**2))) if values.size else None


def what_if(folder: str, results: str) -> None:
    """Answer until the input ends."""
    try:
        asked = Asked(load_fit(Path(results), Path(folder)), lambda: job_for(Path(folder), out=Path(results)))
    except SolverError as error:
        print(json.dumps({"error": str(error)}), flush=True)
        return
    print(json.dumps({"ready": True}), flush=True)
    for line in sys.stdin:
        try:
            told = asked.answer(json.loads(line))
        except (SolverError, ReviewError) as error:
            told = {"error": str(error)}
        print(json.dumps(told), flush=True)


WORK: dict[str, Callable[..., None]] = {
    work.__name__: work for work in (fit, solve, diagnose, record, what_if)
}


def main() -> int:
    """Run on `sys.argv`."""
    name, *arguments = sys.argv[1:]
    if name == what_if.__name__:
        os.environ.pop(ENDS_WITH_STDIN, None)  # questions come there; it ends with them
    end_with_parent()
    try:
        with errors_as_lines(debug=False):
            WORK[name](*arguments)
    except typer.Exit as ending:
        return ending.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
