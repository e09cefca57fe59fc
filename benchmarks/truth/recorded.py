"""Part (c): real recordings, against experts' angles where there are some, and against their own markers."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.recordings import data_folder, scaled_reference_models, without_model
from benchmarks.truth.figures import figures, gains_of, length_errors_mm, mass_ratios
from benchmarks.truth.ways import OURS, TimeHistory, all_ways, bench_settings, time_history_of
from solver.capture.capture import Subject
from solver.capture.formats.storage import read_storage
from solver.capture.subject.opened_subject import open_subject
from solver.common.errors import SolverError
from solver.common.filters import low_pass
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings, settings_for
from solver.kinematics.motion import Motion
from solver.skeleton.osim import load_skeleton
from solver.skeleton.skeleton import Skeleton

ACTIVITY = {
    "anomalies/tiziana2019_lencioni": {"trial": "walk"},
    "c3d_lab_trials/lasem_FAILT01": {"Walk01": "walk", "SLDJ06": "jump"},
    "c3d_lab_trials/opensim_core": {"doubleLegLanding": "jump"},
    "exo_apo_gordon": {"NE21": "walk", "ET21": "walk"},
    "opencap_reviewed": {"DJ1": "jump"},
    "opencap_subject4": {
        "DJ1": "jump",
        "STS1": "sit",
        "squats1": "squat",
        "walking1": "walk",
        "walkingTO1": "walk",
    },
    "opencap_subject6": {"walking1": "walk"},
    "overground_camargo2021_AB06": {"levelground_ccw_fast_01_01": "walk"},
    "overground_falisse_AdDB": {"Gait_7": "walk"},
    "run_treadmill_hamner2013_subject04": {"run400": "run"},
    "sprint_overground_dorn2012_JA1_9ms": {"run0900cms": "sprint"},
    "walk_gait2354_subject01": {"walk1": "walk"},
    "walk_rajagopal2015": {"walk": "walk"},
    "walk_treadmill_stepwidth": {"example1": "walk"},
}  # recordings by folder; what else lies there has no motion that the bench could name
LIMIT_HZ = {"walk": 6.0, "run": 10.0, "sprint": 10.0, "jump": 10.0, "squat": 4.0, "sit": 4.0}
REFERENCE_FILTER_HZ = 30.0  # inverse kinematics is noisy: experts' speeds are told below it


@dataclass(frozen=True)
class Reference:
    """Angles, and perhaps torques, that somebody made of a recording."""

    folder: str
    trial: str
    angles: str  # file in reference/
    model: str | None  # file in reference/ that they are on; None: unknown, the recording's own is taken
    whose: str
    torques: str | None = None


EXPERT, ENGINE, EXAMPLE = "an expert's", "an engine's", "OpenSim's example"
REFERENCES = (
    *(
        Reference("opencap_subject4", t, f"{t}_manual_scaling_ik.mot", "manually_scaled.osim", EXPERT)
        for t in ACTIVITY["opencap_subject4"]
    ),
    Reference("opencap_subject6", "walking1", "walking1_expert_ik.mot", "hand_scaled.osim", EXPERT),
    Reference(
        "sprint_overground_dorn2012_JA1_9ms",
        "run0900cms",
        "run0900cms_expert_ik.mot",
        "hand_scaled.osim",
        EXPERT,
    ),
    Reference(
        "sprint_overground_dorn2012_JA1_9ms",
        "run0900cms",
        "sprint_ik.mot",
        "JA1_SCALED_Osim40.osim",
        "a second expert's; its forces leave out contacts, torques are no truth",
        "sprint_id.sto",
    ),
    Reference(
        "walk_gait2354_subject01",
        "walk1",
        "subject01_walk1_ik.mot",
        "subject01_simbody.osim",
        EXAMPLE,
        "inverse_dynamics.sto",
    ),
    Reference("walk_rajagopal2015", "walk", "walk_ik_addbiomechanics.mot", None, ENGINE),
    Reference("walk_rajagopal2015", "walk", "walk_ik_nimble.mot", None, ENGINE),
    Reference(
        "overground_camargo2021_AB06",
        "levelground_ccw_fast_01_01",
        "levelground_ccw_fast_01_01_ik.mot",
        None,
        ENGINE,
    ),
)


def solved(folder: str) -> tuple[Fit, Settings]:
    """A recording's trials as its folder describes them."""
    subject = open_subject(data_folder() / folder)
    settings = bench_settings(settings_for(subject.folder))
    return solve(subject, settings, trials=tuple(ACTIVITY[folder])), settings


def runs(folder: str) -> Iterator[dict[str, object]]:
    """Everything that one recording tells."""
    described, settings = solved(folder)
    subject, trials = described.subject, tuple(ACTIVITY[folder])
    for trial in described.trials:
        yield _own_markers(folder, described, trial, settings)
    yield from _lengths(folder, subject, described, settings)
    fits: dict[str | None, Fit] = {None: described}
    for reference in (r for r in REFERENCES if r.folder == folder):
        if reference.model not in fits:
            own = replace(subject, model=subject.folder / "reference" / str(reference.model))
            fits[reference.model] = solve(own, settings, trials=trials)
        yield _against_reference(reference, fits[reference.model], settings)


def _own_markers(folder: str, fit: Fit, trial: TrialFit, settings: Settings) -> dict[str, object]:
    """The fit against the marker fit of the same recording."""
    activity = ACTIVITY[folder][trial.capture.name]
    ways = all_ways(fit, trial, settings, activity)
    raw = ways.raw_marker_fit
    smooth = low_pass(raw.angle, raw.rate, LIMIT_HZ[activity], settings.conditioning.order)
    below_limit = time_history_of(Motion(raw.dofs, smooth, raw.rate))
    return {
        "kind": "own markers",
        "recording": folder,
        "trial": trial.capture.name,
        "activity": activity,
        "model": fit.subject.model.name if fit.subject.model else "default body",
        "fitted_to_forces": trial.kinematics_only is not None,
        "gains": gains_of(ways),
        "against_marker_fit_below_limit": figures(ways.time_histories[OURS], below_limit, ways.forces_count),
        "mass_ratios": mass_ratios(fit.skeleton, fit.groundwork.skeleton) if fit.groundwork else {},
    }


def _lengths(
    folder: str, subject: Subject, described: Fit, settings: Settings
) -> Iterator[dict[str, object]]:
    """Lengths of the scaled models against those that somebody scaled by hand."""
    models = {p.name: load_skeleton(p) for p in scaled_reference_models(subject)}
    if not models:
        return
    markers_alone = replace(settings, trajectory=replace(settings.trajectory, enabled=False))
    shortest = next(iter(described.trials)).capture.name
    fits = {"as described": described}
    try:
        fits["default body"] = solve(without_model(subject), markers_alone, trials=[shortest])
    except SolverError as error:
        yield {"kind": "lengths", "recording": folder, "error": str(error)}
    for name, fit in fits.items():
        for model, by_hand in models.items():
            yield {
                "kind": "lengths",
                "recording": folder,
                "body": name,
                "hand_scaled": model,
                "length_errors_mm": length_errors_mm(fit.skeleton, by_hand),
            }


def _against_reference(reference: Reference, fit: Fit, settings: Settings) -> dict[str, object]:
    activity = ACTIVITY[reference.folder][reference.trial]
    trial = next(t for t in fit.trials if t.capture.name == reference.trial)
    own = None
    if reference.model is not None:
        own = load_skeleton(data_folder() / reference.folder / "reference" / reference.model)
    ways = all_ways(fit, trial, settings, activity, own)
    truth = reference_time_history(reference, trial, own or fit.skeleton)
    return {
        "kind": "reference",
        "recording": reference.folder,
        "trial": reference.trial,
        "activity": activity,
        "whose": reference.whose,
        "angles": reference.angles,
        "torques": reference.torques,
        "model": reference.model or (fit.subject.model.name if fit.subject.model else "default body"),
        "ways": {
            name: figures(time_history, truth, ways.forces_count)
            for name, time_history in ways.time_histories.items()
        },
    }


def reference_time_history(reference: Reference, trial: TrialFit, skeleton: Skeleton) -> TimeHistory:
    """What somebody made of it, on the trial's frames; NaN where the files say nothing."""
    folder = data_folder() / reference.folder / "reference"
    table = read_storage(folder / reference.angles)
    dofs = tuple(d for d in skeleton.dofs if d in table.labels)
    turning = {c.name for c in skeleton.coordinates if c.motion == "rotation"}
    q = np.stack(
        [np.radians(c) if table.in_degrees and d in turning else c for d in dofs for c in [table.column(d)]],
        axis=1,
    )
    times, inside = trial.motion.times, _covered(trial.motion.times, table.times)
    frames = np.flatnonzero(inside)
    time_history = np.full((3, len(times), len(dofs)), np.nan)
    motion = Motion(dofs, CubicSpline(table.times, q)(times[frames]), trial.motion.rate)
    time_history[0, frames] = motion.q
    time_history[1, frames] = motion.low_passed(REFERENCE_FILTER_HZ).velocity
    torque = _reference_torques(reference, times, dofs)
    return TimeHistory(dofs, trial.motion.rate, time_history[0], time_history[1], time_history[2], torque)


def _reference_torques(reference: Reference, times: np.ndarray, dofs: tuple[str, ...]) -> np.ndarray | None:
    if reference.torques is None:
        return None
    table = read_storage(data_folder() / reference.folder / "reference" / reference.torques)
    inside = _covered(times, table.times)
    torque = np.full((len(times), len(dofs)), np.nan)
    for i, dof in enumerate(dofs):
        if f"{dof}_moment" in table.labels:
            torque[inside, i] = CubicSpline(table.times, table.column(f"{dof}_moment"))(times[inside])
    return torque


def _covered(times: np.ndarray, known: np.ndarray) -> np.ndarray:
    return (times >= known[0] - 1e-6) & (times <= known[-1] + 1e-6)
