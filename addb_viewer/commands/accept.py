"""`addb-viewer accept` and `reject`: whether later fits are to use the causes that the diagnosis named."""

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import typer

from addb_viewer.accepted_exchanges import cannot_be_accepted, exchange_in_words, exchanges_of
from addb_viewer.accepted_extension import keep_gain
from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.options import Debug, IgnoreReview, JsonFile, Out, SettingsFile, SubjectFolder
from addb_viewer.commands.progress import terminal_progress
from addb_viewer.commands.reviewing import Author, author_named
from addb_viewer.commands.solving import Job, job_for, last_fit
from addb_viewer.extension_words import what_accepting_changes
from addb_viewer.kept_diagnosis import kept
from addb_viewer.sections import as_text
from solver.diagnosis.accepting import extension_for
from solver.diagnosis.extended_fit import extended_fit
from solver.diagnosis.report import extended_gain_json
from solver.dynamics.extension import Cause, Extension
from solver.effects.catalogue import MARKER_IDS
from solver.errors import ResultsError
from solver.fit import Fit
from solver.kinematics.label_faults.fault import Exchange
from solver.progress import part
from solver.provenance import other_recordings, provenance_of, without_reviews
from solver.results import extension_log
from solver.results.store import check_place, write_json
from solver.settings import as_dict

FOUND = 0.5  # share of the work that is done once the causes are found again


def accept(
    subject: SubjectFolder,
    out: Out = None,
    settings: SettingsFile = None,
    ignore_review: IgnoreReview = False,
    author: Author = None,
    json: JsonFile = None,
    debug: Debug = False,
) -> None:
    """Accept the causes of the last diagnosis: from now on fits use them beside the recorded forces.

    The trajectories are fitted without and with them, and what that gains is told. Exchanged labels are
    exchanged back in every fit; a slip and soft tissue lie in the markers alone and cannot be part of it.
    """
    if json is not None and not json.absolute().parent.is_dir():
        raise typer.BadParameter(f"no folder {json.parent} to write into", param_hint="--json")
    with errors_as_lines(debug):
        job = job_for(
            subject, out=out, settings_file=settings, ignore_review=ignore_review, without_extension=True
        )
        by, figures, made_of = author_named(author), *_diagnosis(job)
        causes, exchanges, left_out = _split(figures, job.results)
        if not causes:
            labels_alone = Extension((), np.zeros(0), np.zeros(0), exchanges=exchanges)
            extension_log.accept(job.results, labels_alone, by=by, made_of=made_of, left_out=left_out)
            if json is not None:
                write_json(json, {"causes": [], "exchanges": _exchanges(exchanges)})
            _tell(labels_alone, by, left_out, last_fit(job))
            return
        with terminal_progress() as progress:
            found = extension_for(
                job.subject,
                job.settings,
                {(cause.id, cause.target) for cause in causes},
                trials=figures["trials"],
                reviews=job.reviews,
                progress=part(progress, 0.0, FOUND),
            )
            gain = extended_fit(found.fit, found.extension, job.settings, part(progress, FOUND, 1.0))
        told = {
            "causes": _plain(found.causes_at(gain.fit.extra)),
            "exchanges": _exchanges(exchanges),
            **extended_gain_json(gain),
        }
        extension = replace(found.extension, exchanges=exchanges)
        decision = extension_log.accept(job.results, extension, by=by, made_of=made_of, left_out=left_out)
        kept_in = keep_gain(told, decision, job.results)
        if json is not None:
            write_json(json, told)
        for line in as_text([what_accepting_changes(told)]):
            typer.echo(line)
        typer.echo()
        _tell(extension, by, left_out, last_fit(job))
        if found.undone:
            undone = ", ".join(f"{id_} ({target})" for id_, target in found.undone)
            typer.echo(f"left out, because reading the files puts it right in every fit: {undone}")
        typer.echo(f"written: {kept_in}")


def reject(
    subject: SubjectFolder,
    out: Out = None,
    author: Author = None,
    debug: Debug = False,
) -> None:
    """Reject the causes of the last diagnosis: from now on fits use the recorded forces alone."""
    with errors_as_lines(debug):
        job = job_for(subject, out=out, without_extension=True)
        check_place(job.results)
        by, found = author_named(author), kept(job.results)
        held = extension_log.accepted(job.results)
        if found is None and held is None:
            raise ResultsError(f"{job.results}: nothing to reject; no diagnosis is kept here.")
        causes = held[1].causes if held else _causes(found[0] if found else {})
        made_of = without_reviews(provenance_of(job.subject, job.subject.trials))
        decision = extension_log.reject(job.results, causes, by=by, made_of=made_of)
        said = ", ".join(f"{c.id} ({c.target})" for c in decision.causes) or "the diagnosis"
        typer.echo(f"rejected by {by}: {said}; fits use the recorded forces alone")


def _diagnosis(job: Job) -> tuple[dict[str, Any], dict[str, str]]:
    """The last diagnosis and the provenance of its recordings, if both are still those of the folder."""
    check_place(job.results)
    found = kept(job.results)
    if found is None:
        raise ResultsError(f"{job.results}: no diagnosis is kept here. Run: addb-viewer diagnose")
    figures, made_of = found
    of_trials = [t for t in job.subject.trials if t.name in figures["trials"]]
    now = provenance_of(job.subject, of_trials)
    changed = other_recordings(made_of["provenance"], now)
    if made_of["settings"] != as_dict(job.settings):
        changed.append("the settings")
    if changed:
        raise ResultsError(
            f"{job.results}: since the diagnosis these have changed: {', '.join(changed)}. "
            "Run: addb-viewer diagnose"
        )
    return figures, now


def _tell(extension: Extension, by: str, left_out: Sequence[str], fit: Fit | None) -> None:
    """What was decided; of exchanged labels, whether the last fit exchanged them without being told."""
    typer.echo(f"accepted by {by}: {extension.sentence}; the next fit uses it")
    for exchange in extension.exchanges:
        typer.echo(exchange_in_words(exchange, fit))
    if left_out:
        typer.echo(f"left out, because they lie in the markers alone: {', '.join(left_out)}")


def _exchanges(exchanges: Sequence[Exchange]) -> list[dict[str, object]]:
    return [{"trial": e.trial, "labels": list(e.labels), "frames": [e.start, e.end]} for e in exchanges]


def _split(
    figures: dict[str, Any], results: Path
) -> tuple[tuple[Cause, ...], tuple[Exchange, ...], tuple[str, ...]]:
    """Causes that act as a wrench; labels that are exchanged; and what cannot be accepted, in words."""
    causes, exchanges = _causes(figures), exchanges_of(figures)
    wrenches = tuple(cause for cause in causes if cause.id not in MARKER_IDS)
    left_out = tuple(f"{cause.id} ({cause.target})" for cause in causes if cannot_be_accepted(cause.id))
    if not wrenches and not exchanges:
        why = "its causes lie in the markers alone; mend the markers" if left_out else "it names no cause"
        raise ResultsError(f"{results}: nothing in the diagnosis can be accepted: {why}.")
    return wrenches, exchanges, left_out


def _causes(figures: dict[str, Any]) -> tuple[Cause, ...]:
    return tuple(
        Cause(e["id"], e["target"], {n: (p["value"], p["std"]) for n, p in e["parameters"].items()})
        for e in figures.get("effects", ())
    )


def _plain(causes: Sequence[Cause]) -> list[dict[str, object]]:
    """Causes as the diagnosis' JSON has them; what the recording says nothing about is None."""
    return [
        {
            "id": cause.id,
            "target": cause.target,
            "parameters": {
                name: {"value": v if isfinite(v) else None, "std": s if isfinite(s) else None}
                for name, (v, s) in cause.parameters.items()
            },
        }
        for cause in causes
    ]
