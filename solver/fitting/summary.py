"""The figures of a fit, computed from what was solved."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.formats.b3d.stored import StoredPass
from solver.common.gravity import GRAVITY
from solver.common.notes import Kind, Note
from solver.common.true_runs import runs
from solver.dynamics.cross_validation.held_out import HeldOutBlocks
from solver.dynamics.cross_validation.held_out_figures import AgainstMarkers, against_markers
from solver.dynamics.cross_validation.held_out_layouts import BLOCKS, STEPS
from solver.dynamics.motion_change import BANDS_HZ, BandGain, CoordinateChange, motion_change
from solver.dynamics.thresholds import verdicts
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.fit_summary import (
    ChangeFigures,
    CoordinateFigures,
    FitSummary,
    ForceFigures,
    GainFigures,
    HeldOutFigures,
    LabelFaultFigures,
    LayoutFigures,
    LayoutsFigures,
    MarkersAloneFigures,
    MissedFigures,
    ModelFigures,
    MomentFigures,
    NotUsed,
    PersonFigures,
    Span,
    StoredFigures,
    TrialFigures,
)
from solver.fitting.seen_part import guessed, seen_part, without_guesses
from solver.kinematics.frame_solver import root_dofs
from solver.kinematics.label_faults.fault import LabelFault
from solver.skeleton.skeleton import Skeleton

HELD_OUT_DUE = Note(Kind.OTHER, "held-out forces have not been predicted yet for the present flags")


def summary(fit: Fit, files: Sequence[str] = ()) -> FitSummary:
    """The figures of a fit.

    Args:
        fit: the solved subject.
        files: names of the files that hold it.
    """
    return FitSummary(
        subject=PersonFigures(
            _number(fit.mass_kg),
            fit.subject.mass_kg,
            _number(fit.height_m),
            _number(fit.mass_std.body_kg) if fit.mass_std else None,
        ),
        model=ModelFigures(len(fit.skeleton.bodies), len(fit.skeleton.dofs)),
        trials=tuple(_trial(trial, fit) for trial in fit.trials),
        files=tuple(files),
        notes=all_notes(fit),
        unused=tuple(NotUsed(file.file, file.reason) for file in fit.unused),
    )


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


def _trial(trial: TrialFit, fit: Fit) -> TrialFigures:
    used = trial.dynamics.used if trial.dynamics else np.zeros(trial.motion.frames, dtype=bool)
    person, errors = _Scale(fit.mass_kg * GRAVITY, fit.height_m), trial.marker_errors
    residuals: tuple[tuple[ForceFigures, MomentFigures] | tuple[None, None], ...] = ((None, None),) * 2
    if trial.dynamics is not None and used.any():
        of_fit, raw = trial.dynamics.residual_root, trial.dynamics.residual_raw_root
        residuals = person.residual(of_fit[used]), person.residual(raw[used])
    (linear, angular), (linear_raw, angular_raw) = residuals
    seen = np.isfinite(errors.distance).any()
    rms, largest = (_number(errors.rms), _number(errors.maximum)) if seen else (None, None)
    figures = TrialFigures(
        name=trial.capture.name,
        frames=trial.motion.frames,
        rate_hz=_number(trial.motion.rate),
        frames_with_force_used=int(used.sum()),
        frames_used_ranges=_spans(used),
        frames_without_pose_ranges=_spans(~trial.motion.posed),
        coordinates_guessed_ranges=_guessed_ranges(trial),
        mask_source=trial.mask.source if trial.mask else "none",
        marker_rms_m=rms,
        marker_rms_frame_mean_m=_number(errors.rms_frame_mean) if seen else None,
        marker_max_m=largest,
        linear_residual=linear,
        angular_residual=angular,
        linear_residual_raw=linear_raw,
        angular_residual_raw=angular_raw,
        label_faults=tuple(_label_fault(fault) for fault in trial.label_faults),
        torques_predicted_ranges=_predicted_ranges(trial),
        forces_predicted=trial.forces_predicted,
        hicks=verdicts(linear and linear.rms_BW, angular and angular.rms_BWh, rms, largest),
        held_out=_held_out(trial, person),
        kinematics_only=_markers_alone(trial),
        change=_change(trial, fit.skeleton),
        stored=tuple(_stored(found, used) for found in trial.capture.stored),
        seconds={stage: _number(seconds) for stage, seconds in trial.seconds.items()},
        held_out_layouts=_held_out_layouts(fit, trial.capture.name),
        marker_max_label=errors.names[int(errors.maximum_per_marker.argmax())] if seen else None,
        torque_std_Nm=_torque_std(trial, fit.skeleton, used),
    )
    return replace(figures, verdict=figures.judged())


@dataclass(frozen=True)
class _Scale:
    """What residuals are measured by."""

    body_weight: float  # [N]
    height: float  # [m]

    def residual(self, wrench: Float[np.ndarray, "frames 6"]) -> tuple[ForceFigures, MomentFigures]:
        """Of residual forces [N] and moments [N·m]."""
        rms, mean = _rms_and_mean_norm(wrench[:, :3])
        turning, mean_turning = _rms_and_mean_norm(wrench[:, 3:])
        return (
            ForceFigures(rms, mean, _number(rms / self.body_weight)),
            MomentFigures(turning, mean_turning, _number(turning / (self.body_weight * self.height))),
        )


def _spans(frames: Bool[np.ndarray, " frames"]) -> tuple[Span, ...]:
    return tuple((int(start), int(end)) for start, end in runs(frames))


def _guessed_ranges(trial: TrialFit) -> dict[str, tuple[Span, ...]]:
    """By coordinate, where markers that would show it are out of view for long; there it has no value."""
    there = guessed(trial) & trial.motion.posed[:, None]
    named = zip(trial.motion.dofs, there.T, strict=True)
    return {dof: _spans(frames) for dof, frames in named if frames.any()}


def _torque_std(trial: TrialFit, skeleton: Skeleton, used: Bool[np.ndarray, " frames"]) -> dict[str, float]:
    """Of every angle but the root's that has one on some frame that is used."""
    std, of_root, found = without_guesses(trial).std, root_dofs(skeleton), {}
    for i, coordinate in enumerate(skeleton.free_coordinates):
        of_one = std.torque[used, i] if std else np.empty(0)
        if coordinate.motion == "rotation" and not of_root[i] and np.isfinite(of_one).any():
            found[coordinate.name] = float(np.nanmedian(of_one))
    return found


def _label_fault(fault: LabelFault) -> LabelFaultFigures:
    return LabelFaultFigures(
        labels=tuple(fault.labels),
        frames=(fault.start, fault.end),
        done=fault.done,
        frames_with_markers=fault.frames,
        onto=fault.onto,
        off_m=fault.off_m,
        repaired_off_m=fault.repaired_off_m,
        neighbours=fault.neighbours,
        accepted=fault.accepted,
    )


def _stored(found: StoredPass, used: Bool[np.ndarray, " frames"]) -> StoredFigures:
    def rms(series: Float[np.ndarray, " frames"]) -> float | None:
        known = series[used & np.isfinite(series)]
        return _number(np.sqrt(np.mean(known**2))) if len(known) else None

    notes = tuple(map(str, found.notes))  # of which a file keeps the sentence alone
    return StoredFigures(found.kind, rms(found.marker_rms_m), rms(found.force_N), rms(found.moment_Nm), notes)


def _predicted_ranges(trial: TrialFit) -> tuple[Span, ...]:
    """Frames whose torques rest on a foot's wrench that was not measured but predicted from the motion."""
    predicted = trial.dynamics.wrench_is_predicted if trial.dynamics else None
    return () if predicted is None else _spans(np.any(predicted, axis=1))


def _held_out(trial: TrialFit, person: _Scale) -> HeldOutFigures | None:
    held_out = trial.held_out
    if held_out is None or not held_out.frames.any():
        return None
    motion_only = held_out.residual_root if held_out.motion_only_root is None else held_out.motion_only_root
    own, motion, markers = (
        person.residual(residual[held_out.frames])
        for residual in (held_out.residual_root, motion_only, held_out.kinematics_only_root)
    )
    return HeldOutFigures(
        int(held_out.frames.sum()), tuple(held_out.learnt), held_out.markers_hz, *own, *motion, *markers
    )


def _held_out_layouts(fit: Fit, name: str) -> LayoutsFigures | None:
    """None where the fit was not judged."""
    if not fit.held_out_layouts:
        return None

    def of(kind: str) -> LayoutFigures | None:
        layouts = [layout.trials.get(name) for layout in fit.held_out_layouts if layout.kind == kind]
        return _of_layouts([blocks for blocks in layouts if blocks is not None])

    return LayoutsFigures(of(BLOCKS), of(STEPS))


def _of_layouts(blocks: Sequence[HeldOutBlocks]) -> LayoutFigures | None:
    if not blocks:
        return None
    force, moment = against_markers(blocks)
    return LayoutFigures(
        layouts=len(blocks),
        pieces=sum(len(b.frames) for b in blocks),
        frames=len({i for b in blocks for start, end in b.ranges for i in range(start, end)}),
        force=_missed(force),
        moment=_missed(moment),
    )


def _missed(found: AgainstMarkers) -> MissedFigures:
    return MissedFigures(found.fit, found.markers, found.cutoffs_hz, _number(found.ratio), found.interval)


def _markers_alone(trial: TrialFit) -> MarkersAloneFigures | None:
    before = trial.kinematics_only
    if before is None:
        return None
    change = (trial.motion.q - before.motion.q)[trial.motion.posed]
    return MarkersAloneFigures(
        _number(before.marker_errors.rms),
        _number(before.marker_errors.maximum),
        _number(float(np.sqrt(np.mean(change**2)))),
    )


def _change(trial: TrialFit, skeleton: Skeleton) -> ChangeFigures | None:
    """In degrees, translations in mm."""
    part = seen_part(trial)
    if part.kinematics_only is None:
        return None
    change = motion_change(skeleton, part.motion, part.kinematics_only.motion)
    rms, offset, gain = change.joints_rms_rad, change.joints_offset_rad, change.joints_gain
    return ChangeFigures(
        limit_hz=change.limit_Hz,
        bands_hz=tuple((low, _number(high)) for low, high in BANDS_HZ),
        joints_rms_deg=None if rms is None else float(np.degrees(rms)),
        joints_offset_deg=None if offset is None else float(np.degrees(offset)),
        joints_gain=_gain(gain, np.degrees(1.0)),
        coordinates=tuple(_changed(coordinate) for coordinate in change.coordinates),
    )


def _changed(change: CoordinateChange) -> CoordinateFigures:
    scale = float(np.degrees(1.0)) if change.turning else 1000.0

    def scaled(value: float | None) -> float | None:
        return None if value is None else scale * value

    return CoordinateFigures(
        name=change.name,
        unit="deg" if change.turning else "mm",
        root=change.root,
        rms=scale * change.rms,
        offset=scale * change.offset,
        bands=tuple(scale * band for band in change.bands),
        gains=tuple(_gain(gain, scale) for gain in change.gains),
        range=scaled(change.range),
        range_of_markers=scaled(change.range_of_markers),
        peak_speed=scaled(change.peak_speed),
        peak_speed_of_markers=scaled(change.peak_speed_of_markers),
    )


def _gain(gain: BandGain | None, scale: float) -> GainFigures | None:
    if gain is None:
        return None
    band = (gain.low_Hz, _number(gain.high_Hz))
    return GainFigures(band, gain.gain, float(np.degrees(gain.phase_rad)), scale * gain.content)


def _rms_and_mean_norm(vectors: Float[np.ndarray, "frames 3"]) -> tuple[float, float]:
    norms = np.linalg.norm(vectors, axis=1)
    return float(np.sqrt(np.mean(norms**2))), float(np.mean(norms))


def _number(value: float) -> float | None:
    """A plain float; None where it is not finite, because JSON has no NaN."""
    return float(value) if np.isfinite(value) else None
