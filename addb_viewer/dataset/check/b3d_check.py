"""A .b3d file by itself, of the published dataset or of a release, and fitted anew."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.dataset.check.findings import (
    FARTHEST_M,
    FASTEST_RAD_S,
    FROZEN_S,
    LOADED_N,
    MASS_SHARE,
    RANGES,
    STILL_M,
    Finding,
    copy_words,
    error,
    warning,
)
from addb_viewer.dataset.same_recording import Places, Recording, recording_of, same_recordings
from annotations.agreement import agreement
from solver.capture.formats.b3d.b3d_fields import REASONS, B3dFile, B3dTrial, Header, PassFrames, PassType
from solver.capture.formats.b3d.b3d_file import read_b3d
from solver.capture.formats.b3d.stored import stored_passes
from solver.capture.subject.opened_subject import open_subject
from solver.common.errors import CaptureError
from solver.common.progress import Progress, part, silent
from solver.common.true_runs import runs
from solver.diagnosis.diagnose_subject import diagnose
from solver.diagnosis.diagnosis_report import Cause, report
from solver.fitting.fit_result import TrialFit
from solver.fitting.fit_summary import StoredFigures, TrialFigures
from solver.fitting.pipeline import solve
from solver.fitting.settings import settings_for
from solver.fitting.summary import summary

GRAVITY_M_S2 = 9.80665
FALSE_ZERO = 0.5  # of body weight that the motion demands, on a frame that counts and bears nothing
FEWEST_S = 0.05  # of such frames in a row: edges of contacts differ by a frame or two
BALANCE_SHARE = 0.05  # of body weight by which the stored residual may differ from the one computed anew
FEWEST_FOR_MASS_S = 0.3  # of counting frames; their accelerations are known


def b3d_findings(path: Path) -> list[Finding]:
    """What is wrong with a .b3d file, errors first; nothing is fitted."""
    where = path.name
    try:
        file = read_b3d(path)
        found = [*_person(file.header, where), *_duplicates(file, where), *_trials(file, where)]
    except CaptureError as unreadable:
        return [error("b3d", where, str(unreadable).removeprefix(f"{path}: "))]
    return sorted(found, key=lambda one: (one.level != "error", one.where, one.said))


def _person(header: Header, where: str) -> Iterator[Finding]:
    bmi = header.mass_kg / header.height_m**2 if header.height_m > 0 else 0.0
    told = {
        "age_years": header.age_years,
        "height_m": header.height_m,
        "mass_kg": header.mass_kg,
        "bmi": bmi,
    }
    for name, value in told.items():
        low, high = RANGES[name]
        if value > 0 and not low <= value <= high:
            yield warning("plausible", where, f"{name} is {value:g}, expected {low:g} to {high:g}")


def _trials(file: B3dFile, where: str) -> Iterator[Finding]:
    required, carried, counted_s = 0.0, 0.0, 0.0
    for trial in file.trials:
        name = f"{where}: {trial.header.name}"
        counts = _counts(trial)
        yield from _labels(trial, name)
        if not trial.passes:
            continue
        last = trial.passes[-1]
        yield from _numbers(trial, name)
        yield from _balance(file.header, trial, name)
        yield from _false_zeros(file.header, trial, counts, name)
        for body, contact in enumerate(file.header.ground_contact_body):
            yield from _contact(trial, last, body, contact, name)
        up = _acceleration(last, trial.header.trial_timestep)[:, 1] + GRAVITY_M_S2
        total = _forces(last)[..., 1].sum(axis=1)
        inside = counts & np.isfinite(up)
        required += float(up[inside].sum())
        carried += float(total[inside].sum())
        counted_s += float(inside.sum()) * trial.header.trial_timestep
    if counted_s > FEWEST_FOR_MASS_S and required > 0 and file.header.mass_kg > 0:
        mass = carried / required
        if abs(file.header.mass_kg / mass - 1) > MASS_SHARE:
            said = (
                f"mass_kg is {file.header.mass_kg:.1f}, the forces on {counted_s:.0f} s carry {mass:.1f} kg"
            )
            yield warning("plausible", where, said)


def _duplicates(file: B3dFile, where: str) -> Iterator[Finding]:
    shown = [_recording(file, k) for k in range(len(file.trials))]
    for one, other in same_recordings(shown):
        yield error("duplicates", f"{where}: {other.trial_id}", copy_words(other, one))


def _recording(file: B3dFile, k: int) -> Recording:
    header = file.trials[k].header
    return recording_of(header.name, file.header.marker_name, _places(file, k), partial(_places, file, k))


def _places(file: B3dFile, k: int) -> Places:
    trial = file.trials[k]
    markers = np.array(trial.sensors.marker_obs).reshape(trial.header.trial_length, -1, 3)
    markers[(markers == 0).all(axis=2)] = np.nan
    return Places(np.arange(len(markers)) * trial.header.trial_timestep, markers)


def _counts(trial: B3dTrial) -> Bool[np.ndarray, " frames"]:
    reasons = np.array(trial.header.missing_GRF_reason)
    fine = reasons == 0 if len(reasons) else np.ones(trial.header.trial_length, dtype=bool)
    return np.asarray(fine)


def _labels(trial: B3dTrial, name: str) -> Iterator[Finding]:
    """Whether anybody or anything has said which forces count."""
    reasons = np.array(trial.header.missing_GRF_reason)
    unknown = sorted({int(one) for one in reasons if not 0 <= one < len(REASONS)})
    if unknown:
        yield error("labels", name, f"reason {unknown[0]} is not one of the format's {len(REASONS)}")
    has_dynamics = any(one.type == PassType.DYNAMICS for one in trial.header.processing_pass_header)
    if not has_dynamics and not reasons.any():
        yield warning("labels", name, "no dynamics pass, and no frame has a reason: nobody has reviewed it")


def _numbers(trial: B3dTrial, name: str) -> Iterator[Finding]:
    for number, frames in enumerate(trial.passes):
        for series in ("pos", "vel", "acc", "tau", "com_pos", "ground_contact_wrench"):
            if not np.isfinite(np.array(getattr(frames, series))).all():
                yield error("b3d", name, f"{series} of pass {number} has values that are no numbers")
    fastest = np.abs(np.array(trial.passes[-1].vel)[:, 6:]).max(initial=0.0)
    if fastest > FASTEST_RAD_S:
        yield warning("plausible", name, f"a joint turns at {fastest:.0f} rad/s")


def _balance(header: Header, trial: B3dTrial, name: str) -> Iterator[Finding]:
    """The stored residual against m (a − g) − Σ forces of the stored motion, in the median over frames."""
    for about, frames, stored in zip(
        trial.header.processing_pass_header, trial.passes, stored_passes(header, [trial]), strict=False
    ):
        for note in stored.notes:
            yield error("forces", name, f"{stored.kind} pass: {note.removesuffix('; corrected here')}")
        if about.type != PassType.DYNAMICS or stored.notes or header.mass_kg <= 0 or len(frames.pos) < 5:
            continue
        required = header.mass_kg * _acceleration(frames, trial.header.trial_timestep)
        required[:, 1] += header.mass_kg * GRAVITY_M_S2
        missed = np.linalg.norm(required - _forces(frames).sum(axis=1), axis=1)
        both = np.isfinite(missed) & np.isfinite(stored.force_N)
        if not both.any():
            continue
        again, told = float(np.median(missed[both])), float(np.median(stored.force_N[both]))
        if abs(again - told) > BALANCE_SHARE * header.mass_kg * GRAVITY_M_S2:
            said = (
                f"its residual force is {told:.0f} N in the median, its motion and forces leave {again:.0f} N"
            )
            yield error("forces", name, f"{stored.kind} pass: {said}")


def _false_zeros(
    header: Header, trial: B3dTrial, counts: Bool[np.ndarray, " frames"], name: str
) -> Iterator[Finding]:
    """Frames that count, bear nothing, and whose motion demands weight: a foot beside the plates."""
    last, step = trial.passes[-1], trial.header.trial_timestep
    up = _acceleration(last, step)[:, 1] + GRAVITY_M_S2
    nothing = (_forces(last) == 0).all(axis=(1, 2))
    false = counts & nothing & (up > FALSE_ZERO * GRAVITY_M_S2)
    long = [(a, b) for a, b in runs(false) if (b - a) * step >= FEWEST_S]
    if long:
        frames = sum(b - a for a, b in long)
        said = f"{frames} frames count and have no force, while the motion demands weight; the first is"
        yield warning("labels", name, f"{said} frame {long[0][0]}")


def _contact(trial: B3dTrial, frames: PassFrames, body: int, contact: str, name: str) -> Iterator[Finding]:
    """A contact body's centre of pressure against the joints, and its force at the trial's ends."""
    count = trial.header.trial_length
    force, counts = _forces(frames)[:, body], _counts(trial)
    loaded = force[:, 1] > LOADED_N
    for end, before, words in ((0, 1, "first"), (-1, -2, "last")):
        if count > 1 and counts[end] and not force[end].any() and loaded[before]:
            said = f"the force of {contact} is zero on the {words} frame, beside a loaded one"
            yield warning("plausible", name, said)
    joints = np.array(frames.world_frame_joint_centers).reshape(count, -1, 3)
    cop = np.array(frames.ground_contact_center_of_pressure).reshape(count, -1, 3)[:, body]
    if not joints.shape[1] or not loaded.any():
        return
    away = np.linalg.norm((joints - cop[:, None])[..., [0, 2]], axis=2).min(axis=1)
    far = loaded & (away > FARTHEST_M)
    if far.any():
        said = f"the centre of pressure of {contact} is up to {away[far].max():.2f} m from every joint"
        yield warning("plausible", name, f"{said} on {far.sum()} frames")
    nearest = joints[np.arange(count), np.linalg.norm(joints - cop[:, None], axis=2).argmin(axis=1)]
    same = np.zeros(count, dtype=bool)
    same[1:] = (np.diff(cop, axis=0) == 0).all(axis=1) & loaded[1:] & loaded[:-1]
    for start, end in runs(same):
        moves = np.linalg.norm(np.ptp(nearest[start:end], axis=0)) > STILL_M
        if (end - start) * trial.header.trial_timestep > FROZEN_S and moves:
            said = f"the centre of pressure of {contact} stands still from frame {start} on"
            yield warning("plausible", name, said)
            break


def _forces(frames: PassFrames) -> Float[np.ndarray, "frames bodies 3"]:
    return np.array(frames.ground_contact_wrench).reshape(len(frames.pos), -1, 6)[..., 3:]


def _acceleration(frames: PassFrames, step_s: float) -> Float[np.ndarray, "frames 3"]:
    """Of the centre of mass, by second differences of its places; NaN at both ends."""
    places = np.array(frames.com_pos)
    found = np.full(places.shape, np.nan)
    found[1:-1] = (places[2:] - 2 * places[1:-1] + places[:-2]) / step_s**2
    return found


FITTED = 0.3  # share of the work


@dataclass(frozen=True)
class Refitted:
    """One trial: figures of the file's last pass and of our fit, RMS on the frames that our fit uses."""

    trial: str
    stored_pass: str
    marker_cm: tuple[float | None, float | None]  # stored, ours
    force_N: tuple[float | None, float | None]
    moment_Nm: tuple[float | None, float | None]
    counting: tuple[int, int]  # frames
    frames: int
    kappa: float  # between the file's word on which frames count and detection's; NaN: all are the same one


def refitted(path: Path, progress: Progress = silent) -> tuple[list[Refitted], tuple[Cause, ...]]:
    """Fit a file as if nobody had reviewed it, and diagnose it; nothing is written.

    Args:
        path: of the .b3d file.
        progress: told the stage and the fraction done.

    Returns:
        A row a trial, and the causes that the diagnosis names.

    Raises:
        SolverError: it cannot be read or fitted.
    """
    settings = settings_for(path)
    subject = open_subject(path)
    fit = solve(subject, settings, reviews={}, progress=part(progress, 0.0, FITTED))
    rows = [_row(trial, figures) for trial, figures in zip(fit.trials, summary(fit).trials, strict=True)]
    found = diagnose(subject, settings, reviews={}, progress=part(progress, FITTED, 1.0))
    return rows, report(found).effects


def _row(trial: TrialFit, figures: TrialFigures) -> Refitted:
    stored = figures.stored[-1] if figures.stored else StoredFigures("none", None, None, None, ())
    linear, angular = figures.linear_residual, figures.angular_residual
    missing = trial.capture.imported_missing_force
    said = np.ones(trial.motion.frames, dtype=bool) if missing is None else ~np.asarray(missing)
    ours = trial.forces_known
    return Refitted(
        trial=trial.capture.name,
        stored_pass=stored.kind,
        marker_cm=(_times(stored.marker_rms_m, 100), _times(figures.marker_rms_m, 100)),
        force_N=(stored.force_rms_N, linear and linear.rms_N),
        moment_Nm=(stored.moment_rms_Nm, angular and angular.rms_Nm),
        counting=(int(said.sum()), int(ours.sum())),
        frames=trial.motion.frames,
        kappa=agreement(said[:, None], ours[:, None]).kappa,
    )


def _times(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value


def in_words(rows: list[Refitted], causes: Sequence[Cause]) -> Iterator[str]:
    """The table, stored → ours, and a line a cause."""
    yield "trial: marker RMS [cm], residual force [N], residual moment [N·m], frames counting; stored → ours"
    for row in rows:
        figures = ", ".join(
            f"{_number(a)} → {_number(b)}" for a, b in (row.marker_cm, row.force_N, row.moment_Nm)
        )
        kappa = "" if np.isnan(row.kappa) else f", κ {row.kappa:.2f}"
        counts = f"{row.counting[0]} → {row.counting[1]} of {row.frames}"
        yield f"{row.trial} ({row.stored_pass} pass): {figures}, {counts}{kappa}"
    for cause in causes:
        yield f"cause: {cause.id} {cause.target}, {100 * cause.confidence:.0f} % sure"
    if not causes:
        yield "no cause is named"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"
