"""What the bench keeps of one solved recording: plain numbers, for the page and for later comparisons.

How far a time history is from the truth: errors, peaks, lag, ranges; gain and phase by frequency; and masses
and lengths of segments, the fit's beside the true ones.
"""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool, Float

from benchmarks.truth.bands import band_figures, inner
from benchmarks.truth.ways import LABORATORY, OURS, TimeHistory, Ways
from solver.dynamics.motion_change import spectra_of
from solver.fitting.fit_result import Fit
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

TURNING = (
    *("pelvis_tilt", "pelvis_list", "pelvis_rotation"),
    *("lumbar_extension", "lumbar_bending", "lumbar_rotation"),
    *(
        f"{stem}_{side}"
        for stem in (
            *("hip_flexion", "hip_adduction", "hip_rotation"),
            *("knee_angle", "ankle_angle", "subtalar_angle"),
        )
        for side in "rl"
    ),
)  # coordinates of pelvis, trunk and legs; arms and toes are no concern of the bench
DEGREES = 180 / np.pi
UNITS = {"angle": DEGREES, "speed": DEGREES, "acceleration": 1.0, "torque": 1.0}  # °, °/s, rad/s², N·m
BANDS_HZ = ((0.5, 2.0), (2.0, 4.0), (4.0, 6.0), (6.0, 8.0), (8.0, 10.0), (10.0, 15.0))
FLEXION = {"hip": "hip_flexion", "knee": "knee_angle", "ankle": "ankle_angle"}
LARGEST_LAG_S = 0.06
ALIKE = 0.5  # correlation below which a lag means nothing

Figures = dict[str, dict[str, dict[str, float | None]]]


def figures(estimate: TimeHistory, truth: TimeHistory, forces_count: Bool[np.ndarray, " frames"]) -> Figures:
    """Figures by kind and coordinate, for those that both have.

    Args:
        estimate: of a way.
        truth: on the same frames; NaN where it says nothing.
        forces_count: frames on which torques are compared.
    """
    kept = inner(len(truth.angle), truth.rate)
    found: Figures = {}
    for kind, unit in UNITS.items():
        ours, true = getattr(estimate, kind), getattr(truth, kind)
        if ours is None or true is None:
            continue
        found[kind] = {}
        for dof in (d for d in TURNING if d in truth.dofs and d in estimate.dofs):
            a, b = unit * ours[:, estimate.dofs.index(dof)], unit * true[:, truth.dofs.index(dof)]
            on = kept & np.isfinite(b) & (forces_count if kind == "torque" else True)
            if on.sum() > 2:
                found[kind][dof] = _compared(a[on], b[on], truth.rate, level=kind == "angle")
    return found


def _compared(
    ours: Float[np.ndarray, " frames"], true: Float[np.ndarray, " frames"], rate: float, *, level: bool
) -> dict[str, float | None]:
    """Of one coordinate. `level`: peaks are counted from the mean, as an angle's zero is the model's."""
    error = ours - true
    zero = (ours.mean(), true.mean()) if level else (0.0, 0.0)
    peak = float(np.abs(true - zero[1]).max())
    return {
        "rms": _rms(error),
        "rms_without_offset": _rms(error - error.mean()),
        "worst": float(np.abs(error).max()),
        "peak": peak,
        "peak_excess": float(np.abs(ours - zero[0]).max()) - peak,
        "range": float(np.ptp(true)),
        "range_excess": float(np.ptp(ours) - np.ptp(true)),
        "lag_ms": lag_ms(ours, true, rate),
    }


def lag_ms(
    ours: Float[np.ndarray, " frames"], true: Float[np.ndarray, " frames"], rate: float
) -> float | None:
    """By how much the first comes later than the second: where their correlation is greatest.

    Over the frames that overlap at each shift, between frames by a parabola. None where they are not alike,
    or hardly move.
    """
    most = min(round(LARGEST_LAG_S * rate), len(ours) // 4)
    if most < 1 or not (np.ptp(ours) and np.ptp(true)):
        return None
    lags = np.arange(-most, most + 1)
    alike = np.array([_alike(ours[max(k, 0) :], true[max(-k, 0) :]) for k in lags])
    best = int(np.argmax(alike))
    if alike[best] < ALIKE:
        return None
    between = 0.0
    if 0 < best < len(lags) - 1:
        before, at, after = alike[best - 1 : best + 2]
        bend = before - 2 * at + after
        between = 0.5 * (before - after) / bend if bend < 0 else 0.0
    return float(1000 * (lags[best] + between) / rate)


def _alike(later: Float[np.ndarray, " some"], earlier: Float[np.ndarray, " others"]) -> float:
    """Correlation of two curves over the frames that both have."""
    both = min(len(later), len(earlier))
    a, b = later[:both] - later[:both].mean(), earlier[:both] - earlier[:both].mean()
    size = np.sqrt(np.sum(a**2) * np.sum(b**2))
    return float(np.sum(a * b) / size) if size > 0 else 0.0


def gains(time_history: TimeHistory, marker_fit: TimeHistory) -> dict[str, list[dict[str, float]]]:
    """Gain and phase of a time history against the marker fit by joint and frequency band, sides together.

    As `solver.dynamics.motion_change` has them. Phase is positive where it leads. `content` is the marker
    fit's own root mean square in the band [°]: where it is tiny, gain is that of noise.
    """
    found: dict[str, list[dict[str, float]]] = {}
    for joint, stem in FLEXION.items():
        dofs = _both(stem, time_history)
        if not dofs:
            continue
        ours = time_history.angle[:, [time_history.dofs.index(d) for d in dofs]]
        theirs = marker_fit.angle[:, [marker_fit.dofs.index(d) for d in dofs]]
        found[joint] = [
            {
                "low_Hz": band.low_Hz,
                "high_Hz": band.high_Hz,
                "gain": band.gain,
                "phase_deg": DEGREES * band.phase_rad,
                "content_deg": DEGREES * band.content,
            }
            for band in spectra_of(ours, theirs, time_history.rate).gains(BANDS_HZ, slice(None))
        ]
    return found


def error_by_band(time_history: TimeHistory, truth: TimeHistory) -> dict[str, list[dict[str, float]]]:
    """Root mean square of a time history's error by joint and frequency band [°], both sides together."""
    found: dict[str, list[dict[str, float]]] = {}
    for joint, stem in FLEXION.items():
        dofs = [d for d in _both(stem, truth) if d in time_history.dofs]
        if not dofs:
            continue
        ours, true = (c.angle[:, [c.dofs.index(d) for d in dofs]] for c in (time_history, truth))
        error = ours - true
        found[joint] = [
            {"low_Hz": g.low_Hz, "high_Hz": g.high_Hz, "error_deg": DEGREES * g.content}
            for g in spectra_of(error, error, truth.rate).gains(BANDS_HZ, slice(None))
        ]
    return found


def _both(stem: str, time_history: TimeHistory) -> list[str]:
    return [d for d in (f"{stem}_r", f"{stem}_l") if d in time_history.dofs]


def _rms(values: Float[np.ndarray, " frames"]) -> float:
    return float(np.sqrt(np.mean(values**2)))


PARTS = {
    "trunk": ("pelvis", "torso"),
    "thigh": ("femur_r", "femur_l"),
    "shank": ("tibia_r", "tibia_l"),
    "foot": tuple(f"{bone}_{side}" for bone in ("talus", "calcn", "toes") for side in "rl"),
}  # masses of both sides together: the fit ties them
LENGTHS = {
    "hip width": ("femur_r", "femur_l"),
    "thigh": ("femur_r", "tibia_r"),
    "shank": ("tibia_r", "talus_r"),
    "foot": ("calcn_r", "toes_r"),
}  # between the origins of these bodies


def mass_ratios(fitted: Skeleton, true: Skeleton) -> dict[str, float]:
    """Fitted over true mass, by part of the body."""
    ours, theirs = _masses(fitted), _masses(true)
    return {
        part: float(sum(ours[n] for n in names) / sum(theirs[n] for n in names))
        for part, names in PARTS.items()
        if all(n in ours and n in theirs for n in names)
    } | {"body": float(fitted.mass / true.mass)}


def length_errors_mm(fitted: Skeleton, true: Skeleton) -> dict[str, float]:
    """Fitted less true length [mm], in the models' neutral poses."""
    ours, theirs = _lengths(fitted), _lengths(true)
    return {name: 1000 * (ours[name] - theirs[name]) for name in ours.keys() & theirs.keys()}


def _masses(skeleton: Skeleton) -> Mapping[str, float]:
    return {body.name: body.mass for body in skeleton.bodies}


def _lengths(skeleton: Skeleton) -> dict[str, float]:
    q = skeleton.default_q.copy()
    for i, dof in enumerate(skeleton.dofs):
        if dof.startswith("knee_angle"):
            q[i] = 0.0  # models' knees slide as they bend
    _, p = body_poses(skeleton, q[None])
    place = dict(zip(skeleton.body_names, p[0], strict=True))
    return {
        name: float(np.linalg.norm(place[a] - place[b]))
        for name, (a, b) in LENGTHS.items()
        if a in place and b in place
    }


def against_truth(
    labels: dict[str, object], fit: Fit, ways: Ways, truth: TimeHistory, true_skeleton: Skeleton
) -> dict[str, object]:
    """Figures of a recording whose truth is known.

    Args:
        labels: of the run: activity, skin movement, model, person.
        fit: of the recording.
        ways: of its trial.
        truth: on the same frames.
        true_skeleton: that really moved.
    """
    return labels | {
        "ways": {
            name: figures(time_history, truth, ways.forces_count)
            for name, time_history in ways.time_histories.items()
        },
        "gains": gains_of(ways) | {"truth": gains(truth, ways.raw_marker_fit)},
        "gains_against_truth": {OURS: gains(ways.time_histories[OURS], truth)},
        "bands": band_figures(
            fit.trials[0].std, fit.skeleton.dofs, ways.time_histories[OURS], truth, ways.forces_count
        ),
        "mass_ratios": mass_ratios(fit.skeleton, true_skeleton),
        "length_errors_mm": length_errors_mm(fit.skeleton, true_skeleton),
    }


def gains_of(ways: Ways) -> dict[str, object]:
    """Gain and phase against the unfiltered marker fit."""
    return {name: gains(ways.time_histories[name], ways.raw_marker_fit) for name in (OURS, LABORATORY)}
