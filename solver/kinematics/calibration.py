"""Scale factors and marker offsets: one sparse least-squares problem over poses from all trials.

Unknown are the pose of every calibration frame and, shared by all frames, the log scale factors (left and
right tied) and the marker offsets. The poses are eliminated (Schur complement); what remains is dense and
small. Robust loss; priors as in `scale_prior`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.linalg import block_diag

from solver.common.notes import Kind, Note, noted
from solver.common.one_thread import one_thread
from solver.common.progress import Progress, silent
from solver.kinematics.frame_solver import PoseProblem, initial_poses, solve_frames
from solver.kinematics.root_joint import root_joint
from solver.kinematics.scale_prior import (
    LogScalePrior,
    ScaleGroups,
    ScaleJacobian,
    log_scale_precision,
    offset_std,
    scale_groups,
    stature,
)
from solver.kinematics.settings import (
    CALIBRATION_ROBUST_SCALE_M,
    CLUSTER_OFFSET_STD_M,
    EFFECTIVE_FRAMES,
    KinematicsSettings,
)
from solver.skeleton.forward import marker_jacobian
from solver.skeleton.scaling import with_offsets
from solver.skeleton.skeleton import Skeleton

EFFECTIVE_STATIC_FRAMES = 1.0  # [frames] one quiet stance is one sample, without motion artefact
# [m] of the distance that regressions expect between the hips: 7 mm a side, both sides of a pelvis alike
# (Mantovani 2016), and 11 mm because each spine is palpated within 12 mm
HIP_WIDTH_STD_M = 0.018
# [rad] 1°: how the spines' markers are pitched in the default body's pelvis is decided beforehand, between
# bone and posture; free once more, they turn by 9° to suit a trunk that is not the model's
SPINES_PITCH_STD_RAD = 0.017
# [log] the same against the pelvis' own width, where no spines are seen that a regression could go by
HIPS_ON_PELVIS_STD = 0.08

MAX_STEPS = 40
CONVERGED = 1e-4  # relative decrease of the cost
KEPT_PRECISION = 1e12  # of log scales that stay: they move by nothing that shows
FREE_HIPS_STD = 0.5  # log: where the hips' distance is expected by itself, the pelvis' width has no say in it


@dataclass(frozen=True)
class Shared:
    """What all frames have in common."""

    log_scale: Float[np.ndarray, " scales"]
    offsets: Float[np.ndarray, "markers 3"]  # [m] added to the scaled model's marker positions

    @property
    def vector(self) -> Float[np.ndarray, " parameters"]:
        """Scales, then offsets."""
        return np.concatenate([self.log_scale, self.offsets.ravel()])

    def moved(self, step: Float[np.ndarray, " parameters"]) -> "Shared":
        """By a step of that vector."""
        scales = len(self.log_scale)
        return Shared(self.log_scale + step[:scales], self.offsets + step[scales:].reshape(-1, 3))

    def skeleton(self, generic: Skeleton, groups: ScaleGroups, mass_kg: float | None = None) -> Skeleton:
        """The unscaled skeleton with these; with `mass_kg`, of that mass [kg]."""
        return with_offsets(groups.resized(generic, self.log_scale, mass_kg), self.offsets)


@dataclass(frozen=True)
class SharedPrior:
    """Gaussian, of scales and offsets: what is known of them before a marker is seen."""

    mean: Shared
    precision: Float[np.ndarray, "parameters parameters"]


@dataclass(frozen=True)
class Calibration:
    """The scaled skeleton, and how it came about."""

    skeleton: Skeleton
    shared: Shared
    prior: SharedPrior
    notes: tuple[Note, ...]
    solver: "BorderedSolver"
    q: Float[np.ndarray, "frames dofs"]  # of the frames [rad or m]

    @property
    def factors(self) -> Float[np.ndarray, "bodies 3"]:
        """Scale factors along the axes of each body."""
        return self.solver.groups.factors(self.shared.log_scale)


@dataclass(frozen=True)
class Evidence:
    """Half the cost of some frames about a place, their poses eliminated: gᵀδ + ½ δᵀAδ."""

    gradient: Float[np.ndarray, " parameters"]
    precision: Float[np.ndarray, "parameters parameters"]

    def beside(self, other: "Evidence", share: float) -> "Evidence":
        """Of both, this one's share and the other's that is left."""
        return Evidence(
            share * self.gradient + (1 - share) * other.gradient,
            share * self.precision + (1 - share) * other.precision,
        )

    def seen_from(self, step: Float[np.ndarray, " parameters"]) -> "Evidence":
        """The same about a place so far away."""
        return Evidence(self.gradient + self.precision @ step, self.precision)


@dataclass(frozen=True)
class CalibrationFrames:
    """Measured markers of the frames that decide the calibration, and what each counts."""

    observed_ground: Float[np.ndarray, "frames markers 3"]
    weight: Float[np.ndarray, " frames"]
    places: tuple[Int[np.ndarray, " chosen"], ...] = ()  # by trial, which frames of it; static ones come last
    start_q: Float[np.ndarray, "frames dofs"] | None = None  # [rad or m] where searches for poses may begin

    def some(self, which: slice | Bool[np.ndarray, " frames"]) -> "CalibrationFrames":
        """A part of them."""
        return CalibrationFrames(self.observed_ground[which], self.weight[which])


def choose_frames(
    trials: Sequence[Float[np.ndarray, "frames markers 3"]],
    static: Float[np.ndarray, "frames markers 3"] | None,
    settings: KinematicsSettings,
) -> CalibrationFrames:
    """Well-seen frames, evenly over the trials' time, and a few static ones."""
    seen = [np.isfinite(t).all(axis=2).sum(axis=1) for t in trials]
    enough = [s >= 0.8 * max(1, s.max(initial=0)) for s in seen]
    total = max(1, sum(int(e.sum()) for e in enough))
    places = []
    for well in enough:
        candidates = np.flatnonzero(well)
        share = min(len(candidates), max(4, round(settings.calibration_frames * len(candidates) / total)))
        places.append(_spread(candidates, share))
    chosen = [trial[some] for trial, some in zip(trials, places, strict=True)]
    moving = sum(len(c) for c in chosen)
    weight = [np.full(moving, EFFECTIVE_FRAMES / max(1, moving))]
    if static is not None:
        quiet = static[_spread(np.arange(len(static)), 5)]
        chosen.append(quiet)
        weight.append(np.full(len(quiet), EFFECTIVE_STATIC_FRAMES / len(quiet)))
    return CalibrationFrames(np.concatenate(chosen), np.concatenate(weight), tuple(places))


def _spread(candidates: Int[np.ndarray, " candidates"], count: int) -> Int[np.ndarray, " chosen"]:
    """`count` of the candidates, evenly spaced."""
    if not len(candidates):
        return candidates
    return candidates[
        np.unique(np.linspace(0, len(candidates) - 1, min(count, len(candidates))).round().astype(int))
    ]


def calibrate(
    generic: Skeleton,
    frames: CalibrationFrames,
    settings: KinematicsSettings,
    *,
    height_m: float | None = None,
    mass_kg: float | None = None,
    hip_width_m: float | None = None,
    pitch_of_spines: Float[np.ndarray, "markers 3"] | None = None,
    registered_std: Float[np.ndarray, " markers"] | None = None,
    progress: Progress = silent,
) -> Calibration:
    """Fit scale factors and marker offsets.

    Args:
        generic: unscaled; its markers are those of the frames, in the same order.
        frames: measured markers.
        settings: weights and thresholds.
        height_m: of the subject; None widens the prior of body size.
        mass_kg: of the subject; None keeps the model's.
        hip_width_m: distance of the hip centres that regressions expect; None where nothing tells.
        pitch_of_spines: turn of the spines' line in the pelvis as the markers move [rad/m], where that has
            been decided and stays; None where it is free.
        registered_std: of a model that is this person's own, which keeps its scales: how far each marker may
            lie from the model's place for it [m]; None where the model is to be scaled.
        progress: told the fraction done; may raise `Cancelled`.
    """
    with one_thread():
        groups = scale_groups(generic)
        kept = registered_std is not None
        sized = height_m is not None and stature(generic) is not None and not kept
        mean = _log_scale_for(height_m if sized else None, generic, groups)
        size_std = settings.height_scale_std if sized else settings.scale_std
        on_pelvis = HIPS_ON_PELVIS_STD if hip_width_m is None else FREE_HIPS_STD
        prior = LogScalePrior(mean, log_scale_precision(groups, size_std, hips_std=on_pelvis))
        if kept:
            prior = LogScalePrior(mean, KEPT_PRECISION * np.eye(len(mean)))
        elif hip_width_m is not None and groups.hips is not None:
            log_ratio = float(np.log(hip_width_m / groups.hips.width(generic)))
            prior = prior.with_hip_width(groups, log_ratio, HIP_WIDTH_STD_M / hip_width_m)
        of_offsets = _offset_precision(
            offset_std(generic.markers) if registered_std is None else registered_std, pitch_of_spines
        )
        start = Shared(prior.mean.copy(), np.zeros((len(generic.markers), 3)))
        usual = SharedPrior(start, block_diag(prior.precision, of_offsets))
        solver = BorderedSolver(generic, frames, groups, settings)
        progress("scaling", 0.02)
        start_q = frames.start_q
        if start_q is None:
            start_q, _ = start_poses(generic, frames.observed_ground, settings, height_m)
        shared, q = solver.solve(start, start_q, usual, progress)
        if kept:
            shared = Shared(mean, shared.offsets)
        return Calibration(
            skeleton=shared.skeleton(generic, groups, mass_kg),
            shared=shared,
            prior=usual,
            notes=_notes(generic, groups, shared),
            solver=solver,
            q=q,
        )


def start_poses(
    generic: Skeleton,
    observed_ground: Float[np.ndarray, "frames markers 3"],
    settings: KinematicsSettings,
    height_m: float | None = None,
) -> tuple[Float[np.ndarray, "frames dofs"], Float[np.ndarray, " frames"]]:
    """Of a body so tall, by the markers alone: poses [rad or m], their costs; arguments as of `calibrate`."""
    groups = scale_groups(generic)
    sized = groups.resized(generic, _log_scale_for(height_m, generic, groups))
    with one_thread():
        problem = PoseProblem(sized, observed_ground, settings, CALIBRATION_ROBUST_SCALE_M)
        return initial_poses(problem, root_joint(sized), np.arange(len(observed_ground)))


def _log_scale_for(
    height_m: float | None, generic: Skeleton, groups: ScaleGroups
) -> Float[np.ndarray, " scales"]:
    """Scales that make an unscaled skeleton so tall; zero where either height is not known."""
    log_scale, model_height = np.zeros(groups.size), stature(generic)
    if height_m is not None and model_height is not None:
        log_scale[: 3 * groups.count] = np.log(height_m / model_height)
    return log_scale


def _offset_precision(
    std: Float[np.ndarray, " markers"], pitch_of_spines: Float[np.ndarray, "markers 3"] | None
) -> Float[np.ndarray, "offsets offsets"]:
    """Each marker by itself, and the turn of the pelvis' markers together."""
    precision = np.diag(np.repeat(std, 3) ** -2)
    if pitch_of_spines is not None:
        precision += np.outer(pitch_of_spines, pitch_of_spines) / SPINES_PITCH_STD_RAD**2
    return precision


class BorderedSolver:
    """Levenberg-Marquardt on poses and shared parameters together."""

    def __init__(
        self, generic: Skeleton, frames: CalibrationFrames, groups: ScaleGroups, settings: KinematicsSettings
    ) -> None:
        """Of an unscaled skeleton whose markers are those of the frames, in the same order."""
        self.generic, self.frames, self.groups, self.settings = generic, frames, groups, settings

    def evidence(self, shared: Shared, q: Float[np.ndarray, "frames dofs"]) -> Evidence:
        """What the frames say of the shared parameters, about these and near these poses."""
        border, gradient, _, _ = self._reduced(self.problem(shared), q, damping=0.0)
        return Evidence(gradient, border)

    def solve(
        self, shared: Shared, q: Float[np.ndarray, "frames dofs"], prior: SharedPrior, progress: Progress
    ) -> tuple[Shared, Float[np.ndarray, "frames dofs"]]:
        """The least cost from there, and the poses there."""
        every = np.arange(len(q))
        problem = self.problem(shared)
        q, _ = solve_frames(problem, q, every)
        cost = self._cost(problem, q, shared, prior)
        damping = 1e-3
        for iteration in range(MAX_STEPS):
            progress("scaling", 0.1 + 0.9 * iteration / MAX_STEPS)
            step_q, step = self._step(problem, q, shared, prior, damping)
            tried_shared = shared.moved(step)
            tried_problem = self.problem(tried_shared)
            tried_q, _ = solve_frames(tried_problem, q + step_q, every, max_iterations=2)
            tried_cost = self._cost(tried_problem, tried_q, tried_shared, prior)
            if tried_cost >= cost:
                damping *= 10
                if damping > 1e6:
                    break
                continue
            converged = cost - tried_cost < CONVERGED * cost
            shared, q, problem, cost, damping = tried_shared, tried_q, tried_problem, tried_cost, damping / 10
            if converged:
                break
        progress("scaling", 1.0)
        return shared, q

    def problem(self, shared: Shared) -> PoseProblem:
        """The frames' poses at these."""
        return PoseProblem(
            shared.skeleton(self.generic, self.groups),
            self.frames.observed_ground,
            self.settings,
            CALIBRATION_ROBUST_SCALE_M,
        )

    def _cost(
        self, problem: PoseProblem, q: Float[np.ndarray, "frames dofs"], shared: Shared, prior: SharedPrior
    ) -> float:
        deviation = shared.vector - prior.mean.vector
        of_frames = self.frames.weight @ problem.evaluate(q, np.arange(len(q))).cost
        return float(of_frames + deviation @ prior.precision @ deviation)

    def _step(
        self,
        problem: PoseProblem,
        q: Float[np.ndarray, "frames dofs"],
        shared: Shared,
        prior: SharedPrior,
        damping: float,
    ) -> tuple[Float[np.ndarray, "frames dofs"], Float[np.ndarray, " parameters"]]:
        """Solve the border, and substitute back."""
        border, gradient, solved_coupling, solved_g = self._reduced(problem, q, damping)
        border += prior.precision
        gradient += prior.precision @ (shared.vector - prior.mean.vector)
        everything = np.arange(len(border))
        border[everything, everything] *= 1 + damping
        step = -np.linalg.solve(border, gradient)
        return -solved_g - solved_coupling @ step, step

    def _reduced(
        self, problem: PoseProblem, q: Float[np.ndarray, "frames dofs"], damping: float
    ) -> tuple[
        Float[np.ndarray, "parameters parameters"],
        Float[np.ndarray, " parameters"],
        Float[np.ndarray, "frames dofs parameters"],
        Float[np.ndarray, "frames dofs"],
    ]:
        """Eliminate the poses: the border, its gradient, and the poses' solved coupling and gradient."""
        every = np.arange(len(q))
        terms = problem.evaluate(q, every)
        kinematics = problem.kinematics
        poses = kinematics.poses(q)
        x = kinematics.markers(poses)
        error = np.where(problem.seen[:, :, None], x - problem.observed, 0.0)
        squares = (error**2).sum(axis=2)
        weight = problem.seen * self.settings.marker_std_m**-2 / (1 + squares / problem.robust_scale_m**2)
        J_q = marker_jacobian(kinematics, poses, x)
        J_s = ScaleJacobian(kinematics, self.groups).columns(poses, q)
        frames, markers = weight.shape
        J_o = np.zeros((frames, markers, 3, markers, 3))
        own = np.arange(markers)
        J_o[:, own, :, own, :] = poses.R_ground_body[:, kinematics.marker_bodies].transpose(1, 0, 2, 3)
        J = np.concatenate(
            [J_s.reshape(frames, 3 * markers, -1), J_o.reshape(frames, 3 * markers, 3 * markers)], axis=2
        )
        W = np.repeat(weight, 3, axis=1)[:, :, None]
        flat_error = error.reshape(frames, 3 * markers, 1)
        frame_weight = self.frames.weight[:, None, None]
        WJ = frame_weight * W * J
        border = np.einsum("tij,tik->jk", WJ, J, optimize=True)
        gradient = np.einsum("tij,tik->j", WJ, flat_error, optimize=True)
        coupling = (J_q.transpose(0, 2, 1) @ WJ) / frame_weight
        H = terms.H.copy()
        diagonal = np.arange(H.shape[1])
        H[:, diagonal, diagonal] *= 1 + damping
        solved = np.linalg.solve(H, np.concatenate([coupling, terms.g[:, :, None]], axis=2))
        solved_coupling, solved_g = solved[:, :, :-1], solved[:, :, -1]
        border -= np.einsum("t,tij,tik->jk", self.frames.weight, coupling, solved_coupling, optimize=True)
        gradient -= np.einsum("t,tij,ti->j", self.frames.weight, coupling, solved_g, optimize=True)
        return border, gradient, solved_coupling, solved_g


def _notes(generic: Skeleton, groups: ScaleGroups, shared: Shared) -> tuple[Note, ...]:
    """Scales and offsets far from what was expected, named."""
    notes: list[Note] = []
    factors = groups.axes(shared.log_scale)
    for name, factor in zip(groups.names, factors, strict=True):
        if factor.min() < 0.7 or factor.max() > 1.4:
            notes += noted(
                Kind.MODEL_AGAINST_MARKERS,
                f"scale of {name} is unusual: {' × '.join(f'{f:.2f}' for f in factor)}",
            )
    length = np.linalg.norm(shared.offsets, axis=1)
    std = offset_std(generic.markers)
    far = (length > 3 * std) & (std < CLUSTER_OFFSET_STD_M)
    for i in np.flatnonzero(far):
        notes += noted(
            Kind.MODEL_AGAINST_MARKERS,
            f"marker {generic.markers[i].name} is {100 * length[i]:.1f} cm from its usual place on the model",
        )
    return tuple(notes)
