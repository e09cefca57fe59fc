"""Diagnose a subject and keep the answer; find one that still holds."""

import contextlib
import hashlib
from collections.abc import Mapping
from dataclasses import replace
from json import dumps, loads
from pathlib import Path

from addb_viewer.jobs.kept_diagnosis import keep, kept
from addb_viewer.jobs.solving import Job
from solver.common.errors import ResultsError, SolverError
from solver.common.progress import Progress, silent
from solver.contact.detected_ranges import sure_ranges
from solver.contact.force_review import ForceReview
from solver.contact.mask import mask_of
from solver.contact.wrenches import RECORDING, FrameMask
from solver.diagnosis.deciding.deciding_trial import NOTHING, SURE
from solver.diagnosis.diagnose_subject import diagnose as diagnosis_of
from solver.diagnosis.diagnosis import CLEAN, AfterTrial
from solver.diagnosis.diagnosis_report import DiagnosisReport, report
from solver.fitting.provenance import provenance_of
from solver.fitting.results.kept_trials import kept_trials
from solver.fitting.results.store import check_place
from solver.fitting.settings import as_dict

COUNTS = "counts"  # in what a kept diagnosis was made from: by trial, SHA-256 of which forces count


def counts_of(masks: Mapping[str, FrameMask]) -> dict[str, str]:
    """By trial, SHA-256 of which forces count.

    Args:
        masks: of trials that have forces.
    """
    return {name: hashlib.sha256(mask.counts.tobytes()).hexdigest() for name, mask in masks.items()}


def _counts_now(job: Job) -> dict[str, str]:
    """Which forces count by the present flags, as far as a kept fit tells what detection leaves out."""
    least, masks = job.settings.detection.confidence, {}
    for name, kept_trial in kept_trials(job.results).items():
        mask, said = kept_trial.mask, (job.reviews or {}).get(name, ForceReview())
        if mask is not None:
            gaps = tuple(gap for k, gap in enumerate(mask.reasons) if mask.source_of(k) == RECORDING)
            sure = sure_ranges(kept_trial.proposals, least)
            masks[name] = mask_of(kept_trial.feet, len(mask.counts), gaps, said, sure)
    return counts_of(masks)


def diagnosed(job: Job, progress: Progress = silent, why: str | None = None) -> tuple[DiagnosisReport, Path]:
    """Diagnose and keep the answer; its figures and its file."""
    check_place(job.results)
    chosen = [t for t in job.subject.trials if job.trials is None or t.name in job.trials]
    made_from = {
        "provenance": provenance_of(job.subject, chosen, job.reviews),
        "settings": as_dict(job.settings),
    }
    found = diagnosis_of(job.subject, job.settings, trials=job.trials, reviews=job.reviews, progress=progress)
    notes = tuple(dict.fromkeys([*job.subject.notes, *found.notes]))
    figures = replace(report(found, why), notes=notes)
    figures = replace(figures, after_trial=after_trial(_last(job), figures))
    read = [t for t in chosen if t.name in found.trials]
    if len(read) < len(chosen):  # the others cannot be read
        made_from["provenance"] = provenance_of(job.subject, read, job.reviews)
    with contextlib.suppress(
        SolverError
    ):  # without a fit that can be read, the flags themselves have to be the same
        made_from[COUNTS] = _counts_now(job)
    return figures, keep(figures, made_from, job.results)


def _last(job: Job) -> DiagnosisReport | None:
    """The diagnosis before this one, where it can be read."""
    with contextlib.suppress(ResultsError):
        last = kept(job.results)
        return None if last is None else last[0]
    return None


def after_trial(before: DiagnosisReport | None, now: DiagnosisReport) -> AfterTrial | None:
    """Whether trials that were recorded since, or a scale, decided what was not sure; None where none were.

    Args:
        before: the last diagnosis.
        now: of the same trials and others.
    """
    if before is None:
        return None
    weighed = before.scale_factor is None and now.scale_factor is not None
    if before.trials == now.trials and not weighed:
        return before.after_trial
    asked, more = before.to_be_sure, tuple(t for t in now.trials if t not in before.trials)
    if asked is None or not (more or weighed) or not set(before.trials) <= set(now.trials):
        return None
    sure = {(c.id, c.target): c.confidence for c in now.effects}
    confidence = sure.get((asked.id, asked.target), 0.0)
    rival = sure.get((asked.other_id, asked.other_target), 0.0)
    is_nothing = asked.other_id == NOTHING and now.verdict == CLEAN
    return AfterTrial(asked, more, max(confidence, rival) >= SURE or is_nothing, confidence)


def kept_of(job: Job) -> DiagnosisReport | None:
    """The kept diagnosis where it is still that of these files, flags, settings and versions."""
    try:
        found = kept(job.results)
    except ResultsError:  # damaged, or of another version: it is made anew
        return None
    if found is None:
        return None
    figures, made_from = found
    made_from.pop(COUNTS, None)
    chosen = [t for t in job.subject.trials if job.trials is None or t.name in job.trials]
    now = {
        "provenance": provenance_of(job.subject, chosen, job.reviews),
        "settings": as_dict(job.settings),
    }
    return figures if made_from == loads(dumps(now)) else None
