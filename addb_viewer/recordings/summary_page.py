"""A trial's figures and the colours of its scene as a page of Markdown."""

from collections.abc import Mapping
from typing import Any

from addb_viewer.change_words import change_in_short
from addb_viewer.diagnosis_vocabulary import title
from addb_viewer.recordings.recording import Recording, TrialRecord


def summary_page(record: TrialRecord, recording: Recording) -> str:
    """The trial's figures, and how to read the recording, as Markdown."""
    f, fit = record.figures, recording.fit
    force, moment, alone = f["linear_residual"], f["angular_residual"], f["kinematics_only"]
    rows = [
        ("frames used", f"{f['frames_with_force_used']} of {f['frames']}", "decided by " + f["mask_source"]),
        ("marker RMS", _cm(f["marker_rms_m"]), _verdict(f, "marker_rms", "2 cm")),
        ("largest marker error", _cm(f["marker_max_m"]), _verdict(f, "marker_max", "4 cm")),
        (
            "residual force, RMS",
            _rms(force, "rms_N", "N", "rms_BW", "BW"),
            _verdict(f, "linear", "0.05 BW"),
        ),
        (
            "residual moment, RMS",
            _rms(moment, "rms_Nm", "N·m", "rms_BWh", "BW·h"),
            _verdict(f, "angular", "0.01 BW·h"),
        ),
    ]
    if f.get("forces_foretold"):
        rows.append(("forces and torques", "predicted from the motion", "no measurement confirms them"))
    if alone is not None:
        rows.append(("marker RMS of the markers alone", _cm(alone["marker_rms_m"]), "before forces counted"))
    if changed := change_in_short(f.get("change")):
        rows.append(("joints moved by the fit to forces", changed, "no error by itself"))
    person = f"{fit.mass_kg:.1f} kg, {fit.height_m:.2f} m"
    table = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    compared = f" Sky blue: *{record.before_name}*." if record.before is not None else ""
    return (
        f"**{recording.subject}, {record.replay.name}**: {person}, {f['rate_hz']:.0f} Hz.\n\n"
        f"| figure | value | bound |\n|---|---|---|\n{table}\n\n"
        "Residuals: what the motion demands less what was measured, over the frames used; the moment is "
        "about the root joint's centre, in the ground frame.\n\n"
        "**Scene.** Markers from blue (no error) over orange to vermilion (4 cm); forces 1 m for 1000 N, "
        f"right foot green, left purple, of no foot orange; pale: demanded but not measured.{compared}\n"
        f"{_diagnosis(recording.diagnosis)}"
    )


def _diagnosis(diagnosis: Mapping[str, Any] | None) -> str:
    if diagnosis is None:
        return ""
    named = "".join(f"- {title(effect)}\n" for effect in diagnosis["effects"])
    return f"\n**Diagnosis:** {diagnosis['verdict']}\n\n{named}"


def _cm(length_m: float | None) -> str:
    return "not computed" if length_m is None else f"{100 * length_m:.2f} cm"


def _verdict(figures: Mapping[str, Any], name: str, bound: str) -> str:
    within = figures["hicks"][name]
    return "" if within is None else f"{'within' if within else 'BEYOND'} {bound}"


def _rms(figures: Mapping[str, float] | None, name: str, unit: str, scaled: str, of: str) -> str:
    return "not computed" if figures is None else f"{figures[name]:.1f} {unit} = {figures[scaled]:.4f} {of}"
