"""A subject's page to hand over, of a current fit and, where asked for, a current diagnosis."""

from collections.abc import Callable, Sequence
from pathlib import Path

from addb_viewer.jobs.diagnosing import diagnosed
from addb_viewer.jobs.solving import Job, solved
from addb_viewer.jobs.subject_checks import check_trials
from addb_viewer.recordings.recording import recording_of
from addb_viewer.report.content import DiagnosisShown, SubjectReport
from addb_viewer.report.diagnosis_shown import diagnosis_shown
from addb_viewer.report.subject_page import write_report
from solver.fit import Fit
from solver.progress import Progress, part, silent

PAGE = "report.html"
SOLVED = 0.5  # share of the work before a diagnosis


def reported(
    job: Job,
    *,
    as_recorded: Callable[[], Job] | None = None,
    trials: Sequence[str] = (),
    file: Path | None = None,
    progress: Progress = silent,
) -> tuple[Path, SubjectReport]:
    """Solve where that is due, and write the page.

    Args:
        job: what is wanted.
        as_recorded: opens the same without what was accepted, to diagnose where no diagnosis of the fit is
            kept; None: don't diagnose.
        trials: those to report; empty for all.
        file: to write; None: in the results folder.
        progress: told the stage and the fraction done; raise `Cancelled` in it to stop.

    Returns:
        The file, and what it was made of.

    Raises:
        SolverError: the subject cannot be solved, or the file not be written.
    """
    check_trials(job.subject, trials)
    share = SOLVED if as_recorded else 1.0
    fit = solved(job, progress=part(progress, 0.0, share)).fit
    shown = diagnosis_shown(fit, job.results)
    if as_recorded is not None and shown.figures is None:
        diagnosed(as_recorded(), part(progress, SOLVED, 1.0))
        shown = diagnosis_shown(fit, job.results)
    return page_of(fit, job.results, file or job.results / PAGE, trials=trials, shown=shown)


def page_of(
    fit: Fit,
    results: Path,
    file: Path,
    *,
    trials: Sequence[str] | None = None,
    shown: DiagnosisShown | None = None,
) -> tuple[Path, SubjectReport]:
    """Write the page about a fit; nothing is solved.

    Args:
        fit: the solved subject.
        results: where the diagnosis and the decisions lie.
        file: to write; its folder must exist.
        trials: those to report; None or empty for all.
        shown: the diagnosis beside the fit; None: it is looked for.

    Returns:
        The file, and what it was made of.

    Raises:
        SolverError: what is kept cannot be read, or the file not be written.
    """
    shown = shown or diagnosis_shown(fit, results)
    made = SubjectReport(recording_of(fit, trials=trials, diagnosis=shown.figures), shown)
    return write_report(made, file), made
