"""Diagnose a subject and keep the answer; find one that still holds."""

from dataclasses import replace
from json import dumps, loads
from pathlib import Path

from addb_viewer.jobs.kept_diagnosis import keep, kept
from addb_viewer.jobs.solving import Job
from solver.common.errors import ResultsError
from solver.common.progress import Progress, silent
from solver.diagnosis.diagnose_subject import diagnose as diagnosis_of
from solver.diagnosis.diagnosis_report import DiagnosisReport, report
from solver.fitting.provenance import provenance_of
from solver.fitting.results.store import check_place
from solver.fitting.settings import as_dict


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
    read = [t for t in chosen if t.name in found.trials]
    if len(read) < len(chosen):  # the others cannot be read
        made_from["provenance"] = provenance_of(job.subject, read, job.reviews)
    return figures, keep(figures, made_from, job.results)


def kept_of(job: Job) -> DiagnosisReport | None:
    """The kept diagnosis where it is still that of these files, flags, settings and versions."""
    try:
        found = kept(job.results)
    except ResultsError:  # damaged, or of another version: it is made anew
        return None
    if found is None:
        return None
    figures, made_from = found
    chosen = [t for t in job.subject.trials if job.trials is None or t.name in job.trials]
    now = {
        "provenance": provenance_of(job.subject, chosen, job.reviews),
        "settings": as_dict(job.settings),
    }
    return figures if made_from == loads(dumps(now)) else None
