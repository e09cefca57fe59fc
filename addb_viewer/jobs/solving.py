"""Open a subject, solve it, keep the fit; find what is kept, and what has changed since."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from functools import partial
from pathlib import Path

from addb_viewer.jobs.accepted_extension import extension_for_solve
from addb_viewer.jobs.command_errors import check_folder, check_trials
from addb_viewer.jobs.force_reviews import reviews_for_solve
from addb_viewer.jobs.reviewing import login_name
from solver.capture.capture import Capture, Subject, TrialFiles
from solver.capture.subject.opened_subject import open_subject
from solver.common.errors import FitError, ResultsError
from solver.common.notes import Kind, Note
from solver.common.progress import Progress, part, silent
from solver.contact.force_review import ForceReview
from solver.dynamics.trajectory.extension import Extension
from solver.fitting.fit_result import Fit
from solver.fitting.held_out_stage import predict_held_out
from solver.fitting.pipeline import can_resolve, resolve, solve
from solver.fitting.provenance import differences, provenance_of
from solver.fitting.results.disk_space import check_room_for_fit
from solver.fitting.results.store import (
    check_place,
    default_folder,
    files_of_fit,
    has_fit,
    load_fit,
    save_fit,
)
from solver.fitting.results.writing import writing
from solver.fitting.review_stage import with_same_forces
from solver.fitting.settings import Settings, decide_the_same_fit, settings_for
from solver.markers.mapping_file import chosen_for
from solver.skeleton.skeleton import Skeleton

RESOLVED = 0.4  # share of a re-solve's work before the held-out blocks


@dataclass(frozen=True)
class Job:
    """One subject to be solved, and where its fit goes."""

    subject: Subject
    settings: Settings
    trials: tuple[str, ...] | None  # None: all
    results: Path
    reviews: Mapping[str, ForceReview]  # by trial, what people flagged
    extension: Extension | None = None  # what a person accepted as acting beside the recorded forces


def job_for(
    folder: Path,
    *,
    out: Path | None = None,
    trials: Sequence[str] | None = None,
    settings_file: Path | None = None,
    settings: Settings | None = None,
    map_file: Path | None = None,
    ignore_review: bool = False,
    without_extension: bool = False,
    awaits: bool = False,
) -> Job:
    """Open a subject's folder and check what is wanted before any time is spent on it.

    Where people have reviewed a trial, their flags say which forces count, unless they are to be ignored.
    Likewise with the causes that somebody accepted as part of the model.

    Raises:
        CaptureError: no such folder, nothing in it to fit, no trial of that name, or a broken marker map.
        SettingsError: a settings file with an unknown name or a value of the wrong kind.
        ReviewError: the review log cannot be read.
        ResultsError: what somebody accepted cannot be read.
    """
    check_folder(folder)
    settings = settings or settings_for(folder, settings_file)
    subject = open_subject(folder, awaits=awaits)
    if map_file is not None:
        subject = replace(subject, marker_map=map_file)
    chosen_for(subject)
    check_trials(subject, trials or ())
    reviews, notes = ({}, ()) if ignore_review else reviews_for_solve(subject, _wanted(subject, trials))
    if ignore_review:
        subject = _without_reviews(subject)
    results, extension = out or default_folder(folder), None
    if not without_extension:
        extension, more = extension_for_solve(subject, _wanted(subject, trials), results)
        notes = (*notes, *more)
    return Job(
        subject=replace(subject, notes=(*subject.notes, *notes)),
        settings=settings,
        trials=tuple(trials) if trials else None,
        results=results,
        reviews=reviews,
        extension=extension,
    )


@dataclass(frozen=True)
class KeptFit:
    """A fit that is kept, and how it came about."""

    fit: Fit
    files: list[Path]  # none where it is not kept
    new: bool  # False: nothing was computed or written
    said: str  # about what was not computed again, is out of date or was not kept; empty after a whole solve

    @property
    def solve(self) -> str | None:
        """Name of the folder, in the results folder, that holds the fit; None where it is not kept."""
        return self.files[1].parent.name if self.files else None


def solved(job: Job, *, force: bool = False, progress: Progress = silent) -> KeptFit:
    """Solve and keep the fit in place of the last one, with no more work than the inputs ask for.

    Where nothing changed, the kept fit stands. Where only the reviews did, the search begins at it. A fit of
    some trials does not take the place of one that has others as well.

    Args:
        job: what is wanted.
        force: solve from the beginning whatever is kept.
        progress: told the stage and the fraction done; raise `Cancelled` in it to stop.
    """
    kept, before = last_fit(job), _written(job.results)
    if kept is not None and not force and not kept.held_out_due and not changes(kept, job):
        files = files_of_fit(job.results)
        said = f"unchanged: kept fit of {_date(job.results)} in {files[0]}; --force solves it again"
        return KeptFit(_as_of_now(kept, job), files, False, said)
    check_place(job.results)
    fit, said = computed(job, None if force else kept, progress)
    others = {t.capture.name for t in kept.trials} - set(job.trials) if kept and job.trials else ()
    if others:
        said = (
            f"not kept: the kept fit of {_date(job.results)} is of {', '.join(sorted(others))} as well; "
            "--out DIR keeps this one elsewhere"
        )
        return KeptFit(fit, [], True, said)
    with writing(job.results):
        if _written(job.results) not in (before, None):
            said = f"{said}; {_put_aside(job.results)}".removeprefix("; ")
        return KeptFit(fit, save_fit(fit, job.results), True, said)


def kept_fit(
    job: Job, trials: Sequence[str] = (), *, anew: bool = False, progress: Progress = silent
) -> KeptFit:
    """The fit that everything but `fit` goes by: the kept one, out of date or not; the first where none is.

    Args:
        job: of all trials.
        trials: those that are left in the fit; empty for all.
        anew: where the kept one is out of date, make another beside it, which the app shows.
        progress: told the stage and the fraction done; raise `Cancelled` in it to stop.

    Raises:
        SolverError: what is kept cannot be read, or the fit has no trial of that name.
    """
    if not has_fit(job.results):
        check_trials(job.subject, trials)
    done = _whole_kept_fit(job, anew, progress)
    had = [trial.capture.name for trial in done.fit.trials]
    lacking = [name for name in trials if name not in had]
    if lacking:
        raise FitError(
            f"{job.results}: no trial '{lacking[0]}' in the kept fit; it has {', '.join(had)}. "
            + (done.said or "Run: addb-viewer fit")
        )
    wanted = tuple(trial for trial in done.fit.trials if not trials or trial.capture.name in trials)
    return replace(done, fit=replace(done.fit, trials=wanted))


def _whole_kept_fit(job: Job, anew: bool, progress: Progress) -> KeptFit:
    if not has_fit(job.results):
        first = solved(job, progress=progress)
        return replace(first, said=_left_out(first.fit))
    kept, files = load_fit(job.results, job.subject.folder), files_of_fit(job.results)
    changed = changes(kept, job)
    if not changed:
        return KeptFit(_as_of_now(kept, job), files, False, _left_out(kept))
    since = f"the kept fit of {_date(job.results)} is out of date ({', '.join(changed)})"
    if not anew:
        said = f"{since}, and used all the same; `addb-viewer fit` renews it, --solve makes another beside it"
        return KeptFit(kept, files, False, said)
    from addb_viewer.jobs.stored_solves import FOLDER, add  # noqa: PLC0415 (rarely needed)

    check_place(job.results)
    began = time.monotonic()
    fit, _ = computed(job, kept, progress)
    number = add(fit, job.results, by=login_name(), seconds=time.monotonic() - began)
    said = f"{since} and stays; made from another, in {job.results / FOLDER / str(number)}"
    return KeptFit(fit, [], True, "; ".join(filter(None, [said, _left_out(fit)])))


def changes(fit: Fit, job: Job) -> list[str]:
    """What has changed since a fit was made, in words; empty where it would come out the same.

    Flags that let the same forces count change nothing.
    """
    now = provenance_of(job.subject, _wanted(job.subject, job.trials), job.reviews, job.extension)
    found = differences(fit.provenance, now)
    if not decide_the_same_fit(fit.settings, job.settings):
        found.append("the settings")
    if not found and fit.provenance != now and with_same_forces(fit, job.reviews, job.settings) is None:
        found.append("the flags")
    return found


def _as_of_now(fit: Fit, job: Job) -> Fit:
    """A fit that nothing has changed, with what people say now of its forces and is known of its inputs."""
    now = provenance_of(job.subject, _wanted(job.subject, job.trials), job.reviews, job.extension)
    notes = tuple(dict.fromkeys((*fit.subject.notes, *job.subject.notes)))
    if fit.provenance != now:
        fit = with_same_forces(fit, job.reviews, job.settings) or fit
    return replace(fit, subject=replace(fit.subject, notes=notes), provenance=now)


def _left_out(fit: Fit) -> str:
    """Which trials the fit is without, and why."""
    said = [f"{one.name or 'the static trial'} ({one.file.file}: {one.file.reason})" for one in fit.unread]
    return f"without {', '.join(said)}" if said else ""


def _date(results: Path) -> str:
    """When the kept fit was written."""
    when = datetime.fromtimestamp((results / "fit.json").stat().st_mtime).astimezone()
    return f"{when:%Y-%m-%d %H:%M}"


def _written(results: Path) -> tuple[int, int] | None:
    """Which `fit.json` lies there and when it was written [ns]; None where there is none."""
    try:
        file = (results / "fit.json").stat()
    except OSError:
        return None
    return file.st_ino, file.st_mtime_ns


def _put_aside(results: Path) -> str:
    """Keep what another program wrote while this one solved, and say where."""
    from addb_viewer.jobs.stored_solves import put_aside  # noqa: PLC0415 (rarely needed)

    return f"another program fitted this subject meanwhile; its fit is kept in {put_aside(results)}"


def computed(job: Job, kept: Fit | None, progress: Progress) -> tuple[Fit, str]:
    """Solve, beginning where the last fit ended if only flags or accepted causes have changed since.

    Args:
        job: what is wanted; nothing is written.
        kept: the last fit; None: from the beginning.
        progress: told how far it is.

    Returns:
        The fit, and what was not computed again; empty after a whole solve.

    Raises:
        SolverError: the fit would not find room in the results folder, or the data cannot be used.
    """
    resolving = part(progress, 0.0, RESOLVED)
    if kept is not None and (fit := resolved(job, kept, resolving, to_keep=True)) is not None:
        judging, before = part(progress, RESOLVED, 1.0), kept.held_out_layouts
        fit = predict_held_out(fit, job.settings, judging, job.extension, before=before)
        return fit, "only flags changed: scaling and marker fit are those of the kept fit"
    fit = solve(
        job.subject,
        job.settings,
        trials=job.trials,
        reviews=job.reviews,
        extension=job.extension,
        before_fitting=partial(_check_room, job),
        progress=progress,
    )
    return fit, ""


def resolved(job: Job, kept: Fit, progress: Progress = silent, *, to_keep: bool = False) -> Fit | None:
    """The kept fit with the forces that count now, as `resolve` leaves it; None where more has changed.

    Args:
        job: what is wanted; nothing is written.
        kept: the last fit.
        progress: told how far it is.
        to_keep: with how far it may be off, and refused where it would find no room.

    Raises:
        SolverError: as `computed`.
    """
    wanted = _wanted(job.subject, job.trials)
    if not can_resolve(kept, job.subject, wanted, job.settings, extension=job.extension):
        return None
    if to_keep:
        _check_room(job, kept.skeleton, [trial.capture for trial in kept.trials])
    previous = replace(kept, subject=job.subject)
    return resolve(previous, job.reviews, job.settings, progress, extension=job.extension, with_std=to_keep)


def _check_room(job: Job, skeleton: Skeleton, captures: Sequence[Capture]) -> None:
    check_room_for_fit(job.results, skeleton, captures, job.settings)


def judged(job: Job, progress: Progress = silent) -> Fit:
    """A fit with its forces judged: the kept one where it's current, else one of the markers alone.

    The latter takes seconds; it isn't kept, because it doesn't obey the forces.
    """
    kept = last_fit(job)
    if kept is not None and not kept.held_out_due and not changes(kept, job):
        return kept
    alone = replace(job.settings, trajectory=replace(job.settings.trajectory, enabled=False))
    return solve(job.subject, alone, trials=job.trials, reviews=job.reviews, progress=progress)


def last_fit(job: Job) -> Fit | None:
    """The fit that is kept, whatever it was made of."""
    if not has_fit(job.results):
        return None
    try:
        return load_fit(job.results, job.subject.folder)
    except ResultsError:
        return None


def _wanted(subject: Subject, trials: Sequence[str] | None) -> list[TrialFiles]:
    return [trial for trial in subject.trials if not trials or trial.name in trials]


def _without_reviews(subject: Subject) -> Subject:
    note = Note(Kind.OTHER, "reviews are ignored: detection alone says which forces count")
    trials = tuple(replace(trial, reviews=(), inner_review_finished=None) for trial in subject.trials)
    return replace(subject, trials=trials, notes=(*subject.notes, note))
