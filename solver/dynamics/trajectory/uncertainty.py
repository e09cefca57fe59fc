"""How far angles, speeds, torques may be off: standard deviations per frame, from the factor of the fit.

Four errors add up. *Noise*: what the fit's own weights say, the spline's coefficients having the covariance
A⁻¹. *Skin*: markers that sit elsewhere on their segment than the model has them, and move there as the joints
turn, by the trial's own slow level. *Landmarks*: all markers of a segment off together, as on a body that is
not the person's. *Tables*: masses, centres of mass and inertias of segments. The first three are drawn: with
A = UᵀU, U⁻¹ z is noise, and errors δ of the markers move the spline by A⁻¹ Jᵀ W δ (parameters that are
considered, not estimated: Schmidt 1966). How large each error is was learnt from simulated people. Not in it:
errors of the plates and of the model's joints.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import gaussian_filter1d

from solver.common.filters import low_pass
from solver.common.frames_at_once import joined
from solver.common.one_thread import one_thread
from solver.dynamics.dynamics import BodyLoad, MassStd, TrialStd
from solver.dynamics.inertia_parameters import PER_BODY, inertia_parameters, prior_std, required_wrench
from solver.dynamics.material_acceleration import material_accelerations
from solver.dynamics.trajectory.block_tridiagonal import BandCholesky
from solver.dynamics.trajectory.frame_spans import Span, windows
from solver.dynamics.trajectory.spline_basis import SplineBasis
from solver.dynamics.trajectory.terms.markers import Markers, SubtreeTerms
from solver.dynamics.trajectory.terms.priors import PosePull, masses_by_phi
from solver.dynamics.trajectory.terms.term import SharedParameters
from solver.dynamics.trajectory.trajectory_search import Border
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trajectory_solver import TrialCost, knot_spacing, trial_levels
from solver.dynamics.trajectory.trial_data import TrialData
from solver.kinematics.frame_solver import LUMBAR, pelvis_is_bare, pose_precision, root_dofs
from solver.kinematics.settings import KinematicsSettings
from solver.kinematics.unseen_bodies import undetermined_dofs
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.skeleton import Skeleton

DRAWS = 48  # a standard deviation is right to a tenth
FASTEST_HZ = 20.0  # what is faster is not told: simulated people ring with their splines' knots there
LEAST_TURNING_RAD = 1e-3  # of a joint that moves at all
LEAST_RADIUS_M = 0.05  # of a segment's markers about their centre, where few of them tell it
BACK_SHARE = 0.5  # of the trunk's lean: as likely the back's as the hips', where no marker is on the pelvis
BACK_STD_RAD = 0.035  # 2°: by as much a back bends and stretches in gait, where nobody leans
LEAST_PULL = 1e-6  # that frames without markers have an answer
STATES = 3  # q, q̇ and q̈
TORQUE = 3  # place in `TrialStd`
SEGMENT_MASS_SCATTER = 0.06  # of people about tables: 3 to 10 %
WINDOW_FRAMES, OVERLAP_FRAMES = 320, 96  # worked out together: draws take a hundred times a motion's memory


@dataclass(frozen=True)
class ErrorSizes:
    """How large each error is, by `benchmarks/truth/band_sizes.py`."""

    noise: float = 0.9  # of the standard deviation that the fit's weights say
    skin: float = 1.0  # of the slow level of a segment's markers
    landmarks_m: float = 0.0029  # of all markers of a segment together, each way
    tables: float = 0.53  # of the scatter of segments' masses, centres and inertias that the settings say


def trial_std(
    skeleton: Skeleton,
    data: TrialData,
    spline: Float[np.ndarray, "coefficients dofs"],
    loads: Sequence[BodyLoad],
    settings: TrajectorySettings,
    *,
    sizes: ErrorSizes,
) -> TrialStd:
    """Of a trial where the fit ended, window by window.

    Args:
        skeleton: with fitted inertias, which count as known.
        data: that the trial was fitted to, without free columns.
        spline: the motion.
        loads: that the torques are under.
        settings: of the fit.
        sizes: of the errors.
    """
    data = _near_the_end(skeleton, data, spline, settings)
    own_windows = std_windows(data, settings)
    with one_thread():
        parts = [_linear(skeleton, data, loads, settings, window).std(sizes) for window in own_windows]
    std = [
        joined([part[k] for part in parts], [window.start for window in own_windows])
        for k in range(len(parts[0]))
    ]
    for of_dofs in std[:-1]:
        of_dofs[:, undetermined_dofs(skeleton, data.observed_ground)] = np.nan
    return TrialStd(*std)


def torque_errors(
    skeleton: Skeleton,
    data: TrialData,
    spline: Float[np.ndarray, "coefficients dofs"],
    loads: Sequence[BodyLoad],
    settings: TrajectorySettings,
    *,
    sizes: ErrorSizes,
    frame: int,
) -> Float[np.ndarray, "dofs errors"]:
    """Independent errors of one frame's torques, a column each: E Eᵀ is what `trial_std` has the diagonal of.

    Arguments as of `trial_std`; of two windows that share the frame the one that reaches farther around it.
    """
    data = _near_the_end(skeleton, data, spline, settings)
    window = max(std_windows(data, settings), key=lambda own: min(frame - own.start, own.end - 1 - frame))
    with one_thread():
        return _linear(skeleton, data, loads, settings, window).torque_errors(sizes, frame - window.start)


def std_windows(data: TrialData, settings: TrajectorySettings) -> list[Span]:
    """Stretches of a trial that are worked out by themselves."""
    short = replace(settings, window_frames=WINDOW_FRAMES, overlap_frames=OVERLAP_FRAMES)
    return windows(0, len(data.counts), knot_spacing(data.start, settings), short)


def _near_the_end(
    skeleton: Skeleton,
    data: TrialData,
    spline: Float[np.ndarray, "coefficients dofs"],
    settings: TrajectorySettings,
) -> TrialData:
    kinematics = ForwardKinematics(skeleton)
    levels = data.levels or trial_levels(kinematics, data.observed_ground, data.start, settings)
    return replace(data, levels=levels, spline=spline)


def _linear(
    skeleton: Skeleton, data: TrialData, loads: Sequence[BodyLoad], settings: TrajectorySettings, window: Span
) -> "_Linear":
    own = data.part(window.start, window.end, knot_spacing(data.start, settings))
    acting = [(body, wrench[window.start : window.end]) for body, wrench in loads]
    return _Linear(skeleton, own, acting, replace(settings, fit_inertias=False))


def mass_std(border: Border, body_std: float, settings: TrajectorySettings) -> MassStd:
    """Of the masses where a fit ended, by its border.

    With S the curvature, D the data's part of it, P the tables' and Σ how far people are from tables: the
    covariance of φ is S⁻¹ (o D + P Σ P) S⁻¹. Data overrate what they say of inertias by o, by which the
    tables' weight is more than that of a short recording with errors of the fit's own size. The body's mass
    and the plates' gains err together, which no residual shows: that scales all masses.

    Args:
        border: of the fit.
        body_std: of the mass that the fit was given, relative.
        settings: of the fit.
    """
    at, priors = border.at, border.priors
    inertias, free = at.inertias, at.free_inertias
    by_tables = prior_std(inertias, settings)
    overrated = priors.cautious.precision[0] * by_tables[0] ** 2
    by_tables[PER_BODY - 1 :: PER_BODY] = SEGMENT_MASS_SCATTER / 2
    prior_errors = priors.of_extra.curvature(at)
    prior_errors[:free, :free] += np.diag((priors.cautious.precision * by_tables) ** 2)
    held = priors.cautious.curvature(at) + priors.of_extra.curvature(at)
    by_phi = masses_by_phi(at)
    mass = np.array([body.mass for body in at.skeleton.bodies])
    kept = np.where(inertias.group < 0, SEGMENT_MASS_SCATTER * mass, 0.0)

    def std(curvature: Float[np.ndarray, "shared shared"]) -> Float[np.ndarray, " bodies_and_whole"]:
        errors = overrated * (curvature - held) + prior_errors
        rows = np.vstack([by_phi, by_phi.sum(axis=0)]) @ np.linalg.inv(curvature)[:free]
        own = np.sqrt(np.einsum("bi,ij,bj->b", rows, errors, rows))
        return np.hypot(np.hypot(own, [*kept, 0.0]), body_std * np.array([*mass, mass.sum()]))

    told = std(border.curvature)
    return MassStd(float(told[-1]), told[:-1], std(held)[:-1])


def dofs_above(skeleton: Skeleton, body_name: str) -> Bool[np.ndarray, " dofs"]:
    """Whether a wrench on the body takes part in a dof's torque."""
    body, moving = skeleton.body_index(body_name), set[str | None]()
    while body >= 0:
        moving |= {axis.coordinate for axis in skeleton.joints[body].axes}
        body = skeleton.joints[body].parent
    driving = {c.coupled_to for c in skeleton.coordinates if c.name in moving}
    return np.array([dof in moving | driving for dof in skeleton.dofs])


class _Linear:
    """A trial near its solution: how errors move the spline, and how that moves everything else."""

    def __init__(
        self, skeleton: Skeleton, data: TrialData, loads: Sequence[BodyLoad], settings: TrajectorySettings
    ) -> None:
        cost = TrialCost(skeleton, data, settings)
        assert data.spline is not None
        assert data.levels is not None
        self.markers = next(term for term in cost.terms if isinstance(term, Markers))
        self.settings = settings
        self.slow_m = data.levels.marker_errors.slow_m
        self.lasts_s = data.levels.marker_errors.lasts_s if data.by_video else None
        self.pull = next(term for term in cost.terms if isinstance(term, PosePull))
        inertias = inertia_parameters(skeleton)
        known = SharedParameters(inertias, np.zeros(inertias.count), np.zeros(0), inertias_free=False)
        self.point = cost.point(data.spline, known)
        self.basis: SplineBasis = cost.basis
        self.factor: BandCholesky = cost.linearized(self.point).band.factorized_in_place()
        q, v, a = (self.basis.evaluate(data.spline, order) for order in range(STATES))
        body = known.rigid_bodies
        wrenches = np.stack([np.zeros((len(q), 6)), *(wrench for _, wrench in loads)], axis=1)
        bodies = [0, *(skeleton.body_index(name) for name, _ in loads)]
        self.torque_rows = body.inverse_dynamics_derivatives(q, v, a, wrenches, bodies)
        self.com_rows = body.centre_of_mass_jacobian(q)
        self.speed, self.torque = v, body.inverse_dynamics(q, v, a, wrenches, bodies)

    def std(self, sizes: ErrorSizes) -> list[Float[np.ndarray, "frames some"]]:
        """In the order of `TrialStd`."""
        variances = [np.mean(of**2, axis=2) for of in self._drawn(sizes)]
        by_tables = sizes.tables**2 * (self._by_tables() ** 2).sum(axis=2)
        variances[TORQUE] += by_tables
        variances[TORQUE + 1] += self.speed**2 * by_tables
        return [np.sqrt(variance) for variance in variances]

    def torque_errors(self, sizes: ErrorSizes, frame: int) -> Float[np.ndarray, "dofs errors"]:
        """Of a frame's torques: by draws, and by each number of the tables."""
        by_draws = self._drawn(sizes)[TORQUE][frame] / np.sqrt(DRAWS)
        return np.hstack([by_draws, sizes.tables * self._by_tables()[frame]])

    def _drawn(self, sizes: ErrorSizes) -> list[Float[np.ndarray, "frames some draws"]]:
        """Errors by markers, in the order of `TrialStd`."""
        rng = np.random.default_rng(0)
        errors = [self._marker_errors(rng, sizes) for _ in range(DRAWS)]
        pulls = self.markers.pulls_of_errors(self.point, errors)
        if self.lasts_s is not None:
            pulls += self.pull.pulls_of_errors(self.point, self._of_marker_fit(errors))
        if pelvis_is_bare(self.point.kinematics.skeleton):
            pulls += self.pull.pulls_of_errors(self.point, self._back_errors(rng))
        half = self.factor.half_solve_in_place(pulls)
        half += sizes.noise * rng.normal(size=half.shape)  # U⁻¹ of it has the covariance A⁻¹
        return self._moved(self.factor.back_solve(half))

    def _moved(
        self, splines: Float[np.ndarray, "coefficients dofs draws"]
    ) -> list[Float[np.ndarray, "frames some draws"]]:
        """By what spline coefficients change below 20 Hz: everything that `TrialStd` has, in its order."""
        frames, dofs = self.point.q.shape
        flat, rate = splines.reshape(len(splines), -1), self.basis.rate
        states = (low_pass(self.basis.evaluate(flat, order), rate, FASTEST_HZ) for order in range(STATES))
        q, v, a = (of.reshape(frames, dofs, -1) for of in states)
        torque = self.torque_rows.reshape(frames, dofs, -1) @ np.concatenate([q, v, a], axis=1)
        power = self.speed[:, :, None] * torque + self.torque[:, :, None] * v
        return [q - q.mean(axis=0), v, a, torque, power, self.com_rows @ q]

    def _by_tables(self) -> Float[np.ndarray, "frames dofs parameters"]:
        """Of torques, by what tables leave open of segments' masses, centres of mass and inertias."""
        point, inertias = self.point, self.point.shared.inertias
        skeleton, frames = inertias.skeleton, self.point.q.shape[0]
        tree = SubtreeTerms(point.kinematics, np.arange(len(skeleton.bodies)))
        scatter = prior_std(inertias, self.settings).reshape(-1, PER_BODY)
        by_phi = inertias.derivatives(np.zeros(inertias.count))
        by_torque = np.zeros((frames, tree.axes, *scatter.shape))
        for states in point.chunks:
            A, T = material_accelerations(point.kinematics, states.poses, states.q, states.v, states.a)
            wrench = np.roll(required_wrench(A, T, by_phi), 3, axis=3)  # moment first, as the twists
            S, own = tree.twists(states.poses), by_torque[states.frames]
            for body, group in enumerate(inertias.group):
                if group >= 0:
                    moved = S @ wrench[:, body].transpose(0, 2, 1)
                    own[:, :, group] += tree.carried[:, body, None] * moved * scatter[group]
        for axis, dof in enumerate(tree.extra_dof, tree.dofs):
            by_torque[:, dof] += by_torque[:, axis]
        return by_torque[:, : tree.dofs].reshape(frames, tree.dofs, -1)

    def _marker_errors(
        self, rng: np.random.Generator, sizes: ErrorSizes
    ) -> Float[np.ndarray, "frames markers 3"]:
        """One draw of skin and landmarks.

        A marker sits elsewhere on its segment by the segment's slow level, and moves there by as much, as a
        mixture of the joints' angles does; where a video sees it, as something that forgets.
        """
        markers, joints = len(self.slow_m), self._turning.shape[1]
        if self.lasts_s is None:
            mixture = rng.normal(size=(joints, 3 * markers)) / np.sqrt(max(1, joints))
            moved = (self._turning @ mixture).reshape(-1, 3, markers)
        else:
            moved = self._wandering(rng, self.lasts_s).reshape(-1, 3, markers)
        moved += rng.normal(size=(3, markers))
        moved *= sizes.skin * self.slow_m
        if sizes.landmarks_m:
            moved += sizes.landmarks_m * self._with_segments(rng)
        off = (self._R_ground_segment * moved[:, None]).sum(axis=2)
        return off.transpose(0, 2, 1)

    def _of_marker_fit(
        self, errors_ground: Sequence[Float[np.ndarray, "frames markers 3"]]
    ) -> Float[np.ndarray, "frames dofs errors"]:
        """Where the marker fit, to which the motion is pulled, goes with markers that are so far off."""
        skeleton, precision, moved = self.point.kinematics.skeleton, KinematicsSettings.marker_std_m**-2, []
        pull = pose_precision(skeleton, KinematicsSettings.pose_std_rad)
        for states in self.point.chunks:
            S, x = self.markers.tree.twists(states.poses), self.point.kinematics.markers(states.poses)
            weight = precision * self.markers.seen[states.frames]
            H = self.markers.tree.same_frame(S, x, weight) + np.diag(pull + LEAST_PULL)
            g = [
                self.markers.tree.gradient(S, x, weight[:, :, None] * e[states.frames]) for e in errors_ground
            ]
            moved.append(np.linalg.solve(H, np.stack(g, axis=2)))
        return np.concatenate(moved)

    def _wandering(self, rng: np.random.Generator, lasts_s: float) -> Float[np.ndarray, "frames coordinates"]:
        """Of unit size, with correlation exp(−(t/lasts)²/2)."""
        width = lasts_s / np.sqrt(2) * self.basis.rate
        beyond = int(np.ceil(4 * width))
        white = rng.normal(size=(len(self.point.q) + 2 * beyond, 3 * len(self.slow_m)))
        smooth = gaussian_filter1d(white, width, axis=0)[beyond : len(white) - beyond]
        return smooth * np.sqrt(2 * np.sqrt(np.pi) * width)

    def _back_errors(self, rng: np.random.Generator) -> Float[np.ndarray, "frames dofs draws"]:
        """Of a back whose share of the trunk's lean no marker shows, where the fit holds it upright."""
        dofs = self.point.kinematics.skeleton.dofs
        lumbar = dofs.index(LUMBAR)
        lean = self.point.q[:, lumbar] + self.point.q[:, dofs.index("pelvis_tilt")]
        joints = self._turning.shape[1]
        mixture = BACK_STD_RAD * rng.normal(size=(joints, DRAWS)) / np.sqrt(max(1, joints))
        errors = np.zeros((*self.point.q.shape, DRAWS))
        errors[:, lumbar] = self._turning @ mixture
        errors[:, lumbar] += BACK_SHARE * np.outer(lean - lean.mean(), rng.normal(size=DRAWS))
        return errors

    def _with_segments(self, rng: np.random.Generator) -> Float[np.ndarray, "3 markers"]:
        """Every segment's markers one metre off together, and turned about their centre by as much."""
        segments, arms = self._arms
        together, turned = rng.normal(size=(2, len(segments), 3))[:, segments]
        return (together + np.cross(turned, arms)).T

    @cached_property
    def _arms(self) -> tuple[Int[np.ndarray, " markers"], Float[np.ndarray, "markers 3"]]:
        """By marker: its segment, counted among those with markers, and its arm in the segment's radii."""
        kinematics = self.point.kinematics
        _, segments = np.unique(kinematics.marker_bodies, return_inverse=True)
        arms = np.stack([marker.position_body for marker in kinematics.skeleton.markers])
        for segment in range(segments.max() + 1):
            own = segments == segment
            arms[own] -= arms[own].mean(axis=0)
            arms[own] /= max(LEAST_RADIUS_M, float(np.sqrt((arms[own] ** 2).sum(axis=1).mean())))
        return segments, arms

    @cached_property
    def _turning(self) -> Float[np.ndarray, "frames joints"]:
        """The joints' angles, each of unit size about its mean; those that rest left out."""
        q = self.point.q[:, ~root_dofs(self.point.kinematics.skeleton)]
        turning = q - q.mean(axis=0)
        size = turning.std(axis=0)
        return turning[:, size > LEAST_TURNING_RAD] / size[size > LEAST_TURNING_RAD]

    @cached_property
    def _R_ground_segment(self) -> Float[np.ndarray, "frames 3 3 markers"]:
        bodies = self.point.kinematics.marker_bodies
        R = [states.poses.R_ground_body[:, bodies] for states in self.point.chunks]
        return np.ascontiguousarray(np.concatenate(R).transpose(0, 2, 3, 1))
