"""`addb-viewer detect`: on which frames a force is missing or wrong, and why that is thought."""

import sys
from typing import Any

import typer
from rich import box
from rich.console import Console
from rich.table import Table

from addb_viewer.commands.options import Debug, JsonFile, SettingsFile, SubjectFolder, Trials
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.solving import job_for, judged
from addb_viewer.jobs.terminal_progress import terminal_progress
from addb_viewer.text.evidence_words import evidence_words
from annotations.wording import sure_words
from solver.contact.detection import detect as proposals_for
from solver.contact.detection_settings import DetectionSettings
from solver.contact.proposals import missing_force
from solver.fitting.fit import Fit, TrialFit
from solver.fitting.results.store import write_json

WIDTH_OF_A_PIPE = 250  # [characters] where no terminal says how wide it is


def detect(
    subject: SubjectFolder,
    trial: Trials = None,
    settings: SettingsFile = None,
    json: JsonFile = None,
    debug: Debug = False,
) -> None:
    """List the frames whose force is missing or wrong: which foot's, why, and how sure that is."""
    if json is not None and not json.absolute().parent.is_dir():
        raise typer.BadParameter(f"no folder {json.parent} to write into", param_hint="--json")
    with errors_as_lines(debug):
        job = job_for(subject, trials=trial, settings_file=settings)
        with terminal_progress() as progress:
            fit = judged(job, progress)
        figures = [_figures(t, fit, job.settings.detection) for t in fit.trials]
        if json is not None:
            write_json(json, {"trials": figures})
        for figure in figures:
            _print(figure)


def _figures(trial: TrialFit, fit: Fit, settings: DetectionSettings) -> dict[str, Any]:
    """In the shape of `detect --json`."""
    feet = trial.contacts.foot_bodies if trial.contacts else fit.subject.foot_bodies
    # a fit has nothing to judge there
    without_plates = trial.contacts is None or not trial.contacts.has_plates
    proposals = trial.proposals
    if without_plates:
        proposals = proposals_for(fit.skeleton, trial.motion, None, (), settings=settings)
    missing = missing_force(proposals, feet, trial.motion.frames, settings.confidence)
    return {
        "name": trial.capture.name,
        "frames": trial.motion.frames,
        "missing": [
            {
                "range": list(p.range),
                "foot": p.foot,
                "reason": p.reason,
                "confidence": p.confidence,
                "evidence": p.evidence,
            }
            for p in proposals
        ],
        "mask": missing.any(axis=1).tolist(),
    }


def _print(figures: dict[str, Any]) -> None:
    lost = sum(figures["mask"])
    typer.echo(f"{figures['name']}: force is missing on {lost} of {figures['frames']} frames")
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for head in ("frames", "foot", "reason", "sure", "because"):
        table.add_column(head, no_wrap=True)
    for proposal in figures["missing"]:
        start, end = proposal["range"]
        sure, numbers = sure_words(proposal["confidence"]), evidence_words(proposal["evidence"])
        table.add_row(f"{start}:{end}", proposal["foot"] or "all", proposal["reason"], sure, numbers)
    if table.row_count:
        Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH_OF_A_PIPE).print(table)
