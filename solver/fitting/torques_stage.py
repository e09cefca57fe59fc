"""Torques and residuals of a trial under the forces that count, measured or predicted."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.ndimage import uniform_filter1d

from solver.capture.capture import Subject
from solver.capture.plates.conditioning import shared_cutoff
from solver.common.cpu_timer import CpuTimer
from solver.common.notes import Kind, Note, noted
from solver.dynamics.dynamics import BodyLoad, Dynamics
from solver.dynamics.force_prediction.divided_wrench import distances_to_soles
from solver.dynamics.force_prediction.missing_wrench import predict_ground_forces, with_joint_torques
from solver.dynamics.inverse_dynamics import counted_wrenches, inverse_dynamics
from solver.dynamics.root_wrench import about_point
from solver.dynamics.trajectory.extension import TrialExtension, with_extra_wrench
from solver.dynamics.trajectory.uncertainty import ErrorSizes, dofs_above, trial_std
from solver.fitting.fit_result import TrialFit
from solver.fitting.settings import Settings
from solver.fitting.state import FitState
from solver.fitting.trajectory_stage import extra_of
from solver.kinematics.motion import Motion
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton

UNSURE_FOOT_M = 0.15  # [m] from a sole: the predicted centre of pressure errs by 3 to 5 cm in walking
UNSURE_LOAD = 0.2  # of body weight; with less, a centre of pressure lies anywhere
REMAINDER_S = 0.2  # over which the size of a residual is told
NOTABLE_SHARE = 0.05  # of the frames, from which on unsure feet are noted


def under_forces(fit: TrialFit, motion: Motion, skeleton: Skeleton, settings: Settings) -> Dynamics:
    """Of any motion of a trial, under the forces that count."""
    assert fit.contacts is not None
    assert fit.mask is not None
    return inverse_dynamics(skeleton, motion, fit.contacts, fit.mask, settings.dynamics)


def compute_torques(state: FitState, settings: Settings) -> FitState:
    """Torques and residuals of every trial that has forces, or for which some can be predicted."""
    x = None
    if state.extension is not None:
        x = state.result.extra if state.result else state.extension.x
    predicted = {}
    if state.prediction is not None:
        names = [fit.capture.name for fit in state.members]
        predicted = dict(zip(names, state.prediction.wrenches_ground, strict=True))
    return replace(
        state,
        trials=tuple(
            with_dynamics(
                fit,
                state.fitted_skeleton,
                settings,
                extra=extra_of(fit, state.extension),
                x=x,
                predicted_ground=predicted.get(fit.capture.name),
            )
            for fit in state.trials
        ),
    )


def estimate_std(state: FitState, settings: Settings) -> FitState:
    """How far angles, speeds and torques may be off, of every trial that was fitted to forces.

    What markers and tables leave open (`trial_std`), and the residual wrench, which may be the plates' error.
    A model that the subject came with is taken to be the person's. Torques that rest on a predicted wrench,
    those of the leg above that foot, have none until held-out steps tell it (`with_predicted_std`).
    """
    if state.result is None:
        return state
    trials = list(state.trials)
    sizes = error_sizes(state.subject)
    for k, i in enumerate(state.fitted):
        fit, extra = trials[i], extra_of(trials[i], state.extension)
        if fit.std is not None:  # an edit left the trial as it was
            continue
        dynamics, contacts, mask = fit.dynamics, fit.contacts, fit.mask
        assert dynamics is not None
        assert contacts is not None
        assert mask is not None
        wrenches, loads = loads_of(fit, extra, state.result.extra)
        data = state.data[k].with_fixed_extra(state.result.extra)
        cpu_timer = CpuTimer()
        with cpu_timer("dynamics"):
            std = trial_std(
                state.fitted_skeleton, data, state.result.splines[k], loads, settings.trajectory, sizes=sizes
            )
        by_plates = _torques_of_remainder(fit, wrenches, state.fitted_skeleton)
        frames = _frames_of_remainder(dynamics.motion)
        by_plates = np.sqrt(np.maximum(uniform_filter1d(by_plates**2, frames, axis=0), 0.0))
        np.hypot(std.torque, by_plates, out=std.torque)
        np.hypot(std.power, dynamics.motion.velocity * by_plates, out=std.power)
        if not mask.counts.all():
            std = replace(std, torque_by_motion=std.torque.copy(), power_by_motion=std.power.copy())
        for f, foot in enumerate(contacts.foot_bodies):
            leg = dofs_above(state.fitted_skeleton, foot)
            std.torque[np.ix_(~mask.counts[:, f], leg)] = np.nan
            std.power[np.ix_(~mask.counts[:, f], leg)] = np.nan
        seconds = fit.seconds.get("dynamics", 0.0) + cpu_timer.seconds["dynamics"]
        trials[i] = replace(fit, std=std, seconds=fit.seconds | {"dynamics": seconds})
    return replace(state, trials=tuple(trials))


def error_sizes(subject: Subject) -> ErrorSizes:
    """Of a subject whose own model, if there is one, is taken to be right."""
    return ErrorSizes() if subject.model is None else ErrorSizes(landmarks_m=0.0)


def loads_of(
    fit: TrialFit, extra: TrialExtension | None, x: Float[np.ndarray, " extra"]
) -> tuple[Float[np.ndarray, "frames feet 6"], list[BodyLoad]]:
    """Wrenches on the feet, measured or predicted, that a trial's torques are under; all loads on bodies.

    Args:
        fit: with dynamics.
        extra: what acts beside the recorded forces.
        x: its parameters.
    """
    assert fit.contacts is not None
    assert fit.mask is not None
    assert fit.dynamics is not None
    wrenches = counted_wrenches(fit.contacts.wrench_ground, fit.mask)
    if fit.dynamics.wrench_predicted_ground is not None:
        wrenches = wrenches + fit.dynamics.wrench_predicted_ground
    loads: list[BodyLoad] = [(foot, wrenches[:, f]) for f, foot in enumerate(fit.contacts.foot_bodies)]
    return wrenches, [*loads, *(extra.loads(x) if extra is not None else [])]


def torque_errors_by_plates(
    fit: TrialFit, wrenches_ground: Float[np.ndarray, "frames feet 6"], skeleton: Skeleton, frame: int
) -> Float[np.ndarray, "dofs errors"]:
    """Of a frame's torques, if the residual wrench around it is an error of the plates; a column each.

    Args:
        fit: with dynamics.
        wrenches_ground: on its feet.
        skeleton: of the fit.
        frame: of the trial.
    """
    assert fit.dynamics is not None
    motion = fit.dynamics.motion
    frames = _frames_of_remainder(motion)
    weights = np.zeros(motion.frames)
    for k in range(frame - frames // 2, frame - frames // 2 + frames):
        weights[min(-1 - k if k < 0 else k, 2 * motion.frames - 1 - k)] += 1 / frames  # as the filter's ends
    near = np.flatnonzero(weights)
    errors = _torques_of_remainder(fit, wrenches_ground, skeleton)[near]
    return np.asarray((errors * np.sqrt(weights[near, None])).T)


def _frames_of_remainder(motion: Motion) -> int:
    return max(1, round(REMAINDER_S * motion.rate))


def _torques_of_remainder(
    fit: TrialFit, wrenches_ground: Float[np.ndarray, "frames feet 6"], skeleton: Skeleton
) -> Float[np.ndarray, "frames dofs"]:
    """What torques would change if the residual wrench were an error of the plates.

    Each foot's in proportion to its load; none where a force is missing.
    """
    dynamics, contacts = fit.dynamics, fit.contacts
    assert dynamics is not None
    assert contacts is not None
    load = np.maximum(wrenches_ground[:, :, 1], 0.0)
    total = load.sum(axis=1, keepdims=True)
    share = np.divide(load, total, out=np.zeros_like(load), where=total > 0)
    residual_root = np.where(fit.forces_known[:, None], dynamics.residual_root, 0.0)
    residual_ground = about_point(residual_root, -dynamics.root_ground)
    q, model = dynamics.motion.q, RigidBodyModel(skeleton)
    rest, feet = np.zeros_like(q), [skeleton.body_index(name) for name in contacts.foot_bodies]
    moved = model.inverse_dynamics(q, rest, rest, share[:, :, None] * residual_ground[:, None], feet)
    return moved - model.inverse_dynamics(q, rest, rest)


def with_dynamics(
    fit: TrialFit,
    skeleton: Skeleton,
    settings: Settings,
    *,
    extra: TrialExtension | None = None,
    x: Float[np.ndarray, " extra"] | None = None,
    predicted_ground: Float[np.ndarray, "frames 6"] | None = None,
) -> TrialFit:
    """Torques and residuals; a trajectory that was fitted to forces needs no filter any more.

    Args:
        fit: with contacts and mask, or it stays as it is.
        skeleton: with fitted inertias.
        settings: of every stage.
        extra: what acts in the trial beside the recorded forces.
        x: its parameters.
        predicted_ground: wrench of all feet [N, N·m about the ground origin] for frames where one is missing;
            None: what the motion demands. On a trial without any force that counts it is predicted here, and
            the motion is smoother; where the motion cannot tell forces, there are no torques.
    """
    if fit.contacts is None or fit.mask is None or (fit.why_not_predicted and not fit.mask.counts.any()):
        return fit
    cpu_timer, notes = CpuTimer(), fit.notes
    with cpu_timer("dynamics"):
        motion = fit.motion if fit.kinematics_only else filter_as_forces(fit.motion, settings)
        dynamics = under_forces(fit, motion, skeleton, settings)
        if not fit.mask.counts.any():
            predicted_ground = _predicted_by_motion(dynamics, settings)
            dynamics = under_forces(fit, without_noise(fit.motion, settings), skeleton, settings)
            notes += _which_foot(dynamics, fit, predicted_ground, skeleton, settings)
        acting: list[BodyLoad] = []
        if extra is not None and x is not None:
            dynamics, acting = with_extra_wrench(dynamics, extra, x), extra.loads(x)
        dynamics = with_joint_torques(
            skeleton, dynamics, fit.contacts, fit.mask, predicted_ground, acting=acting
        )
    seconds = fit.seconds.get("dynamics", 0.0) + cpu_timer.seconds["dynamics"]
    return replace(fit, dynamics=dynamics, notes=notes, seconds=fit.seconds | {"dynamics": seconds})


def filter_as_forces(motion: Motion, settings: Settings) -> Motion:
    """The motion after the filter that the forces pass."""
    return motion.low_passed(shared_cutoff(motion.rate, settings.conditioning), settings.conditioning.order)


def without_noise(motion: Motion, settings: Settings) -> Motion:
    """The motion of a trial on which no force counts, as its torques take it."""
    return motion.low_passed(settings.dynamics.unmeasured_cutoff_Hz, settings.conditioning.order)


def _predicted_by_motion(dynamics: Dynamics, settings: Settings) -> Float[np.ndarray, "frames 6"]:
    """Wrench of all feet [N, N·m about the ground origin]: no force was counted, so the residual is all."""
    demand_ground = about_point(dynamics.residual_root, -dynamics.root_ground)
    return predict_ground_forces(
        demand_ground,
        dynamics.com_ground,
        dynamics.motion.rate,
        cutoff_Hz=settings.dynamics.unmeasured_cutoff_Hz,
    ).wrench_ground


def _which_foot(
    dynamics: Dynamics,
    fit: TrialFit,
    wrench_ground: Float[np.ndarray, "frames 6"],
    skeleton: Skeleton,
    settings: Settings,
) -> tuple[Note, ...]:
    """A note where the predicted force passes far from every sole, so that no foot is its obvious bearer."""
    assert fit.contacts is not None
    apart = distances_to_soles(skeleton, fit.contacts.foot_bodies, dynamics.motion.q, wrench_ground)
    carrying = wrench_ground[:, 1] > UNSURE_LOAD * skeleton.mass * np.linalg.norm(skeleton.gravity)
    unsure = carrying & (apart.min(axis=1) > UNSURE_FOOT_M)
    ends = min(settings.dynamics.end_frames, len(unsure) // 4)
    unsure[:ends] = unsure[len(unsure) - ends :] = False
    if unsure.sum() < NOTABLE_SHARE * len(unsure):
        return ()
    return noted(
        Kind.OTHER,
        f"on {100 * unsure.mean():.0f} % of the frames the predicted force acts on the floor more than "
        f"{100 * UNSURE_FOOT_M:.0f} cm outside every sole: it is uncertain there which foot carries it, or "
        "whether something else does, and so are the torques",
    )
