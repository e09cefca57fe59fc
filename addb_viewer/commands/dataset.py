"""`addb-viewer dataset`: a release of many subjects for machine learning, and what is in it."""

import re
from collections import Counter
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from addb_viewer.commands.options import Debug, JsonFile, file_to_read
from addb_viewer.dataset.release_subject import NO_SPDX, is_spdx
from addb_viewer.jobs.command_errors import FAILED, errors_as_lines
from addb_viewer.text.amounts import counted, lasting
from solver.common.errors import SolverError

if TYPE_CHECKING:
    from addb_viewer.dataset.build import Plan

Release = Annotated[
    Path,
    typer.Argument(metavar="RELEASE", help="Folder of a release.", exists=True, file_okay=False),
]


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
        from addb_viewer.dataset.release_subject import BuildOptions, Terms  # noqa: PLC0415 (likewise)
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
    from addb_viewer.dataset.scanning import triaged  # noqa: PLC0415 (loads the solver)

    def said(value: float | None, form: str) -> str:
        return "–" if value is None else f"{value:{form}}"

    rows = [row for one in plan.subjects if one.trials for row in triaged(one)]
    for row in sorted(rows, key=lambda row: -(row.linear_rms_bw or 0.0)):
        residual = f"{said(row.linear_rms_bw, '.3f')} BW, {said(row.angular_rms_bwh, '.4f')} BW·h"
        mass = f"{said(row.mass_kg, '.1f')} kg, entered {said(row.mass_entered_kg, '.1f')}"
        concerns = "; ".join(row.concerns) or "nothing to look at"
        typer.echo(f"{row.trial_id}: residual {residual}; {mass}; {concerns}")


Trial = Annotated[
    str | None, typer.Argument(metavar="[TRIAL]", help="A trial's id, or the end of it if only one ends so.")
]


def show(release: Release, trial: Trial = None, debug: Debug = False) -> None:
    """Say what a release holds; or of a trial where its numbers come from."""
    with errors_as_lines(debug):
        from addb_viewer.dataset import open as open_release  # noqa: PLC0415 (loads PyArrow)
        from addb_viewer.dataset.reader import overview, trial_in_words  # noqa: PLC0415 (likewise)

        opened = open_release(release)
        for line in overview(opened) if trial is None else trial_in_words(opened, trial):
            typer.echo(line)


Name = Annotated[str, typer.Option("--name", metavar="NAME", help="Of the split: splits/NAME.parquet.")]
Seed = Annotated[int, typer.Option("--seed", metavar="N", help="Of the order among alike persons.")]
Previous = Annotated[
    Path | None, file_to_read("--previous", "An earlier split; everybody in it keeps theirs.")
]
Folds = Annotated[
    int | None, typer.Option("--kfold", metavar="K", help="K folds of persons instead of 90:5:5.", min=2)
]
OneOut = Annotated[
    bool, typer.Option("--leave-one-person-out", help="A fold for every person instead of 90:5:5.")
]
HeldOut = Annotated[
    list[str] | None,
    typer.Option(
        "--hold-out-source",
        metavar="SOURCE",
        help="All of this source for test, the others for train and dev; may be given several times.",
    ),
]


def split(
    release: Release,
    name: Name = "default",
    seed: Seed = 0,
    previous: Previous = None,
    kfold: Folds = None,
    leave_one_person_out: OneOut = False,
    hold_out_source: HeldOut = None,
    debug: Debug = False,
) -> None:
    """Say which persons of a release are for training, development and test."""
    ways = {
        "--kfold": kfold is not None,
        "--leave-one-person-out": leave_one_person_out,
        "--hold-out-source": bool(hold_out_source),
    }
    asked = [option for option, wanted in ways.items() if wanted]
    if len(asked) > 1:
        raise typer.BadParameter(f"{asked[0]} and {asked[1]} are two kinds of split; give one")
    if Path(name).name != name or name.startswith("."):
        raise typer.BadParameter("a name without folders, please", param_hint="--name")
    with errors_as_lines(debug):
        from addb_viewer.dataset import splits  # noqa: PLC0415 (slow to load)

        persons = splits.persons_in(release)
        kept = splits.read_split(previous) if previous else None
        if kfold is not None:
            made, kind = splits.k_fold(persons, kfold, seed, kept), f"{kfold} folds"
        elif leave_one_person_out:
            made, kind = splits.leave_one_person_out(persons), "leave one person out"
        elif hold_out_source:
            made, kind = splits.hold_out(persons, hold_out_source, seed, kept), "sources held out"
        else:
            made, kind = splits.by_shares(persons, seed, previous=kept), "90:5:5"
        options = {"kind": kind, "seed": seed, "held_out": hold_out_source or [], "previous": bool(previous)}
        path = splits.write_split(release, name, made, persons, options)
        for split_name, count in splits.counts_of(persons, made)["all"].get("all", {}).items():
            typer.echo(f"{split_name}: {counted(count, 'person')}")
        if kind == "90:5:5" and splits.TEST not in made.values():
            typer.echo(
                f"note: nobody is in test: {counted(len(persons), 'person')} are too few for 90:5:5. "
                "--leave-one-person-out tests each of them once"
            )
        typer.echo(path)


StatsOut = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="RELEASE.stats by default.", file_okay=False)
]
FramesOption = Annotated[
    Literal["paper", "reviewed", "all"] | None,
    typer.Option(
        "--frames",
        help="paper: reviewed, and detection finds no fault either. Without a word: paper; all where a "
        "release has no such frame.",
    ),
]


def stats(release: Release, out: StatsOut = None, frames: FramesOption = None, debug: Debug = False) -> None:
    """Write the dataset paper's tables and figures of a release, and a page that holds them all."""
    with errors_as_lines(debug):
        if find_spec("matplotlib") is None:
            raise SolverError("figures need Matplotlib; install it: pip install 'matplotlib>=3.10'")
        from addb_viewer.dataset.stats.numbers import Frames  # noqa: PLC0415 (slow to load)
        from addb_viewer.dataset.stats.page import write_stats  # noqa: PLC0415

        folder = release.resolve()
        place = out or folder.with_name(f"{folder.name}.stats")
        tables, chosen, path = write_stats(folder, place, frames and Frames(frames))
        total = tables["sources"][-1]
        hours = f"{lasting(total['total_hours'])}, {lasting(total['grf_hours'])} in the figures"
        typer.echo(f"{counted(total['subjects'], 'person')}, {hours}")
        if not total["grf_hours"]:
            typer.echo(f"note: no frame is such (--frames {chosen}): figures are empty; try --frames all")
        elif frames is None and chosen is Frames.ALL:
            typer.echo("note: no frame is reviewed and without a fault: figures are about all that count")
        typer.echo(path)


What = Annotated[
    Path, typer.Argument(metavar="RELEASE", help="Folder of a release, or a .b3d file.", exists=True)
]
Refit = Annotated[
    bool, typer.Option("--refit", help="Of a .b3d file: fit and diagnose it, and print stored → ours.")
]

Against = Annotated[
    Path | None,
    typer.Option(
        "--against",
        metavar="OTHER",
        help="Of a release: say as well what it has otherwise than this one.",
        exists=True,
        file_okay=False,
    ),
]


def check(
    release: What,
    refit: Refit = False,
    against: Against = None,
    json: JsonFile = None,
    debug: Debug = False,
) -> None:
    """Say what is wrong with a release: files, schema, F = ma, torques, plausibility, duplicates, splits."""
    if refit and not release.is_file():
        raise typer.BadParameter("of a .b3d file alone; a release is fitted already", param_hint="--refit")
    if against is not None and release.is_file():
        raise typer.BadParameter("of a release alone", param_hint="--against")
    with errors_as_lines(debug):
        from dataclasses import asdict  # noqa: PLC0415

        from addb_viewer.dataset.check.against import differences  # noqa: PLC0415 (slow to load)
        from addb_viewer.dataset.check.b3d_check import b3d_findings  # noqa: PLC0415 (slow to load)
        from addb_viewer.dataset.check.checking import checked  # noqa: PLC0415
        from addb_viewer.dataset.check.findings import Level  # noqa: PLC0415
        from solver.fitting.results.store import write_json  # noqa: PLC0415

        place = release.resolve()
        found = b3d_findings(place) if place.is_file() else checked(place)
        if against is not None:
            found += differences(place, against.resolve())
        for one in found:
            typer.echo(str(one))
        errors = sum(one.level is Level.ERROR for one in found)
        typer.echo(f"{counted(errors, 'error')}, {counted(len(found) - errors, 'warning')}")
        if refit:
            _refit(place)
        if json is not None:
            write_json(json, {"errors": errors, "findings": [asdict(one) for one in found]})
    if errors:
        raise typer.Exit(FAILED)


def _refit(file: Path) -> None:
    from addb_viewer.dataset.check.b3d_check import in_words, refitted  # noqa: PLC0415 (slow to load)
    from addb_viewer.jobs.terminal_progress import terminal_progress  # noqa: PLC0415

    with terminal_progress() as progress:
        rows, causes = refitted(file, progress)
    for line in in_words(rows, causes):
        typer.echo(line)


Subjects = Annotated[
    int, typer.Option("--subjects", metavar="N", help="Good subjects; traps come on top.", min=1, max=10_000)
]
CorpusOut = Annotated[
    Path, typer.Option("--out", metavar="ROOT", help="A new folder; the truth goes to ROOT.truth.")
]
CorpusSeed = Annotated[
    int, typer.Option("--seed", metavar="S", help="The same one gives the same files.", min=0)
]
NoTraps = Annotated[bool, typer.Option("--no-traps", help="Only subjects that a release takes.")]


def synthesize(
    subjects: Subjects, out: CorpusOut, seed: CorpusSeed = 0, no_traps: NoTraps = False, debug: Debug = False
) -> None:
    """Make up a corpus of people, faults and traps, and keep the truth about it aside."""
    with errors_as_lines(debug):
        from addb_viewer.dataset.synthesis import corpus  # noqa: PLC0415 (slow to load)

        options = corpus.CorpusOptions(subjects, seed, traps=not no_traps)
        expected = corpus.synthesize(out.resolve(), options, typer.echo)
        for reason, count in sorted(Counter(row.reason for row in expected).items()):
            typer.echo(f"to be left out: {count} × {reason}")
        typer.echo(f"{out}; the truth: {corpus.truth_folder(out)}")
