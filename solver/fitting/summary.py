"""A fit's figures as the command line's JSON states them: SI units, ranges end before their second number."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.formats.b3d.stored import StoredPass
from solver.common.gravity import GRAVITY
from solver.common.notes import Kind, Note
from solver.common.true_runs import runs
from solver.dynamics.cross_validation.held_out import HeldOutBlocks
from solver.dynamics.cross_validation.held_out_figures import AgainstMarkers, against_markers
from solver.dynamics.cross_validation.held_out_layouts import BLOCKS, LAYOUTS, STEPS
from solver.dynamics.motion_change import BANDS_HZ, BandGain, CoordinateChange, motion_change
from solver.dynamics.thresholds import Figures, Thresholds, verdicts
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.seen_part import guessed, seen_part
from solver.kinematics.label_faults.fault import LabelFault
from solver.kinematics.marker_errors import MarkerErrors
from solver.skeleton.skeleton import Skeleton

HELD_OUT_DUE = Note(Kind.OTHER, "the held-out blocks have not been predicted yet for the present flags")

Numbers = dict[str, float | None]


def summary(fit: Fit, files: Sequence[str] = ()) -> dict[str, object]:
    """The figures of a fit in the shape of `fit --json`; what was not computed is None.

    Args:
        fit: the solved subject.
        files: names of the files that hold it.
    """
    body_weight = fit.mass_kg * GRAVITY
    return {
        "subject": {
            "mass_kg": _number(fit.mass_kg),
            "mass_entered_kg": fit.subject.mass_kg,
            "height_m": _number(fit.height_m),
        },
        "model": {"bodies": len(fit.skeleton.bodies), "dofs": len(fit.skeleton.dofs)},
        "trials": [
            {
                **_trial(trial, fit.skeleton, body_weight, fit.height_m),
                "held_out_layouts": _held_out_layouts(fit, trial.capture.name),
            }
            for trial in fit.trials
        ],
        "files": list(files),
        "notes": [note.as_json() for note in all_notes(fit)],
        "unused": [{"file": file.file, "reason": file.reason} for file in fit.unused],
    }


def all_notes(fit: Fit) -> tuple[Note, ...]:
    """What the fit assumed or ignored, the subject's first; a trial's carry its name. None twice."""
    notes = [*fit.subject.notes, *fit.skeleton.notes, *fit.notes]
    for trial in fit.trials:
        contacts = trial.contacts.notes if trial.contacts else ()
        for note in (*trial.capture.notes, *contacts, *trial.notes):
            notes.append(note.in_trial(trial.capture.name))
    if fit.held_out_due:
        notes.append(HELD_OUT_DUE)
    return tuple(dict.fromkeys(notes))


def linear_figures(residual: Float[np.ndarray, "frames 3"], body_weight: float) -> Numbers:
    """RMS [N], mean norm [N] and RMS in body weights of residual forces [N]."""
    rms, mean = _rms_and_mean_norm(residual)
    return {"rms_N": _number(rms), "mean_norm_N": _number(mean), "rms_BW": _number(rms / body_weight)}


def angular_figures(residual: Float[np.ndarray, "frames 3"], body_weight: float, height: float) -> Numbers:
    """RMS [N·m], mean norm [N·m] and RMS in body weight · height of residual moments [N·m]."""
    rms, mean = _rms_and_mean_norm(residual)
    scaled = rms / (body_weight * height)
    return {"rms_Nm": _number(rms), "mean_norm_Nm": _number(mean), "rms_BWh": _number(scaled)}


def _trial(trial: TrialFit, skeleton: Skeleton, body_weight: float, height: float) -> dict[str, object]:
    used = trial.dynamics.used if trial.dynamics else np.zeros(trial.motion.frames, dtype=bool)
    figures = {**_marker_figures(trial.marker_errors), **_residual_figures(trial, body_weight, height)}
    return {
        "name": trial.capture.name,
        "frames": trial.motion.frames,
        "rate_hz": _number(trial.motion.rate),
        "frames_with_force_used": int(used.sum()),
        "frames_used_ranges": [list(run) for run in runs(used)],
        "frames_without_pose_ranges": [list(run) for run in runs(~trial.motion.posed)],
        "coordinates_guessed_ranges": _guessed_ranges(trial),
        "mask_source": trial.mask.source if trial.mask else "none",
        **figures,
        "label_faults": [_label_fault(fault) for fault in trial.label_faults],
        "torques_predicted_ranges": _predicted_ranges(trial),
        "forces_predicted": trial.forces_predicted,
        "hicks": verdicts(_judged(figures), Thresholds()),
        "held_out": _held_out(trial, body_weight, height),
        "kinematics_only": _kinematics_only(trial),
        "change": _change(trial, skeleton),
        "stored": [_stored(found, used) for found in trial.capture.stored],
        "seconds": {stage: _number(seconds) for stage, seconds in trial.seconds.items()},
    }


def _guessed_ranges(trial: TrialFit) -> dict[str, list[list[int]]]:
    """By coordinate, where markers that would show it are out of view for long; there it has no value."""
    there = guessed(trial) & trial.motion.posed[:, None]
    named = zip(trial.motion.dofs, there.T, strict=True)
    return {dof: [list(run) for run in runs(frames)] for dof, frames in named if frames.any()}


def _label_fault(fault: LabelFault) -> dict[str, object]:
    """What was repaired in the labels before the fit; distances are None where a person said it."""
    return {
        "labels": list(fault.labels),
        "frames": [fault.start, fault.end],
        "done": fault.done,
        "frames_with_markers": fault.frames,
        "onto": fault.onto,
        "off_m": fault.off_m,
        "repaired_off_m": fault.repaired_off_m,
        "neighbours": fault.neighbours,
        "accepted": fault.accepted,
    }


def _stored(found: StoredPass, used: Bool[np.ndarray, " frames"]) -> dict[str, object]:
    """What the recording's own file says of a pass, on the frames of the fit's own figures."""

    def rms(series: Float[np.ndarray, " frames"]) -> float | None:
        known = series[used & np.isfinite(series)]
        return _number(np.sqrt(np.mean(known**2))) if len(known) else None

    return {
        "pass": found.kind,
        "marker_rms_m": rms(found.marker_rms_m),
        "force_rms_N": rms(found.force_N),
        "moment_rms_Nm": rms(found.moment_Nm),
        "notes": list(found.notes),
    }


def _predicted_ranges(trial: TrialFit) -> list[list[int]]:
    """Frames whose torques rest on a foot's wrench that was not measured but predicted from the motion."""
    predicted = trial.dynamics.wrench_is_predicted if trial.dynamics else None
    return [] if predicted is None else [list(run) for run in runs(np.any(predicted, axis=1))]


def _held_out(trial: TrialFit, body_weight: float, height: float) -> dict[str, object] | None:
    """Residuals on held-out blocks, beside those of the fit's and the markers' motion on the same frames.

    Without `markers_cutoff_hz`, which older versions did not write, the markers' figures are those at the
    forces' own cut-off: no fair comparison.
    """
    held_out = trial.held_out
    if held_out is None or not held_out.frames.any():
        return None
    figures: dict[str, object] = {
        "frames": int(held_out.frames.sum()),
        "learnt": list(held_out.learnt),
        "markers_cutoff_hz": list(held_out.markers_hz) if held_out.markers_hz else None,
    }
    motion_only = held_out.residual_root if held_out.motion_only_root is None else held_out.motion_only_root
    for prefix, residual in (
        ("", held_out.residual_root),
        ("motion_only_", motion_only),
        ("kinematics_only_", held_out.kinematics_only_root),
    ):
        counted = residual[held_out.frames]
        figures[f"{prefix}linear_residual"] = linear_figures(counted[:, :3], body_weight)
        figures[f"{prefix}angular_residual"] = angular_figures(counted[:, 3:], body_weight, height)
    return figures


def _held_out_layouts(fit: Fit, name: str) -> dict[str, object] | None:
    """All layouts of a trial so far: blocks and whole steps; None before the first one."""
    if not fit.held_out_layouts:
        return None
    figures: dict[str, object] = {"layouts": len(fit.held_out_layouts), "of": len(LAYOUTS)}
    for kind in (BLOCKS, STEPS):
        layouts = [layout.trials.get(name) for layout in fit.held_out_layouts if layout.kind == kind]
        figures[kind] = _of_layouts([blocks for blocks in layouts if blocks is not None])
    return figures


def _of_layouts(blocks: Sequence[HeldOutBlocks]) -> dict[str, object] | None:
    if not blocks:
        return None
    force, moment = against_markers(blocks)
    seen = {i for b in blocks for start, end in b.ranges for i in range(start, end)}
    return {
        "layouts": len(blocks),
        "pieces": sum(len(b.frames) for b in blocks),
        "frames": len(seen),
        "force": _against_markers(force),
        "moment": _against_markers(moment),
    }


def _against_markers(found: AgainstMarkers) -> dict[str, object]:
    """RMS [N or N·m] missed by fit and markers, and their ratio with its 90 % interval over blocks."""
    return {
        "rms": _number(found.fit),
        "markers_rms": _number(found.markers),
        "markers_cutoffs_hz": list(found.cutoffs_hz),
        "ratio": _number(found.ratio),
        "ratio_90": list(found.interval) if found.interval else None,
    }


def _kinematics_only(trial: TrialFit) -> Numbers | None:
    """Figures of the marker fit that the dynamics started from, and how far the angles moved since."""
    before = trial.kinematics_only
    if before is None:
        return None
    change = (trial.motion.q - before.motion.q)[trial.motion.posed]
    return {
        "marker_rms_m": _number(before.marker_errors.rms),
        "marker_max_m": _number(before.marker_errors.maximum),
        "change_rms_rad": _number(float(np.sqrt(np.mean(change**2)))),
    }


def _change(trial: TrialFit, skeleton: Skeleton) -> dict[str, object] | None:
    """What the fit to forces changed in the motion of the markers alone; in degrees, translations in mm."""
    part = seen_part(trial)
    if part.kinematics_only is None:
        return None
    change = motion_change(skeleton, part.motion, part.kinematics_only.motion)
    rms, offset, gain = change.joints_rms_rad, change.joints_offset_rad, change.joints_gain
    return {
        "limit_hz": change.limit_Hz,
        "bands_hz": [[low, _number(high)] for low, high in BANDS_HZ],
        "joints_rms_deg": None if rms is None else np.degrees(rms),
        "joints_offset_deg": None if offset is None else np.degrees(offset),
        "joints_gain": _gain(gain, np.degrees(1.0)),
        "coordinates": [_changed(coordinate) for coordinate in change.coordinates],
    }


def _changed(change: CoordinateChange) -> dict[str, object]:
    scale = float(np.degrees(1.0)) if change.turning else 1000.0

    def scaled(value: float | None) -> float | None:
        return None if value is None else scale * value

    return {
        "name": change.name,
        "unit": "deg" if change.turning else "mm",
        "root": change.root,
        "rms": scaled(change.rms),
        "offset": scaled(change.offset),
        "bands": [scaled(band) for band in change.bands],
        "gains": [_gain(gain, scale) for gain in change.gains],
        "range": scaled(change.range),
        "range_of_markers": scaled(change.range_of_markers),
        "peak_speed": scaled(change.peak_speed),
        "peak_speed_of_markers": scaled(change.peak_speed_of_markers),
    }


def _gain(gain: BandGain | None, scale: float) -> dict[str, object] | None:
    if gain is None:
        return None
    return {
        "band_hz": [gain.low_Hz, _number(gain.high_Hz)],
        "gain": gain.gain,
        "phase_deg": float(np.degrees(gain.phase_rad)),
        "content": scale * gain.content,
    }


def _marker_figures(errors: MarkerErrors) -> Numbers:
    if not np.isfinite(errors.distance).any():
        return {"marker_rms_m": None, "marker_rms_frame_mean_m": None, "marker_max_m": None}
    return {
        "marker_rms_m": _number(errors.rms),
        "marker_rms_frame_mean_m": _number(errors.rms_frame_mean),
        "marker_max_m": _number(errors.maximum),
    }


def _residual_figures(trial: TrialFit, body_weight: float, height: float) -> dict[str, Numbers | None]:
    names = ("linear_residual", "angular_residual", "linear_residual_raw", "angular_residual_raw")
    if trial.dynamics is None or not trial.dynamics.used.any():
        return dict.fromkeys(names)
    used = trial.dynamics.used
    filtered, raw = trial.dynamics.residual_root[used], trial.dynamics.residual_raw_root[used]
    figures = (
        linear_figures(filtered[:, :3], body_weight),
        angular_figures(filtered[:, 3:], body_weight, height),
        linear_figures(raw[:, :3], body_weight),
        angular_figures(raw[:, 3:], body_weight, height),
    )
    return dict(zip(names, figures, strict=True))


def _judged(figures: dict) -> Figures:
    """Those of a trial's figures that have a threshold."""
    return Figures(
        linear_BW=(figures["linear_residual"] or {}).get("rms_BW"),
        angular_BWh=(figures["angular_residual"] or {}).get("rms_BWh"),
        marker_rms_m=figures["marker_rms_m"],
        marker_max_m=figures["marker_max_m"],
    )


def _rms_and_mean_norm(vectors: Float[np.ndarray, "frames 3"]) -> tuple[float, float]:
    norms = np.linalg.norm(vectors, axis=1)
    return float(np.sqrt(np.mean(norms**2))), float(np.mean(norms))


def _number(value: float) -> float | None:
    """A plain float; None where it is not finite, because JSON has no NaN."""
    return float(value) if np.isfinite(value) else None
