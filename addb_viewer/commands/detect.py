"""`addb-viewer detect`: on which frames a force is missing or wrong, and why that is thought."""

import sys
from typing import Any

import typer
from rich import box
from rich.console import Console
from rich.table import Table

from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.options import Debug, JsonFile, SettingsFile, SubjectFolder, Trials
from addb_viewer.commands.solving import job_for, judged
from solver.contact.detection import detect as proposals_for
from solver.contact.proposals import Proposal, missing_force
from solver.fit import TrialFit
from solver.results.store import write_json

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
        fit = judged(job)
        confidence = job.settings.detection.confidence
        figures = [_figures(t, _proposals(t), fit.subject.foot_bodies, confidence) for t in fit.trials]
        if json is not None:
            write_json(json, {"trials": figures})
        for figure in figures:
            _print(figure)


def _proposals(trial: TrialFit) -> tuple[Proposal, ...]:
    """Those of the fit; a trial without plates has none there, because nothing is left to decide."""
    if trial.contacts is not None:
        return trial.proposals
    return proposals_for(None, trial.motion, None, ())


def _figures(
    trial: TrialFit, proposals: tuple[Proposal, ...], foot_bodies: tuple[str, ...], confidence: float
) -> dict[str, Any]:
    feet = trial.contacts.foot_bodies if trial.contacts else foot_bodies
    missing = missing_force(proposals, feet, trial.motion.frames, confidence)
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
    typer.echo(f"{figures['name']}: {lost or 'no'} of {figures['frames']} frames miss force")
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for head in ("frames", "foot", "reason", "sure", "because"):
        table.add_column(head, no_wrap=True)
    for proposal in figures["missing"]:
        start, end = proposal["range"]
        numbers = ", ".join(f"{name} {value:.3g}" for name, value in proposal["evidence"].items())
        sure = f"{proposal['confidence']:.2f}"
        table.add_row(f"{start}:{end}", proposal["foot"] or "all", proposal["reason"], sure, numbers)
    if table.row_count:
        Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH_OF_A_PIPE).print(table)
