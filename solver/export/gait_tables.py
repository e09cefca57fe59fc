"""Gait of all trials as tables, a row an event and a row a cycle, and as JSON."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import BinaryIO

import pyarrow as pa

from solver.capture.atomic import whole_file, write_whole
from solver.export.cycle_tables import fit_curves, mean_table
from solver.export.places import made
from solver.fitting.fit import Fit, TrialFit
from solver.fitting.settings import from_dict
from solver.gait.gait import Gait, gait_of
from solver.gait.settings import GAIT

FOLDER = "gait"  # of its own, where no trial's files are
Row = dict[str, str | float | None]
DEFINITIONS = {
    "event": "contact, foot-off: the foot's vertical force crosses 20 N (source force), else its sole's slip "
    "over the surface crosses a share of the pace (source feet)",
    "stride_length_m": "this heel's way over the surface from contact to its next contact",
    "step_length_m": "how far this heel, as it ends the cycle, is ahead of the other's at its last contact",
    "step_width_m": "the same two heels, across the stride",
    "cadence_per_min": "120 / stride time: steps a minute",
    "speed_m_s": "stride length / stride time",
    "stance_share": "contact to foot-off, of the stride time",
    "source": "Perry & Burnfield 2010, Gait Analysis; Whittle 2007, Gait Analysis: an Introduction",
}


EVENT_COLUMNS = ("trial", "time_s", "foot", "event", "source")
CYCLE_COLUMNS = (
    *("trial", "foot", "contact_s", "foot_off_s", "next_contact_s"),
    *("stride_length_m", "step_length_m", "step_width_m", "cadence_per_min", "speed_m_s", "stance_share"),
)


def gaits_of(fit: Fit) -> dict[str, Gait]:
    """By trial, of those that show a stance."""
    found = {trial.capture.name: trial_gait(fit, trial) for trial in fit.trials}
    return {name: gait for name, gait in found.items() if gait is not None}


def trial_gait(fit: Fit, trial: TrialFit) -> Gait | None:
    """Of one trial; None where it shows no stance.

    Args:
        fit: of the subject.
        trial: of the fit.
    """
    if "conditioning" not in fit.settings:
        return None
    gait = gait_of(trial, fit.skeleton, GAIT, from_dict(fit.settings).conditioning)
    return gait if gait is not None and gait.events else None


def event_rows(gaits: dict[str, Gait]) -> list[Row]:
    """A row an event, trial by trial in order of time."""
    return [
        {
            "trial": name,
            "time_s": event.time_s,
            "foot": gait.feet[event.foot],
            "event": str(event.kind),
            "source": str(event.source),
        }
        for name, gait in gaits.items()
        for event in gait.events
    ]


def cycle_rows(gaits: dict[str, Gait]) -> list[Row]:
    """A row a cycle, trial by trial in order of time."""
    return [
        {
            "trial": name,
            "foot": gait.feet[cycle.foot],
            "contact_s": cycle.start_s,
            "foot_off_s": cycle.off_s,
            "next_contact_s": cycle.end_s,
            "stride_length_m": cycle.stride_length_m,
            "step_length_m": cycle.step_length_m,
            "step_width_m": cycle.step_width_m,
            "cadence_per_min": cycle.cadence_per_min,
            "speed_m_s": cycle.speed_m_s,
            "stance_share": cycle.stance_share,
        }
        for name, gait in gaits.items()
        for cycle in gait.cycles
    ]


def export_gait(
    fit: Fit, folder: Path, suffix: str, write: Callable[[pa.Table, BinaryIO], object]
) -> list[Path]:
    """Write gait/events, gait/cycles, gait/curves and gait/gait.json; nothing where no trial shows a stance.

    Raises:
        FitError, CaptureError: the folder cannot be made, or not written to.
    """
    gaits = gaits_of(fit)
    if not gaits:
        return []
    place, written = made(folder / FOLDER), []
    tables: Sequence[tuple[str, list[Row]]] = (("events", event_rows(gaits)), ("cycles", cycle_rows(gaits)))
    for name, rows in tables:
        if rows:
            path = place / f"{name}{suffix}"
            with whole_file(path) as file:
                write(pa.Table.from_pylist(rows), file)
            written.append(path)
    curves = fit_curves(fit, gaits)
    if curves:
        path = place / f"curves{suffix}"
        with whole_file(path) as file:
            write(mean_table(curves), file)
        written.append(path)
    path = place / "gait.json"
    content = {"definitions": DEFINITIONS, **dict(tables)}
    write_whole(path, json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n")
    return [*written, path]
