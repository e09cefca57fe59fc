"""Make causes that a diagnosis named part of the model, or decide against them."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from addb_viewer.jobs.accepted_extension import keep_gain
from addb_viewer.jobs.kept_diagnosis import kept
from addb_viewer.jobs.solving import Job
from addb_viewer.text.diagnosis_vocabulary import about, names_of
from solver.common.errors import ResultsError
from solver.common.progress import Progress, part, silent
from solver.diagnosis.accepted_causes import extension_for
from solver.diagnosis.causes.about import CorrectedBy
from solver.diagnosis.causes.catalogue import MARKER_IDS, cannot_be_accepted
from solver.diagnosis.causes.effect import Range
from solver.diagnosis.diagnosis_report import AcceptedGain, DiagnosisReport, accepted_gain, told_exchanges
from solver.diagnosis.diagnosis_report import Cause as Named
from solver.diagnosis.extended_fit import extended_fit
from solver.dynamics.trajectory.extension import Cause, Extension
from solver.fitting.fit_result import Fit
from solver.fitting.provenance import other_recordings, provenance_of, without_reviews
from solver.fitting.results import extension_log
from solver.fitting.results.extension_log import ACCEPT, REJECT, Decision
from solver.fitting.results.store import check_place
from solver.fitting.settings import as_dict
from solver.kinematics.label_faults.fault import EXCHANGED, Exchange


def exchanges_of(figures: DiagnosisReport) -> tuple[Exchange, ...]:
    """The exchanged labels of a diagnosis, one for each stretch of frames."""
    found = []
    for effect in figures.effects:
        if about(effect).corrected_by is CorrectedBy.LABELS:
            one, _, other = effect.target.partition("+")
            found += [Exchange(name, (one, other), start, end) for name, start, end in effect.frames]
    return tuple(found)


def exchange_in_words(exchange: Exchange, fit: Fit | None) -> str:
    """What every fit does from now on.

    Args:
        exchange: that somebody accepted.
        fit: the last one, which may have done so by itself; None where there is none.
    """
    frames = f"{exchange.start}-{exchange.end - 1} of {exchange.trial}"
    said = f"labels {' and '.join(exchange.labels)} are swapped back in frames {frames}, in every fit"
    if fit is not None and any(
        fault.done == EXCHANGED
        and not fault.accepted
        and set(fault.labels) == set(exchange.labels)
        and fault.start < exchange.end
        and exchange.start < fault.end
        for trial in fit.trials
        if trial.capture.name == exchange.trial
        for fault in trial.label_faults
    ):
        said += "; the last fit did that by itself"
    return said


FOUND = 0.5  # share of the work that is done once the causes are found again


@dataclass(frozen=True)
class Accepted:
    """What somebody accepted, and what it changes."""

    extension: Extension
    by: str
    gain: AcceptedGain
    left_out: tuple[str, ...]  # causes that lie in the markers alone
    undone: tuple[tuple[str, str], ...] = ()  # id and target of causes that reading the files puts right
    flagged: tuple[tuple[str, str], ...] = ()  # likewise of causes whose frames are flagged
    file: Path | None = None  # where the gain is kept; None where no fit was needed


@dataclass(frozen=True)
class Wanted:
    """What is to be accepted, and what is rejected beside it."""

    figures: DiagnosisReport  # with these causes alone
    made_from: dict[str, str]
    refused: tuple[Cause, ...] = ()


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
        only: id and target of the causes meant, what was decided about others stays; None: all that the
            diagnosis names.
        progress: told the stage and the fraction done; raise `Cancelled` in it to stop.

    Raises:
        ResultsError: no diagnosis of these recordings is kept, or nothing in it can be accepted.
        FitError: a cause is not found again.
    """
    figures, made_from = _diagnosis(job)
    held, refused = _decided(figures, job.results)
    if only is None:
        chosen = replace(figures, effects=tuple(names_of(figures)) or figures.effects)
    else:
        _split(_only(figures, only, job.results), job.results)  # something of what is meant can be accepted
        chosen = _only(figures, held | set(only), job.results)
    still = refused - {(effect.id, effect.target) for effect in chosen.effects}
    wanted = Wanted(chosen, made_from, _causes(_only(figures, still, job.results).effects))
    return _accepted(job, wanted, by, progress)


def _accepted(job: Job, wanted: Wanted, by: str, progress: Progress) -> Accepted:
    """Accept these causes, and none else."""
    figures = wanted.figures
    causes, exchanges, left_out = _split(figures, job.results)
    record = partial(
        extension_log.accept,
        job.results,
        by=by,
        made_from=wanted.made_from,
        left_out=left_out,
        rejected=wanted.refused,
    )
    if not causes:
        labels_alone = Extension((), np.zeros(0), np.zeros(0), exchanges=exchanges)
        record(labels_alone)
        return Accepted(labels_alone, by, AcceptedGain((), told_exchanges(exchanges)), left_out)
    ranges = {(e.id, e.target): [Range(*r) for r in e.frames] for e in figures.effects}
    found = extension_for(
        job.subject,
        job.settings,
        {(cause.id, cause.target): ranges[cause.id, cause.target] for cause in causes},
        trials=figures.trials,
        reviews=job.reviews,
        progress=part(progress, 0.0, FOUND),
    )
    gain = extended_fit(found.fit, found.extension, job.settings, part(progress, FOUND, 1.0))
    told = accepted_gain(gain, found.causes_at(gain.fit.extra), exchanges)
    extension = replace(found.extension, exchanges=exchanges)
    decision = record(extension)
    kept_in = keep_gain(told, decision, job.results)
    return Accepted(extension, by, told, left_out, found.undone, found.flagged, kept_in)


def rejected(
    job: Job,
    *,
    by: str,
    only: Collection[tuple[str, str]] | None = None,
    progress: Progress = silent,
) -> Decision:
    """Reject causes of the last diagnosis: later fits use the recorded forces alone, or with what else holds.

    Args:
        job: opened without what was accepted before.
        by: who decides.
        only: id and target of the causes meant, what was decided about others stays; None: all that the
            diagnosis names. Where others stay accepted beside one that no longer is, those are fitted anew.
        progress: told the stage and the fraction done; raise `Cancelled` in it to stop.

    Raises:
        ResultsError: there is nothing to reject.
        FitError: a cause that stays accepted is not found again.
    """
    check_place(job.results)
    found, accepted_before = kept(job.results), extension_log.accepted(job.results)
    if found is None and (accepted_before is None or only is not None):
        raise ResultsError(f"{job.results}: nothing to reject; no diagnosis is kept here.")
    if only is None or found is None:
        causes = accepted_before[1].named if accepted_before else ()
        known = {(cause.id, cause.target) for cause in causes}
        causes += tuple(
            c for c in _causes(found[0].effects if found else ()) if (c.id, c.target) not in known
        )
        return _rejected(job, causes, by)
    figures = found[0]
    _only(figures, only, job.results)  # it names them
    held, refused = _decided(figures, job.results)
    causes = _causes(_only(figures, refused | set(only), job.results).effects)
    stay = held - set(only)
    if not stay:
        return _rejected(job, causes, by)
    if stay == held:
        return extension_log.reject_beside(job.results, causes, by=by)
    figures, made_from = _diagnosis(job)
    _accepted(job, Wanted(_only(figures, stay, job.results), made_from, causes), by, progress)
    return extension_log.decisions(job.results)[-1]


def _rejected(job: Job, causes: tuple[Cause, ...], by: str) -> Decision:
    made_from = without_reviews(provenance_of(job.subject, job.subject.trials))
    return extension_log.reject(job.results, causes, by=by, made_from=made_from)


def _decided(figures: DiagnosisReport, results: Path) -> tuple[set[tuple[str, str]], set[tuple[str, str]]]:
    """Of the causes that a diagnosis names: those that are accepted, and those that are rejected."""
    made = extension_log.decisions(results)
    standing = made[-1].standing if made else {}
    named = {(effect.id, effect.target) for effect in figures.effects}
    of = {kind: {key for key in named if standing.get(key) == kind} for kind in (ACCEPT, REJECT)}
    return of[ACCEPT], of[REJECT]


def _diagnosis(job: Job) -> tuple[DiagnosisReport, dict[str, str]]:
    """The last diagnosis and the provenance of its recordings, if both are still those of the folder."""
    check_place(job.results)
    found = kept(job.results)
    if found is None:
        raise ResultsError(f"{job.results}: no diagnosis is kept here. Run: addb-viewer diagnose")
    figures, made_from = found
    of_trials = [t for t in job.subject.trials if t.name in figures.trials]
    now = provenance_of(job.subject, of_trials)
    changed = other_recordings(made_from["provenance"], now)
    if made_from["settings"] != as_dict(job.settings):
        changed.append("the settings")
    if changed:
        raise ResultsError(
            f"{job.results}: since the diagnosis these have changed: {', '.join(changed)}. "
            "Run: addb-viewer diagnose"
        )
    return figures, now


def _only(figures: DiagnosisReport, wanted: Collection[tuple[str, str]], results: Path) -> DiagnosisReport:
    """The diagnosis with these causes alone."""
    named = [(effect.id, effect.target) for effect in figures.effects]
    for cause in wanted:
        if cause not in named:
            listed = ", ".join(f"{id} ({target})" for id, target in named) or "none"
            raise ResultsError(
                f"{results}: the last diagnosis does not name {cause[0]} ({cause[1]}). It names: {listed}."
            )
    effects = [effect for effect in figures.effects if (effect.id, effect.target) in wanted]
    return replace(figures, effects=tuple(effects))


def _split(
    figures: DiagnosisReport, results: Path
) -> tuple[tuple[Cause, ...], tuple[Exchange, ...], tuple[str, ...]]:
    """Causes that act as a wrench; labels that are exchanged; and what cannot be accepted, in words."""
    causes, exchanges = _causes(figures.effects), exchanges_of(figures)
    wrenches = tuple(cause for cause in causes if cause.id not in MARKER_IDS)
    left_out = tuple(f"{cause.id} ({cause.target})" for cause in causes if cannot_be_accepted(cause.id))
    if not wrenches and not exchanges:
        why = "its causes lie in the markers alone; correct the markers" if left_out else "it names no cause"
        raise ResultsError(f"{results}: nothing in the diagnosis can be accepted: {why}.")
    return wrenches, exchanges, left_out


def _causes(effects: Sequence[Named]) -> tuple[Cause, ...]:
    number = extension_log.nan_where_unknown
    return tuple(
        Cause(e.id, e.target, {n: (number(p.value), number(p.std)) for n, p in e.parameters.items()})
        for e in effects
    )
