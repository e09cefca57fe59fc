"""Twins of real recordings: what gain is right, with each recording's own noise and forces.

A gain below 1 against the marker fit may be motion that is lost or noise that is gone; the recording itself
cannot tell. A matched synthetic can: its motion is known, its forces follow from that and miss as much as the
real ones do, and its markers ride on skin that moves as fast, segment by segment, as the recording's do. The
skin is the bench's own (`skin.py`), not the fit's noise model.

Two motions, between which the truth lies: *calm*, the reported fit, whose forces are then the recorded ones;
and *lively*, the marker fit below a cut-off well above what matters, so that noise of the real markers counts
as motion and the forces demand it.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from benchmarks.truth.bands import band_figures
from benchmarks.truth.figures import error_by_band, figures, gains
from benchmarks.truth.recorded import ACTIVITY, LIMIT_HZ, solved
from benchmarks.truth.skin import SkinSettings, skin_movement
from benchmarks.truth.ways import (
    CUTOFFS_HZ,
    MARKER_FIT,
    OURS,
    TimeHistory,
    at_cutoff,
    time_history_of,
    torques_of,
)
from solver.common.progress import silent
from solver.dynamics.material_acceleration import required_ground
from solver.dynamics.trajectory.marker_error_levels import MarkerErrorLevels, marker_error_levels
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.pipeline import fit_to_forces
from solver.fitting.settings import Settings
from solver.fitting.state import FitState
from solver.fitting.torques_stage import compute_torques, estimate_std
from solver.kinematics.inverse_kinematics import inverse_kinematics
from solver.kinematics.motion import Motion
from solver.skeleton.forward import ForwardKinematics, body_poses, marker_positions
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton

LIVELY_HZ = {"walk": 12.0, "run": 20.0, "sprint": 20.0, "jump": 20.0, "squat": 8.0, "sit": 8.0}
FIRST_SKIN_M = 0.003  # of the first draw, which tells how far each segment is from the recording's movement
ROUNDS = 3  # of making each segment's skin as large and as fast as the recording's
NOTHING_BUT_RING = 1e6  # against what follows the angles
SEED = 4000  # the same skin in both matched synthetics
LOADED_N = 20.0  # of both feet together: below it a difference is shared evenly


def runs(folder: str) -> Iterator[dict[str, object]]:
    """Both matched synthetics of every trial that shows somebody throughout and was fitted to forces."""
    fit, settings = solved(folder)
    for trial in fit.trials:
        if trial.kinematics_only is None or fit.groundwork is None or not trial.motion.posed.all():
            continue  # nobody moves before somebody comes into view: there is no whole movement to repeat
        activity = ACTIVITY[folder][trial.capture.name]
        for kind in ("calm", "lively"):
            yield _run(folder, fit, trial, settings, activity=activity, kind=kind)


@dataclass(frozen=True)
class MatchedSynthetic:
    """A made recording with a real one's noise, and its truth."""

    before: TrialFit  # as the markers alone leave it, with its forces
    truth: TimeHistory
    slow: tuple[
        float, float
    ]  # [m] of the recording's markers and of the matched synthetic's, root mean square
    growth: tuple[float, float]  # [m/√s] likewise


def _run(
    folder: str, fit: Fit, trial: TrialFit, settings: Settings, *, activity: str, kind: str
) -> dict[str, object]:
    assert trial.kinematics_only is not None
    assert trial.dynamics is not None
    assert fit.groundwork is not None
    markers_alone = trial.kinematics_only.motion.filled()
    motion = trial.motion.filled() if kind == "calm" else markers_alone.low_passed(LIVELY_HZ[activity])
    matched_synthetic = made(fit, trial, motion, settings)
    nominal = with_mass(fit.groundwork.skeleton, fit.groundwork.mass_kg or fit.mass_kg)
    state = FitState(fit.subject, fit.groundwork, nominal, trials=(matched_synthetic.before,))
    fitted = fit_to_forces(state, settings, silent)
    std = estimate_std(compute_torques(fitted, settings), settings).trials[0].std
    ours = fitted.trials[0].motion
    time_histories = {
        OURS: _time_history(fitted.fitted_skeleton, ours, matched_synthetic.before),
        MARKER_FIT: _time_history(nominal, matched_synthetic.before.motion, matched_synthetic.before),
    }
    for hertz in CUTOFFS_HZ:
        if hertz < ours.rate / 2:
            time_histories[at_cutoff(hertz)] = _time_history(
                nominal, matched_synthetic.before.motion.low_passed(hertz), matched_synthetic.before
            )
    raw = time_histories[MARKER_FIT]
    below_limit = time_history_of(matched_synthetic.before.motion.low_passed(LIMIT_HZ[activity]))
    used = trial.dynamics.used
    return {
        "kind": "matched_synthetic",
        "recording": folder,
        "trial": trial.capture.name,
        "activity": activity,
        "matched_synthetic": kind,
        "slow_mm": [1000 * level for level in matched_synthetic.slow],
        "growth_mm": [1000 * level for level in matched_synthetic.growth],
        "gains": {OURS: gains(time_histories[OURS], raw), "truth": gains(matched_synthetic.truth, raw)},
        "gains_of_recording": gains(time_history_of(trial.motion.filled()), time_history_of(markers_alone)),
        "errors_by_band": {
            name: error_by_band(time_history, matched_synthetic.truth)
            for name, time_history in time_histories.items()
        },
        "against_marker_fit_below_limit": {
            OURS: figures(time_histories[OURS], below_limit, used),
            "truth": figures(matched_synthetic.truth, below_limit, used),
        },
        "bands": band_figures(std, nominal.dofs, time_histories[OURS], matched_synthetic.truth, used),
        "ways": {
            name: figures(time_history, matched_synthetic.truth, used)
            for name, time_history in time_histories.items()
        },
    }


def made(fit: Fit, trial: TrialFit, motion: Motion, settings: Settings) -> MatchedSynthetic:
    """A matched synthetic that moves so.

    Args:
        fit: its body, as fitted, is the matched synthetic's.
        trial: whose noise, forces and gaps the matched synthetic has.
        motion: the truth.
        settings: of every stage.
    """
    contacts, work = trial.contacts, fit.groundwork
    assert contacts is not None
    assert work is not None
    assert trial.kinematics_only is not None
    recorded = contacts.wrench_ground
    missed = recorded.sum(axis=1) - required_ground(fit.skeleton, trial.motion.filled())
    missed[~trial.forces_known] = 0.0
    true_wrench = recorded + _shared(required_ground(fit.skeleton, motion) - recorded.sum(axis=1), recorded)
    true_wrench[~trial.forces_known] = recorded[~trial.forces_known]
    measured = true_wrench + _shared(missed, recorded)
    torque = torques_of(fit.skeleton, motion, true_wrench, contacts.foot_bodies)
    truth = time_history_of(motion, torque)

    observed = work.match.observed(trial.capture.markers)
    unseen = ~np.isfinite(observed)
    nominal = with_mass(work.skeleton, work.mass_kg or fit.mass_kg)
    kinematics = ForwardKinematics(nominal)
    levels = _levels(kinematics, observed, trial.kinematics_only.motion.filled(), settings)
    exact = marker_positions(nominal, motion.q)
    bodies = kinematics.marker_bodies
    by_angles, shaken = _skin(nominal, list(bodies), motion, recorded[:, :, 1], fit.mass_kg)
    slow, fast = np.full((2, len(bodies)), FIRST_SKIN_M)
    for left in reversed(range(ROUNDS + 1)):
        moved = slow[None, :, None] * by_angles + fast[None, :, None] * shaken
        shown = np.where(unseen, np.nan, exact + moved)
        q = inverse_kinematics(nominal, shown, motion.rate, settings.kinematics)
        alone = Motion(motion.dofs, q, motion.rate, motion.start_time)
        own = _levels(kinematics, shown, alone, settings)
        if left:
            slow = slow * levels.slow_m / own.slow_m
            fast = fast * levels.growth_m / own.growth_m
    names = tuple(spellings[0] for spellings in work.match.measured)
    markers = replace(trial.capture.markers, names=names, positions_ground=shown)
    before = replace(
        trial,
        capture=replace(trial.capture, markers=markers),
        motion=alone,
        contacts=replace(contacts, wrench_ground=measured, wrench_raw_ground=measured),
        kinematics_only=None,
        spline=None,
        held_out=None,
    )
    return MatchedSynthetic(
        before, truth, (_rms(levels.slow_m), _rms(own.slow_m)), (_rms(levels.growth_m), _rms(own.growth_m))
    )


def _skin(
    skeleton: Skeleton,
    marker_bodies: list[int],
    motion: Motion,
    load_N: Float[np.ndarray, "frames feet"],
    mass_kg: float,
) -> tuple[Float[np.ndarray, "frames markers 3"], Float[np.ndarray, "frames markers 3"]]:
    """Movement that follows the angles, and movement that impacts shake up, each of root mean square 1.

    Without each marker's mean on its segment, as marker places are fitted to the recording.
    """
    R_ground, _ = body_poses(skeleton, motion.q)
    parts = []
    for ring in (0.0, NOTHING_BUT_RING):
        moved = skin_movement(
            skeleton,
            marker_bodies,
            motion.q,
            times=motion.times,
            load=_two_feet(load_N) / (mass_kg * float(np.linalg.norm(skeleton.gravity))),
            rng=np.random.default_rng(SEED),
            settings=replace(SkinSettings(), ring_per_body_weight=ring),
        )
        on_body = np.einsum("tmji,tmj->tmi", R_ground[:, marker_bodies], moved)
        moved = np.einsum("tmij,tmj->tmi", R_ground[:, marker_bodies], on_body - on_body.mean(axis=0))
        parts.append(moved / np.sqrt(np.mean((moved**2).sum(axis=2))))
    return parts[0], parts[1]


def _shared(
    wrench_ground: Float[np.ndarray, "frames 6"], feet_ground: Float[np.ndarray, "frames feet 6"]
) -> Float[np.ndarray, "frames feet 6"]:
    """A wrench divided between the feet as their loads are."""
    load = np.maximum(feet_ground[:, :, 1], 0.0)
    total = load.sum(axis=1, keepdims=True)
    share = np.where(total > LOADED_N, load / np.maximum(total, LOADED_N), 1 / load.shape[1])
    return share[:, :, None] * wrench_ground[:, None, :]


def _time_history(skeleton: Skeleton, motion: Motion, trial: TrialFit) -> TimeHistory:
    assert trial.contacts is not None
    torque = torques_of(skeleton, motion, trial.contacts.wrench_ground, trial.contacts.foot_bodies)
    return time_history_of(motion, torque)


def _levels(
    kinematics: ForwardKinematics,
    observed_ground: Float[np.ndarray, "frames markers 3"],
    motion: Motion,
    settings: Settings,
) -> MarkerErrorLevels:
    return marker_error_levels(kinematics, observed_ground, motion, settings.trajectory)


def _two_feet(load: Float[np.ndarray, "frames feet"]) -> Float[np.ndarray, "frames 2"]:
    """The right foot's and the left foot's; a recording may know one alone."""
    return load if load.shape[1] == 2 else np.repeat(load.sum(axis=1, keepdims=True) / 2, 2, axis=1)


def _rms(values: Float[np.ndarray, " some"]) -> float:
    return float(np.sqrt(np.mean(values**2)))
