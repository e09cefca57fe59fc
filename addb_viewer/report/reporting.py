"""A subject's page to hand over, of a current fit and, where asked for, a current diagnosis."""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from addb_viewer.jobs.accepted_extension import extension_of
from addb_viewer.jobs.diagnosing import COUNTS, counts_of, diagnosed
from addb_viewer.jobs.kept_diagnosis import kept
from addb_viewer.jobs.review_store import whole_log
from addb_viewer.jobs.solving import Job, kept_fit
from addb_viewer.report.content import DiagnosisShown, SubjectReport
from addb_viewer.report.one_page import one_page as form
from addb_viewer.report.subject_page import subject_page, write_report
from addb_viewer.trial_view.diagnosis_state import decision_in_words, read_state
from addb_viewer.trial_view.recorded_subject import recording_of
from solver.common.errors import ResultsError
from solver.common.progress import Progress, part, silent
from solver.fitting.fit_result import Fit, StanceInfluence
from solver.fitting.held_out_stage import leave_stances_out
from solver.fitting.provenance import other_recordings, without_reviews
from solver.fitting.settings import from_dict

PAGE, ONE_PAGE = "report.html", "one_page.html"
MOST_FRAMES = 3000  # of all trials, up to which stances are left out one by one: a second or two
SOLVED = 0.5  # share of the work before a diagnosis
AGAIN = "`addb-viewer report SUBJECT --diagnose` makes it anew."


def reported(
    job: Job,
    *,
    as_recorded: Callable[[], Job] | None = None,
    trials: Sequence[str] = (),
    file: Path | None = None,
    one_page: bool = False,
    anew: bool = False,
    tell: Callable[[str], None] = lambda _: None,
    progress: Progress = silent,
) -> tuple[Path, SubjectReport]:
    """Write the page of the kept fit; of the first where none is kept.

    Args:
        job: what is wanted.
        as_recorded: opens the same without what was accepted, to diagnose where no diagnosis of the fit is
            kept; None: don't diagnose.
        trials: those to report; empty for all.
        file: to write; None: in the results folder.
        one_page: the form on one page instead.
        anew: where the kept fit is out of date, make another beside it and take that.
        tell: told what the kept fit is out of date for, or is without.
        progress: told the stage and the fraction done; raise `Cancelled` in it to stop.

    Returns:
        The file, and what it was made of.

    Raises:
        SolverError: the subject cannot be solved, or the file not be written.
    """
    share = SOLVED if as_recorded else 1.0
    done = kept_fit(job, trials, anew=anew, progress=part(progress, 0.0, share))
    tell(done.said)
    fit = done.fit
    shown = diagnosis_shown(fit, job.results)
    if as_recorded is not None and shown.figures is None:
        diagnosed(as_recorded(), part(progress, SOLVED, 1.0))
        shown = diagnosis_shown(fit, job.results)
    place = file or job.results / (ONE_PAGE if one_page else PAGE)
    return page_of(fit, job.results, place, shown=shown, one_page=one_page)


def page_of(
    fit: Fit,
    results: Path,
    file: Path,
    *,
    trials: Sequence[str] | None = None,
    shown: DiagnosisShown | None = None,
    one_page: bool = False,
) -> tuple[Path, SubjectReport]:
    """Write the page about a fit; nothing is solved.

    Args:
        fit: the solved subject.
        results: where the diagnosis and the decisions lie.
        file: to write; its folder must exist.
        trials: those to report; None or empty for all.
        shown: the diagnosis beside the fit; None: it is looked for.
        one_page: the form on one page instead.

    Returns:
        The file, and what it was made of.

    Raises:
        SolverError: what is kept cannot be read, or the file not be written.
    """
    shown = shown or diagnosis_shown(fit, results)
    edits = whole_log(fit.subject.folder).edits
    influences: tuple[StanceInfluence, ...] = ()
    if not one_page and sum(trial.motion.frames for trial in fit.trials) <= MOST_FRAMES:
        with contextlib.suppress(ResultsError):  # its extension is not accepted any more
            extension = extension_of(fit, results)
            influences = tuple(leave_stances_out(fit, from_dict(fit.settings), extension))
    recording = recording_of(fit, trials=trials, diagnosis=shown.figures, edits=edits)
    made = SubjectReport(recording, shown, influences)
    return write_report(made, file, page=form if one_page else subject_page), made


def diagnosis_shown(fit: Fit, results: Path) -> DiagnosisShown:
    """The kept diagnosis where it belongs to a fit, else why it is not shown.

    Args:
        fit: the one that the report is about.
        results: the results folder.

    Raises:
        ResultsError: what is kept cannot be read.
    """
    found = kept(results)
    if found is None:
        return DiagnosisShown()
    figures, made_from = found
    changed = _changed(fit, made_from, figures.trials)
    if changed:
        return DiagnosisShown(
            absent=f"A diagnosis is kept, but since then these have changed: {', '.join(changed)}. {AGAIN}"
        )
    state = read_state(fit.subject, results, fit)
    decided = decision_in_words(state)
    return DiagnosisShown(figures, "", decided, state.standings, state.gain, state.decided)


def _changed(fit: Fit, made_from: Mapping[str, Mapping], trials: Sequence[str]) -> list[str]:
    """What the diagnosis was made of and the fit was not."""
    then, now = made_from["provenance"], fit.provenance
    changed = other_recordings(then, now)
    count = counts_of({trial.capture.name: trial.mask for trial in fit.trials if trial.mask is not None})
    known = made_from.get(COUNTS, {})
    same = all(name in known and known[name] == count.get(name) for name in trials)
    if not same and _reviews(then, trials) != _reviews(now, trials):
        changed.append("the flags")
    if made_from["settings"] != fit.settings:
        changed.append("the settings")
    return changed


def _reviews(provenance: Mapping[str, str], trials: Sequence[str]) -> dict[str, str]:
    """What people had flagged in these trials, by its hash."""
    others = without_reviews(provenance)
    return {k: v for k, v in provenance.items() if k not in others and k.endswith(tuple(trials))}
