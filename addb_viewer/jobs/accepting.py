"""Make causes that a diagnosis named part of the model, or decide against them."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from addb_viewer.accepted_exchanges import cannot_be_accepted, exchanges_of
from addb_viewer.accepted_extension import keep_gain
from addb_viewer.diagnosis_vocabulary import names_of, ranges_of
from addb_viewer.jobs.solving import Job
from addb_viewer.kept_diagnosis import kept
from solver.diagnosis.accepting import extension_for
from solver.diagnosis.extended_fit import extended_fit
from solver.diagnosis.report import extended_gain_json
from solver.dynamics.extension import Cause, Extension
from solver.effects.catalogue import MARKER_IDS
from solver.effects.effect import Range
from solver.errors import ResultsError
from solver.kinematics.label_faults.fault import Exchange
from solver.progress import Progress, part, silent
from solver.provenance import other_recordings, provenance_of, without_reviews
from solver.results import extension_log
from solver.results.extension_log import Decision
from solver.results.store import check_place
from solver.settings import as_dict

FOUND = 0.5  # share of the work that is done once the causes are found again


@dataclass(frozen=True)
class Accepted:
    """What somebody accepted, and what it changes."""

    extension: Extension
    by: str
    told: dict[str, Any]  # in the shape of `accept --json`; of exchanged labels alone, no gain
    left_out: tuple[str, ...]  # causes that lie in the markers alone
    undone: tuple[tuple[str, str], ...] = ()  # id and target of causes that reading the files puts right
    flagged: tuple[tuple[str, str], ...] = ()  # likewise of causes whose frames are flagged
    file: Path | None = None  # where the gain is kept; None where no fit was needed


def accepted(
    job: Job,
    *,
    by: str,
    only: Collection[tuple[str, str]] | None = None,
    progress: Progress = silent,
) -> Accepted:
    """Accept causes of the last diagnosis: later fits use them beside the recorded forces.

    Args:
        job: opened without what was accepted before.
        by: who decides.
        only: id and target of the causes meant; None: all that the diagnosis names.
        progress: told the stage and the fraction done; raise `Cancelled` in it to stop.

    Raises:
        ResultsError: no diagnosis of these recordings is kept, or nothing in it can be accepted.
        FitError: a cause is not found again.
    """
    figures, made_of = _diagnosis(job)
    figures = _without_leads(figures) if only is None else _only(figures, only, job.results)
    causes, exchanges, left_out = _split(figures, job.results)
    if not causes:
        labels_alone = Extension((), np.zeros(0), np.zeros(0), exchanges=exchanges)
        extension_log.accept(job.results, labels_alone, by=by, made_of=made_of, left_out=left_out)
        told: dict[str, Any] = {"causes": [], "exchanges": _exchanges(exchanges)}
        return Accepted(labels_alone, by, told, left_out)
    ranges = {(e["id"], e["target"]): [Range(*r) for r in ranges_of(figures, e)] for e in figures["effects"]}
    found = extension_for(
        job.subject,
        job.settings,
        {(cause.id, cause.target): ranges[cause.id, cause.target] for cause in causes},
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
    return Accepted(extension, by, told, left_out, found.undone, found.flagged, kept_in)


def rejected(job: Job, *, by: str) -> Decision:
    """Reject the causes of the last diagnosis: later fits use the recorded forces alone.

    Args:
        job: opened without what was accepted before.
        by: who decides.

    Raises:
        ResultsError: there is nothing to reject.
    """
    check_place(job.results)
    found, held = kept(job.results), extension_log.accepted(job.results)
    if found is None and held is None:
        raise ResultsError(f"{job.results}: nothing to reject; no diagnosis is kept here.")
    causes = held[1].causes if held else _causes(found[0] if found else {})
    made_of = without_reviews(provenance_of(job.subject, job.subject.trials))
    return extension_log.reject(job.results, causes, by=by, made_of=made_of)


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


def _only(figures: dict[str, Any], wanted: Collection[tuple[str, str]], results: Path) -> dict[str, Any]:
    """The diagnosis with these causes alone."""
    named = [(effect["id"], effect["target"]) for effect in figures["effects"]]
    for cause in wanted:
        if cause not in named:
            listed = ", ".join(f"{id} ({target})" for id, target in named) or "none"
            raise ResultsError(
                f"{results}: the last diagnosis does not name {cause[0]} ({cause[1]}). It names: {listed}."
            )
    effects = [effect for effect in figures["effects"] if (effect["id"], effect["target"]) in wanted]
    return {**figures, "effects": effects}


def _without_leads(figures: dict[str, Any]) -> dict[str, Any]:
    """The diagnosis without what is likelier wrong than right, where anything else is named."""
    return {**figures, "effects": names_of(figures) or figures["effects"]}


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
        why = "its causes lie in the markers alone; correct the markers" if left_out else "it names no cause"
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
