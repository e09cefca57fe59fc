"""What fit, export and demo share: open a subject, solve it, keep the fit, find one that is still current."""

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from solver.capture.subject import open_subject

from addb_viewer.commands.progress import terminal_progress
from solver.capture.capture import Subject
from solver.errors import CaptureError, ResultsError
from solver.fit import Fit
from solver.pipeline import solve
from solver.provenance import provenance_of
from solver.results.store import default_folder, has_fit, load_fit, save_fit
from solver.settings import Settings, as_dict, settings_for


@dataclass(frozen=True)
class Job:
    """One subject to be solved, and where its fit goes."""

    subject: Subject
    settings: Settings
    trials: tuple[str, ...] | None  # None: all
    results: Path


def job_for(
    folder: Path,
    *,
    out: Path | None = None,
    trials: Sequence[str] | None = None,
    settings_file: Path | None = None,
) -> Job:
    """Open a subject's folder and check what is wanted before any time is spent on it.

    Raises:
        CaptureError: no such folder, nothing in it to fit, or no trial of that name.
        SettingsError: a settings file with an unknown name or a value of the wrong kind.
    """
    check_folder(folder)
    subject = open_subject(folder)
    _check_trials(subject, trials or ())
    return Job(
        subject=subject,
        settings=settings_for(folder, settings_file),
        trials=tuple(trials) if trials else None,
        results=out or default_folder(folder),
    )


def check_folder(folder: Path) -> None:
    """Refuse a subject folder that isn't there."""
    if not folder.is_dir():
        raise CaptureError(f"{folder}: no such folder; give the folder that holds the recordings")


def solved(job: Job) -> tuple[Fit, list[Path]]:
    """Solve and keep the fit in place of the last one; the files written come with it."""
    with terminal_progress() as progress:
        fit = solve(job.subject, job.settings, trials=job.trials, progress=progress)
    return fit, save_fit(fit, job.results)


def current_fit(job: Job) -> Fit:
    """The kept fit where it's still that of these files, settings and versions; else a new one."""
    kept = _kept_fit(job)
    return kept if kept is not None else solved(job)[0]


def _kept_fit(job: Job) -> Fit | None:
    if not has_fit(job.results):
        return None
    try:
        fit = load_fit(job.results, job.subject.folder)
    except ResultsError:
        return None
    wanted = [trial for trial in job.subject.trials if job.trials is None or trial.name in job.trials]
    same_inputs = fit.provenance == provenance_of(job.subject, wanted)
    return fit if same_inputs and fit.settings == as_dict(job.settings) else None


def _check_trials(subject: Subject, wanted: Sequence[str]) -> None:
    known = [trial.name for trial in subject.trials]
    for name in wanted:
        if name not in known:
            near = get_close_matches(name, known) or known
            raise CaptureError(f"{subject.folder}: no trial '{name}'; nearest: {', '.join(near)}")
