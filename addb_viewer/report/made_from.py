"""What a fit is made of: person, trials, plates; and versions, files, settings, commands to make it again."""

import html
import math
import re

import numpy as np

from addb_viewer.report.markup import Safe, element, joined, pairs, table
from addb_viewer.text.amounts import TO_95, kilograms
from addb_viewer.trial_view.drawn_curves import SMALLEST_N
from addb_viewer.trial_view.recorded_subject import Recording, TrialRecord
from addb_viewer.trial_view.replay import PlateReplay
from solver.capture.capture import Subject
from solver.dynamics.dynamics import MassStd
from solver.fitting.fit_result import Fit
from solver.fitting.settings import Settings, as_dict, as_toml, by_name, from_dict

HASH = re.compile(r"[0-9a-f]{64}")
OF = "sha256 "


def recorded(recording: Recording) -> Safe:
    """The person, the model and a row for each trial."""
    fit = recording.fit
    model = fit.subject.model.name if fit.subject.model else "the program's default full body"
    person = [
        *person_rows(fit),
        ("Model", f"{model}: {len(fit.skeleton.bodies)} bodies, {len(fit.skeleton.dofs)} degrees of freedom"),
        *([("Segments", segment_masses(fit, fit.mass_std))] if fit.mass_std else []),
    ]
    head = ("Trial", "Length", "Markers", "Seen", "Force plates, how long loaded", "Files")
    return joined((pairs(person), table(head, [_row(record, fit.subject) for record in recording.trials])))


def person_rows(fit: Fit) -> list[tuple[str, str]]:
    """What is known of the person."""
    entered = fit.subject.mass_kg
    mass = f"{kilograms(fit.mass_kg, fit.mass_std.body_kg if fit.mass_std else None)} fitted"
    mass += "" if entered is None else f" ({entered:.1f} kg entered)"
    height = f"{fit.height_m:.2f} m" + ("" if fit.subject.height_m is not None else " (not entered)")
    known = (("Mass", mass, fit.mass_kg), ("Height", height, fit.height_m))
    rows = [(name, words if math.isfinite(value) else "unknown") for name, words, value in known]
    return [*rows, *_told(fit.subject)]


def segment_masses(fit: Fit, off: MassStd) -> str:
    """Whose mass this recording told, to within what; the band of all others is as wide as that of tables."""
    told = {}
    for body, *std in zip(fit.skeleton.bodies, off.segments_kg, off.untold_kg, strict=True):
        known, without = (f"{100 * TO_95 * of / body.mass:.0f}" for of in std)
        if known != without:
            name = re.sub(r"_[rl]$", "", body.name)
            told[name] = f"{name} {body.mass:.1f} kg ± {known} % (by tables {without} %)"
    others = "masses of other segments" if told else "masses of segments"
    return "; ".join([*told.values(), f"{others} are not told by this recording"])


def _told(subject: Subject) -> list[tuple[str, str]]:
    rows = [
        ("Sex", subject.sex),
        ("Age", None if subject.age_years is None else f"{subject.age_years:g} years"),
    ]
    return [(label, value) for label, value in rows if value]


def _row(record: TrialRecord, subject: Subject) -> list[str]:
    replay = record.replay
    seen = np.isfinite(replay.markers.measured).all(axis=2).mean() if replay.markers.names else 0.0
    plates = ", ".join(f"{plate.name} {_loaded_s(plate, replay.rate):.1f} s" for plate in replay.plates)
    files = next(trial for trial in subject.trials if trial.name == replay.name)
    names = [files.markers.name, *([files.forces.name] if files.forces else [])]
    return [
        replay.name,
        f"{replay.frames} frames, {replay.frames / replay.rate:.2f} s at {replay.rate:g} Hz",
        str(len(replay.markers.names)),
        f"{100 * seen:.1f} %",
        plates or "none",
        ", ".join(names),
    ]


def _loaded_s(plate: PlateReplay, rate: float) -> float:
    with np.errstate(invalid="ignore"):
        loaded = np.isfinite(plate.cop).all(axis=1) & (np.linalg.norm(plate.force, axis=1) >= SMALLEST_N)
    return float(loaded.sum() / rate)


def repeat_part(recording: Recording) -> Safe:
    """Versions, input files by their hashes, settings that differ from the defaults, all settings."""
    fit = recording.fit
    settings = from_dict(fit.settings)
    hashes = {k: v for k, v in fit.provenance.items() if HASH.fullmatch(v)}
    rest = {k: v for k, v in fit.provenance.items() if k not in hashes}
    changed = differing(settings)
    version = fit.provenance.get("addb-viewer", "")
    said = (
        f"These settings differ from the defaults of addb-viewer {version}:"
        if changed
        else f"All settings have the defaults of addb-viewer {version}."
    )
    pieces = [
        element("p", "With the same files, versions and settings, these commands give the same figures:"),
        element("pre", "addb-viewer fit SUBJECT\naddb-viewer report SUBJECT"),
        pairs((k.replace("_", " "), _readable(v)) for k, v in rest.items()),
        table(
            ("Input", "SHA-256"),
            [(k.removeprefix(OF), element("code", v)) for k, v in hashes.items()],
            "hashes",
        ),
        element("p", said),
    ]
    if changed:
        pieces.append(table(("Setting", "Here", "Default"), changed))
    pieces.append(
        element(
            "details",
            element("summary", "All settings, as a settings.toml"),
            element("pre", Safe(html.escape(as_toml(settings)))),
        )
    )
    return joined(pieces)


def _readable(value: str) -> str:
    return "not given" if value == "None" else value.strip("()").replace("'", "")


def differing(settings: Settings) -> list[tuple[str, str, str]]:
    """Name, value and default of each setting that is not at its default."""
    usual = by_name(as_dict(Settings()))
    here = by_name(as_dict(settings))
    return [(name, str(value), str(usual[name])) for name, value in here.items() if value != usual[name]]
