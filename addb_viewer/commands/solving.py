"""What fit, export and demo share: open a subject, solve it, keep the fit, find one that is still current."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path

from addb_viewer.commands.progress import terminal_progress
from addb_viewer.review_store import reviews_for_solve
from solver.capture.capture import Subject, TrialFiles
from solver.capture.subject import open_subject
from solver.contact.wrenches import MissingRange
from solver.errors import CaptureError, ResultsError
from solver.fit import Fit
from solver.pipeline import solve
from solver.provenance import provenance_of
from solver.results.store import check_place, default_folder, has_fit, load_fit, save_fit
from solver.settings import Settings, as_dict, settings_for


@dataclass(frozen=True)
class Job:
    """One subject to be solved, and where its fit goes."""

    subject: Subject
    settings: Settings
    trials: tuple[str, ...] | None  # None: all
    results: Path
    reviews: Mapping[str, Sequence[MissingRange]]  # by trial, what people flagged


def job_for(
    folder: Path,
    *,
    out: Path | None = None,
    trials: Sequence[str] | None = None,
    settings_file: Path | None = None,
    ignore_review: bool = False,
) -> Job:
    """Open a subject's folder and check what is wanted before any time is spent on it.

    Where people have reviewed a trial, their flags say which forces count, unless they are to be ignored.

    Raises:
        CaptureError: no such folder, nothing in it to fit, or no trial of that name.
        SettingsError: a settings file with an unknown name or a value of the wrong kind.
        ReviewError: the review log cannot be read.
    """
    check_folder(folder)
    subject = open_subject(folder)
    check_trials(subject, trials or ())
    reviews, notes = ({}, ()) if ignore_review else reviews_for_solve(subject, _wanted(subject, trials))
    if ignore_review:
        subject = _without_reviews(subject)
    return Job(
        subject=replace(subject, notes=(*subject.notes, *notes)),
        settings=settings_for(folder, settings_file),
        trials=tuple(trials) if trials else None,
        results=out or default_folder(folder),
        reviews=reviews,
    )


def check_folder(folder: Path) -> None:
    """Refuse a subject folder that isn't there."""
    if not folder.is_dir():
        raise CaptureError(f"{folder}: no such folder; give the folder that holds the recordings")


def check_trials(subject: Subject, wanted: Sequence[str]) -> None:
    """Refuse a trial that the subject doesn't have."""
    known = [trial.name for trial in subject.trials]
    for name in wanted:
        if name not in known:
            near = get_close_matches(name, known) or known
            raise CaptureError(f"{subject.folder}: no trial '{name}'; nearest: {', '.join(near)}")


def solved(job: Job) -> tuple[Fit, list[Path]]:
    """Solve and keep the fit in place of the last one; the files written come with it."""
    check_place(job.results)
    with terminal_progress() as progress:
        fit = solve(job.subject, job.settings, trials=job.trials, reviews=job.reviews, progress=progress)
    return fit, save_fit(fit, job.results)


def current_fit(job: Job) -> Fit:
    """The kept fit where it's still that of these files, settings and versions; else a new one."""
    kept = _kept_fit(job)
    return kept if kept is not None else solved(job)[0]


def judged(job: Job) -> Fit:
    """A fit with its forces judged: the kept one where it's current, else one of the markers alone.

    The latter takes seconds; it isn't kept, because it doesn't obey the forces.
    """
    kept = _kept_fit(job)
    if kept is not None:
        return kept
    alone = replace(job.settings, trajectory=replace(job.settings.trajectory, enabled=False))
    with terminal_progress() as progress:
        return solve(job.subject, alone, trials=job.trials, reviews=job.reviews, progress=progress)


def _kept_fit(job: Job) -> Fit | None:
    if not has_fit(job.results):
        return None
    try:
        fit = load_fit(job.results, job.subject.folder)
    except ResultsError:
        return None
    inputs = provenance_of(job.subject, _wanted(job.subject, job.trials), job.reviews)
    return fit if fit.provenance == inputs and fit.settings == as_dict(job.settings) else None


def _wanted(subject: Subject, trials: Sequence[str] | None) -> list[TrialFiles]:
    return [trial for trial in subject.trials if not trials or trial.name in trials]


def _without_reviews(subject: Subject) -> Subject:
    note = "reviews are ignored: forces that people flagged count as measured"
    trials = tuple(replace(trial, reviews=()) for trial in subject.trials)
    return replace(subject, trials=trials, notes=(*subject.notes, note))
