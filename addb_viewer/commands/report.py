"""`addb-viewer report`: a fit as one page to hand over; of many subjects, a page each and an overview."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from addb_viewer.commands.fit import key_findings
from addb_viewer.commands.many import Jobs, Work, done_to_all, options
from addb_viewer.commands.options import (
    Debug,
    IgnoreReview,
    JsonFile,
    SettingsFile,
    Solve,
    Trials,
    replaceable,
)
from addb_viewer.jobs.command_errors import FAILED, check_folder, errors_as_lines, warn
from addb_viewer.jobs.root_folder import RootFolder, open_root
from addb_viewer.jobs.solving import job_for
from addb_viewer.jobs.terminal_progress import terminal_progress
from addb_viewer.report.content import SubjectReport
from addb_viewer.report.frames_kept import Kept
from addb_viewer.report.overview import Entry, write_overview
from addb_viewer.report.reporting import ONE_PAGE, PAGE, reported
from addb_viewer.trial_view.recorded_subject import file_of
from annotations.review_errors import ReviewError
from solver.capture.atomic import made_folder
from solver.capture.formats.b3d.places import subject_folder_of
from solver.capture.subject.measured_files import refuse_to_replace
from solver.common.errors import Cancelled, SolverError
from solver.common.small_files import json_content
from solver.fitting.fit_summary import TrialFigures
from solver.fitting.results.store import default_folder, has_fit, write_json

Root = Annotated[
    Path,
    typer.Argument(
        metavar="SUBJECT", help="A subject's folder, a .b3d file, or a folder of several subjects."
    ),
]
OutPlace = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="PLACE",
        help="File to write, SUBJECT/results/report.html by default; of several subjects, a folder.",
        callback=replaceable,
    ),
]
Diagnose = Annotated[
    bool, typer.Option("--diagnose", help="Diagnose first where no diagnosis of this fit is kept.")
]
OnePage = Annotated[
    bool, typer.Option("--one-page", help="Write the form on one A4 page instead, results/one_page.html.")
]


@dataclass(frozen=True)
class _Wishes:
    """What is wanted of every subject."""

    trials: tuple[str, ...]
    diagnose: bool
    settings: Path | None
    ignore_review: bool
    one_page: bool
    anew: bool

    @property
    def page(self) -> str:
        """The file's name in the results folder."""
        return ONE_PAGE if self.one_page else PAGE


def report(
    subject: Root,
    out: OutPlace = None,
    trial: Trials = None,
    diagnose: Diagnose = False,
    one_page: OnePage = False,
    solve: Solve = False,
    settings: SettingsFile = None,
    ignore_review: IgnoreReview = False,
    jobs: Jobs = 1,
    json: JsonFile = None,
    debug: Debug = False,
) -> None:
    """Write a page that says how good a fit is, on which frames, and why not on others.

    Solves first where no fit is kept. The page opens without a network, plays and prints.
    """
    with errors_as_lines(debug):
        subject = subject_folder_of(subject)
        check_folder(subject)
        root = open_root(subject)
        wishes = _Wishes(tuple(trial or ()), diagnose, settings, ignore_review, one_page, solve)
        if root.names == (".",):
            file, made = _one(subject, out, wishes)
            typer.echo(file)
            entries, overview = [Entry(made.recording.subject, file, made, "")], None
        else:
            page = (out or root.path) / ("index.html" if out else PAGE)
            refuse_to_replace(page)
            if jobs > 1:
                _fit_first(root, wishes, jobs)
            entries = _each(root, out, wishes)
            overview = _overview(root, page, entries)
        if json is not None:
            write_json(json, pages_written(entries, overview))
        failed = sum(entry.report is None for entry in entries)
        if failed:
            typer.echo(f"addb-viewer: no report of {failed} of {len(entries)} subjects, see above", err=True)
            raise typer.Exit(FAILED)


def _one(folder: Path, file: Path | None, wishes: _Wishes) -> tuple[Path, SubjectReport]:
    """Write a subject's page."""
    opened = partial(job_for, folder, settings_file=wishes.settings, ignore_review=wishes.ignore_review)
    with terminal_progress() as progress:
        return reported(
            opened(),
            as_recorded=partial(opened, without_extension=True) if wishes.diagnose else None,
            trials=wishes.trials,
            file=file,
            one_page=wishes.one_page,
            anew=wishes.anew,
            tell=lambda said: warn(said and f"{folder.name}: {said}"),
            progress=progress,
        )


def _fit_first(root: RootFolder, wishes: _Wishes, jobs: int) -> None:
    """Fit those without a fit in processes of their own: pages are made of kept fits, and say what failed."""

    def still_kept(folder: Path) -> dict[str, Any] | None:
        results = default_folder(folder)
        return json_content(results / "fit.json") if has_fit(results) else None

    words = options(
        settings=wishes.settings and wishes.settings.absolute(),
        ignore_review=wishes.ignore_review,
    )
    done_to_all(
        root,
        Work("fit", words, None, key_findings, kept=still_kept),
        jobs,
        lambda line: typer.echo(line, err=True),
    )


def _each(root: RootFolder, out: Path | None, wishes: _Wishes) -> list[Entry]:
    """A page for each subject; what fails is told, with its reason."""
    if out is not None:
        made_folder(out)
    entries = []
    for name in root.names:
        file = out / f"{file_of(name)}.html" if out else default_folder(root.path / name) / wishes.page
        try:
            _, made = _one(root.path / name, file, wishes)
        except Cancelled:
            raise
        except (SolverError, ReviewError) as error:
            typer.echo(f"addb-viewer: {name}: {' '.join(str(error).split())}", err=True)
            entries.append(Entry(name, None, None, str(error).replace(f"{root.path}/", "")))
        else:
            typer.echo(file)
            entries.append(Entry(name, file, made, ""))
    return entries


def _overview(root: RootFolder, file: Path, entries: list[Entry]) -> Path:
    """The page that leads to them."""
    notes = [note.replace(f"{root.path}/", "") for note in root.notes]
    typer.echo(write_overview(root.path.name, entries, notes, file))
    return file


def pages_written(entries: Sequence[Entry], overview: Path | None) -> dict[str, Any]:
    """Each subject's page with its chief figures; or why it has none.

    Args:
        entries: the subjects.
        overview: the page that leads to them, of several.
    """
    return {
        "pages": [_page(entry) for entry in entries],
        "overview": None if overview is None else str(overview),
    }


def _page(entry: Entry) -> dict[str, Any]:
    report = entry.report
    if report is None:
        return {"subject": entry.name, "file": None, "error": entry.error, "trials": [], "verdict": None}
    diagnosis = report.diagnosis.figures
    return {
        "subject": entry.name,
        "file": str(entry.file),
        "error": None,
        "trials": _trials(report),
        "verdict": None if diagnosis is None else diagnosis.verdict,
    }


def _trials(report: SubjectReport) -> list[dict[str, Any]]:
    return [
        _trial(record.figures, kept)
        for record, kept in zip(report.recording.trials, report.kept, strict=True)
    ]


def _trial(figures: TrialFigures, kept: Kept) -> dict[str, Any]:
    return {
        "name": figures.name,
        "frames": kept.frames,
        "usable_frames": kept.count,
        "usable_ranges": [list(r) for r in kept.ranges],
        "left_out": [
            {"foot": cause.foot, "reason": cause.reason, "ranges": [list(r) for r in cause.ranges]}
            for cause in kept.causes
        ],
        "mask_source": figures.mask_source,
        "hicks": vars(figures.hicks),
    }
