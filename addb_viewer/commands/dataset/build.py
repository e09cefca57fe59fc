"""`addb-viewer dataset build`: from folders of reviewed subjects to a release."""

import re
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from addb_viewer.commands.options import Debug
from addb_viewer.dataset.release_subject import NO_SPDX, is_spdx
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.text.amounts import counted, lasting

if TYPE_CHECKING:
    from addb_viewer.dataset.build import Plan

CONSENTS = ("public", "restricted", "unknown")
Roots = Annotated[
    list[Path],
    typer.Argument(metavar="ROOT…", help="Folders of subjects, or subjects; .b3d files too.", exists=True),
]
Out = Annotated[
    Path, typer.Option("--out", metavar="RELEASE", help="Folder of the release; RELEASE.work lies beside it.")
]
Licence = Annotated[
    str | None,
    typer.Option(
        "--licence",
        metavar="ID",
        help="SPDX identifier, or LicenseRef-NAME, of subjects whose subject.toml names none.",
    ),
]
Consent = Annotated[
    str | None, typer.Option("--consent", metavar="WORD", help="Likewise: public, restricted, unknown.")
]
Source = Annotated[
    str | None, typer.Option("--source", metavar="NAME", help="Likewise; without it ROOT's own name.")
]
Unreviewed = Annotated[
    bool, typer.Option("--unreviewed", help="Take trials too whose review nobody has finished.")
]
Without = Annotated[
    list[str] | None,
    typer.Option(
        "--without",
        metavar="PERSON",
        help="Leave out this person, SOURCE/PERSON, in later builds too; may be given several times.",
    ),
]
Rate = Annotated[
    str, typer.Option("--rate", metavar="HZ", help="Frames a second, or native: each recording's own.")
]
Workers = Annotated[
    int | None, typer.Option("--workers", metavar="N", help="Subjects fitted at a time; one a core.", min=1)
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="Of a Dask cluster, tcp://… here or tls://… elsewhere; local: Dask on this machine.",
    ),
]
TimeOut = Annotated[
    float | None,
    typer.Option(
        "--time-out",
        metavar="MIN",
        help="Minutes after which a subject is left out; without it none is.",
        min=0.01,
    ),
]
NoB3d = Annotated[bool, typer.Option("--no-b3d", help="Leave out B3D files, which are most of a release.")]
Names = Annotated[bool, typer.Option("--names", help="Tell reviewers by their own names.")]
Date = Annotated[
    str | None, typer.Option("--date", metavar="YYYY-MM-DD", help="Of publication, for croissant.json.")
]
DryRun = Annotated[
    bool, typer.Option("--dry-run", help="Say what would be taken and what not; write nothing.")
]


def build(
    roots: Roots,
    out: Out,
    licence: Licence = None,
    consent: Consent = None,
    source: Source = None,
    unreviewed: Unreviewed = False,
    without: Without = None,
    rate: Rate = "100",
    workers: Workers = None,
    scheduler: Scheduler = None,
    time_out: TimeOut = None,
    no_b3d: NoB3d = False,
    names: Names = False,
    date: Date = None,
    dry_run: DryRun = False,
    debug: Debug = False,
) -> None:
    """Make a release of all subjects below some folders, or bring it up to date."""
    if consent is not None and consent not in CONSENTS:
        raise typer.BadParameter(f"choose one of {', '.join(CONSENTS)}", param_hint="--consent")
    if date is not None and not re.fullmatch(r"\d{4}-\d{2}-\d{2}", date):
        raise typer.BadParameter("write it as YYYY-MM-DD", param_hint="--date")
    if source is not None and (re.search(r"[/\\]", source) or source.startswith(".")):
        raise typer.BadParameter("a name without / and \\, please", param_hint="--source")
    if licence is not None and not is_spdx(licence):
        raise typer.BadParameter(NO_SPDX.format(licence), param_hint="--licence")
    rate_hz = _rate(rate)
    with errors_as_lines(debug):
        from addb_viewer.dataset.build import build as made  # noqa: PLC0415 (loads the solver)
        from addb_viewer.dataset.build import continuing, planned  # noqa: PLC0415 (likewise)
        from addb_viewer.dataset.options import BuildOptions  # noqa: PLC0415 (likewise)
        from addb_viewer.dataset.release_subject import Terms  # noqa: PLC0415 (likewise)
        from addb_viewer.jobs.dask_cluster import DaskCluster  # noqa: PLC0415 (likewise)
        from addb_viewer.jobs.processes import Processes, usual_workers  # noqa: PLC0415 (likewise)

        options = BuildOptions(
            Terms(source, licence, consent),
            unreviewed,
            rate_hz,
            tuple(sorted(without or ())),
            names,
            b3d=not no_b3d,
        )
        options = continuing(options, out)
        plan = planned(roots, options)
        _tell(plan, in_full=dry_run)
        if dry_run:
            return
        count = workers or usual_workers()
        limit_s = None if time_out is None else 60 * time_out
        engine = DaskCluster(scheduler, count) if scheduler else Processes(count)
        manifest = made(plan, out, options, engine, time_out_s=limit_s, told=typer.echo, published=date)
        totals = manifest["totals"]
        typer.echo(
            f"{out}: version {manifest['version']}, {counted(totals['subjects'], 'subject')}, "
            f"{counted(totals['trials'], 'trial')}, {lasting(totals['hours'])}, of these "
            f"{lasting(totals['hours_counting'])} count; {totals['left_out']} left out"
        )


def _rate(word: str) -> float | None:
    if word == "native":
        return None
    try:
        rate = float(word)
    except ValueError:
        rate = 0.0
    if not 10 <= rate <= 1000:
        raise typer.BadParameter("a number from 10 to 1000, or native", param_hint="--rate")
    return rate


def _tell(plan: "Plan", *, in_full: bool) -> None:
    """What is taken and what not: a line a subject and thing, or the counts alone."""
    if in_full:
        _tell_triage(plan)
        for one in plan.wanted:
            hours = lasting(sum(trial.hours for trial in one.trials))
            trials = counted(len(one.trials), "trial")
            typer.echo(f"{one.who.subject_id}: {trials}, {counted(one.frames, 'frame')}, {hours}")
        for row in plan.left_out:
            detail = f": {row.detail}" if row.detail else ""
            typer.echo(f"left out: {row.id} ({row.reason}){detail}")
    else:
        for reason, count in sorted(Counter(row.reason for row in plan.left_out).items()):
            typer.echo(f"left out: {count} × {reason}")
    typer.echo(
        f"{counted(len(plan.wanted), 'subject')}, "
        f"{counted(sum(len(one.trials) for one in plan.wanted), 'trial')}, "
        f"{counted(plan.frames, 'frame')}; about {plan.bytes / 1e6:.0f} MB"
    )


def _tell_triage(plan: "Plan") -> None:
    """What the kept fits and diagnoses say of each trial, those with the largest residual first."""
    from addb_viewer.dataset.triage import triaged  # noqa: PLC0415 (loads the solver)

    def said(value: float | None, form: str) -> str:
        return "–" if value is None else f"{value:{form}}"

    rows = [row for one in plan.subjects if one.trials for row in triaged(one)]
    for row in sorted(rows, key=lambda row: -(row.linear_rms_bw or 0.0)):
        residual = f"{said(row.linear_rms_bw, '.3f')} BW, {said(row.angular_rms_bwh, '.4f')} BW·h"
        mass = f"{said(row.mass_kg, '.1f')} kg, entered {said(row.mass_entered_kg, '.1f')}"
        concerns = "; ".join(row.concerns) or "nothing to look at"
        typer.echo(f"{row.trial_id}: residual {residual}; {mass}; {concerns}")
