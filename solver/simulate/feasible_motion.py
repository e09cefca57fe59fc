"""From what a movement should look like to a motion that the ground can carry.

Unknown are the coefficients of the motion's spline. Joint angles are wanted as the pattern has them, standing
feet stay put, the wrench required of the ground acts at the wanted centre of pressure, and in flight it is
zero exactly: Gauss-Newton with equality constraints, whose normal equations are banded in time.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.linalg import cho_solve_banded, cholesky_banded, solve_triangular

from solver.common.errors import FitError
from solver.simulate.contacts import ContactPlan
from solver.simulate.ground_demand import GroundDemand
from solver.simulate.simulated_sole import SIDES, Sole
from solver.simulate.spline_motion import ACTIVE, SplineMotion, coefficient_count, local_basis
from solver.skeleton.forward import ForwardKinematics, Poses, cross
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton

PLACE = ("pelvis_tx", "pelvis_ty", "pelvis_tz")


class FootPoints:
    """The points of both feet that stay put in stance: right foot first, in the order of the sole's list."""

    def __init__(self, skeleton: Skeleton, sole: Sole) -> None:
        self.kinematics = ForwardKinematics(skeleton)
        chain = self.kinematics.chain
        self._to_dofs = np.zeros((chain.positions, chain.dofs))
        self._to_dofs[np.arange(chain.positions), chain.dof] = 1.0
        self.body_names = tuple(body for body, _ in sole.planted_points())
        self.flat_sole = np.stack([sole.flat_position(*point) for point in sole.planted_points()])
        self._bodies: list[int] = []
        self._positions: list[np.ndarray] = []
        for side in SIDES:
            for body, position in sole.planted_points():
                self._bodies.append(skeleton.body_index(f"{body}_{side}"))
                self._positions.append(position * ((1, 1, -1) if side == "l" else (1, 1, 1)))

    def positions(self, q: Float[np.ndarray, "times dofs"]) -> Float[np.ndarray, "times feet points 3"]:
        """Positions in the ground frame [m]."""
        return self._positions_in(self.kinematics.poses(q))[0]

    def slopes(
        self, q: Float[np.ndarray, "times dofs"]
    ) -> tuple[Float[np.ndarray, "times feet points 3"], Float[np.ndarray, "times feet points 3 dofs"]]:
        """Positions, and their derivatives by q."""
        poses = self.kinematics.poses(q)
        positions, flat = self._positions_in(poses)
        twists = poses.twists()
        slopes = np.empty((*flat.shape, self._to_dofs.shape[1]))
        for k, body in enumerate(self._bodies):
            columns = np.flatnonzero(self.kinematics.carries[:, body])
            angular, linear = twists[:, columns, :3], twists[:, columns, 3:]
            moves = cross(angular, flat[:, k, None, :]) + linear
            slopes[:, k] = moves.transpose(0, 2, 1) @ self._to_dofs[columns]
        return positions, slopes.reshape(*positions.shape, -1)

    def _positions_in(self, poses: Poses) -> tuple[np.ndarray, np.ndarray]:
        """Positions by foot and point, and in one row."""
        flat = np.stack(
            [
                poses.p_ground_body[:, body] + poses.R_ground_body[:, body] @ position
                for body, position in zip(self._bodies, self._positions, strict=True)
            ],
            axis=1,
        )
        return flat.reshape(len(flat), len(SIDES), -1, 3), flat


@dataclass(frozen=True)
class Wish:
    """What the motion should look like, at times that increase about evenly."""

    times: Float[np.ndarray, " times"]  # [s]
    q: Float[np.ndarray, "times dofs"]  # [rad or m]
    tolerance: Float[np.ndarray, " dofs"]  # [rad or m]
    contacts: ContactPlan
    force: Float[np.ndarray, "times 3"]  # [N] from the ground in all
    force_tolerance: float  # body weights
    external: Float[np.ndarray, "times 6"] | None = (
        None  # [N, N·m about the ground origin] not from the ground
    )


@dataclass(frozen=True)
class FitSettings:
    """Tolerances of the fit, as standard deviations."""

    planted: float = 0.0005  # [m] what a foot under load may move
    cop: float = 0.004  # [m] times the load: the arm of the demand about the wanted centre of pressure
    least_force: float = 0.002  # body weights, and
    least_moment: float = 0.05  # [N·m]: tolerances where the load vanishes
    clearance: float = 0.010  # [m] least height of a swinging foot's points, away from contact and lift-off
    clearance_ramp: float = 0.12  # [s] over which it grows
    clearance_tolerance: float = 0.002  # [m]
    jerk_joint: float = 2500.0  # [rad/s³] a running knee reaches about 3000
    jerk_root: float = 150.0  # [m/s³]
    iterations: int = 15
    converged: float = 1e-3  # relative decrease of the cost
    flight: float = 1e-8  # [N, N·m] largest demand left in flight
    price: float = 10.0  # of flight's demand [1/N] against the cost, in choosing the step length


QUICK = FitSettings(jerk_joint=15000.0, jerk_root=800.0)  # a sprinting leg, a landing


def fit_trajectory(
    wish: Wish,
    model: RigidBodyModel,
    spacing: float,
    settings: FitSettings | None = None,
    start: SplineMotion | None = None,
) -> SplineMotion:
    """The motion nearest to the wish.

    Args:
        wish: its times should be at least twice as dense as the knots.
        model: of the skeleton that moves.
        spacing: [s] between knots.
        settings: tolerances.
        start: a motion for nearly the same wish, if there is one.
    """
    problem = _Problem(wish, model, spacing, settings or FitSettings())
    motion = start or problem.improve(problem.starting_motion(), with_demand=False)
    return problem.weightless_in_flight(problem.improve(motion, with_demand=True))


class _Problem:
    def __init__(self, wish: Wish, model: RigidBodyModel, spacing: float, settings: FitSettings) -> None:
        self.wish, self.settings, self.spacing = wish, settings, spacing
        self.demand = GroundDemand(model)
        self.feet = FootPoints(model.skeleton, wish.contacts.sole)
        self.dofs = model.skeleton.dofs
        times, contacts = wish.times, wish.contacts
        self.count = coefficient_count(times[-1] - times[0], spacing)
        position, last = (times - times[0]) / spacing, self.count - ACTIVE
        self.first = local_basis(position, 0, spacing, last)[0]
        self.basis = [local_basis(position, order, spacing, last)[1] for order in range(4)]
        self.flying: Bool[np.ndarray, " times"] = contacts.flight(times)
        self.about = np.einsum(
            "tf,tfi->ti", contacts.shares(times), np.nan_to_num(contacts.centres_of_pressure(times))
        )
        places = [self.dofs.index(name) for name in PLACE]
        self.about[self.flying] = wish.q[self.flying][:, places]  # a near point keeps moments small
        self.external = self._external()
        self.wanted_demand = np.concatenate([wish.force, np.zeros_like(wish.force)], axis=1)
        self.demand_tolerance = self._demand_tolerance()
        self.planted, self.planted_weight = self._plant()
        self.clearance = self._clearance()
        self.jerk = np.array([settings.jerk_root if d in PLACE else settings.jerk_joint for d in self.dofs])

    def starting_motion(self) -> SplineMotion:
        """The spline through the wanted angles, eased a little."""
        band = BlockBand(self.count, len(self.dofs))
        ones = np.ones(len(self.dofs))
        band.add_diagonal(self.first, self.basis[0], self.wish.q, ones)
        right = band.gradient.ravel().copy()
        band.add_diagonal(self.first, self.basis[3], np.zeros_like(self.wish.q), 1e-5 * ones)
        return self._motion(band.factor().solve(right))

    def improve(self, motion: SplineMotion, with_demand: bool) -> SplineMotion:
        """Gauss-Newton, halving steps that do not help."""
        cost, violation = self._cost(motion, with_demand)
        for _ in range(self.settings.iterations):
            step = self._step(motion, with_demand)
            merit = cost + self.settings.price * violation
            for halving in range(6):
                trial = self._motion(motion.coefficients.ravel() + step * 0.5**halving)
                trial_cost, trial_violation = self._cost(trial, with_demand)
                if trial_cost + self.settings.price * trial_violation < merit:
                    break
            else:
                break
            done = abs(cost - trial_cost) < self.settings.converged * cost
            motion, cost, violation = trial, trial_cost, trial_violation
            if done:
                break
        return motion

    def weightless_in_flight(self, motion: SplineMotion) -> SplineMotion:
        """Newton steps to the nearest motion that demands nothing of the ground while no foot touches it."""
        if not self.flying.any():
            return motion
        for _ in range(self.settings.iterations):
            if self._cost(motion, with_demand=True)[1] < self.settings.flight:
                return motion
            motion = self._motion(
                motion.coefficients.ravel() + self._step(motion, True, only_constraints=True)
            )
        raise FitError(
            "No motion near the wanted one leaves the ground alone in flight. Choose a slower speed or less "
            "variation from step to step."
        )

    def _motion(self, coefficients: np.ndarray) -> SplineMotion:
        table = coefficients.reshape(self.count, len(self.dofs))
        return SplineMotion(self.dofs, table, float(self.wish.times[0]), self.spacing)

    # ---- what is wanted -----------------------------------------------------------------------------------

    def _plant(
        self,
    ) -> tuple[Float[np.ndarray, "times feet points 3"], Float[np.ndarray, "times feet points"]]:
        """Where each foot point should be, and the inverse tolerance, zero while it is free."""
        times = self.wish.times
        shape = (len(times), 2, len(self.feet.body_names))
        target, weight = np.zeros((*shape, 3)), np.zeros(shape)
        for stance in self.wish.contacts.stances:
            for k, body in enumerate(self.feet.body_names):
                since, until = stance.heel_planted if body == "calcn" else stance.forefoot_planted
                on = (times >= since) & (times <= until)
                target[on, stance.foot, k] = stance.to_ground(self.feet.flat_sole[k])
                weight[on, stance.foot, k] = 1 / self.settings.planted
        return target, weight

    def _clearance(self) -> Float[np.ndarray, "times feet"]:
        """Least height of each foot's points [m]: none in stance, growing after it, shrinking before."""
        since_stance = np.full((len(self.wish.times), 2), np.inf)
        for stance in self.wish.contacts.stances:
            outside = np.maximum(stance.start - self.wish.times, self.wish.times - stance.end)
            since_stance[:, stance.foot] = np.minimum(since_stance[:, stance.foot], np.maximum(outside, 0))
        return self.settings.clearance * np.minimum(since_stance / self.settings.clearance_ramp, 1.0)

    def _external(self) -> Float[np.ndarray, "times 6"]:
        """The external wrench about the same points as the demand."""
        if self.wish.external is None:
            return np.zeros((len(self.wish.times), 6))
        force, moment = self.wish.external[:, :3], self.wish.external[:, 3:]
        return np.concatenate([force, moment - cross(self.about, force)], axis=1)

    def _demand_tolerance(self) -> Float[np.ndarray, "times 6"]:
        load = self.wish.contacts.loads(self.wish.times).sum(axis=1, keepdims=True)
        weight = float(np.linalg.norm(self.demand.weight))
        force = self.wish.force_tolerance * np.minimum(load, weight) + self.settings.least_force * weight
        moment = self.settings.cop * load + self.settings.least_moment
        return np.concatenate([np.repeat(force, 3, axis=1), np.repeat(moment, 3, axis=1)], axis=1)

    # ---- residuals ----------------------------------------------------------------------------------------

    def _cost(self, motion: SplineMotion, with_demand: bool) -> tuple[float, float]:
        """Sum of squares, and the largest demand in flight [N, N·m]."""
        q, v, a = motion.state(self.wish.times)
        third = motion.derivative(self.wish.times, 3)
        points = self.feet.positions(q)
        cost = np.sum(((q - self.wish.q) / self.wish.tolerance) ** 2) + np.sum((third / self.jerk) ** 2)
        cost += np.sum(((points - self.planted) * self.planted_weight[..., None]) ** 2)
        cost += np.sum(self._too_low(points) ** 2)
        if not with_demand:
            return float(cost), 0.0
        wrench = self.demand.wrench(q, v, a)
        wrench[:, 3:] -= cross(self.about, wrench[:, :3])
        wrench -= self.external
        scaled = (wrench - self.wanted_demand) / self.demand_tolerance
        return float(cost + np.sum(scaled[~self.flying] ** 2)), float(
            np.abs(wrench[self.flying]).max(initial=0)
        )

    def _too_low(self, points: Float[np.ndarray, "times feet points 3"]) -> np.ndarray:
        missing = np.maximum(self.clearance[..., None] - points[..., 1], 0.0)
        return np.where(self.planted_weight > 0, 0.0, missing / self.settings.clearance_tolerance)

    def _step(self, motion: SplineMotion, with_demand: bool, only_constraints: bool = False) -> np.ndarray:
        """A Gauss-Newton step, or the shortest one that meets the constraints."""
        q, v, a = motion.state(self.wish.times)
        third = motion.derivative(self.wish.times, 3)
        frames, n = len(q), len(self.dofs)
        band = BlockBand(self.count, n)
        tolerance = self.wish.tolerance
        band.add_diagonal(self.first, self.basis[0], (q - self.wish.q) / tolerance, 1 / tolerance)
        band.add_diagonal(self.first, self.basis[3], third / self.jerk, 1 / self.jerk)

        points, by_q = self.feet.slopes(q)
        weight = np.repeat(self.planted_weight.reshape(frames, -1), 3, axis=1)
        low = self._too_low(points).reshape(frames, -1)
        up = (
            by_q[..., 1, :].reshape(frames, -1, n)
            * ((low > 0) / -self.settings.clearance_tolerance)[..., None]
        )
        slopes = np.concatenate([by_q.reshape(frames, -1, n) * weight[..., None], up], axis=1)
        residual = np.concatenate([(points - self.planted).reshape(frames, -1) * weight, low], axis=1)
        band.add_rows(self.first, self._rows(slopes, 0), residual)
        if not with_demand:
            return -band.factor().solve(band.gradient.ravel())

        table = self.demand.slopes(q, v, a, self.about)
        rows = self._rows(table.by_q, 0) + self._rows(table.by_v, 1) + self._rows(table.by_a, 2)
        wrench, on = table.wrench - self.external, ~self.flying
        scaled = (wrench - self.wanted_demand) / self.demand_tolerance
        band.add_rows(self.first[on], rows[on] / self.demand_tolerance[on][..., None, None], scaled[on])
        factor = band.factor()
        step = np.zeros(self.count * n) if only_constraints else -factor.solve(band.gradient.ravel())
        if self.flying.any():
            flying = self.flying
            step = factor.onto_constraints(step, self.first[flying], rows[flying], wrench[flying])
        return step

    def _rows(self, slope: Float[np.ndarray, "times residuals dofs"], order: int) -> np.ndarray:
        return self.basis[order][:, None, :, None] * slope[:, :, None, :]


class BlockBand:
    """JᵀJ and Jᵀr of residuals r that depend on the active coefficients of their time only.

    `blocks[k, d]` couples coefficient k + d (rows) with coefficient k (columns).
    """

    def __init__(self, coefficients: int, dofs: int) -> None:
        self.blocks = np.zeros((coefficients, ACTIVE, dofs, dofs))
        self.gradient = np.zeros((coefficients, dofs))

    def add_diagonal(
        self,
        first: Int[np.ndarray, " times"],
        basis: Float[np.ndarray, "times active"],
        residual: Float[np.ndarray, "times dofs"],
        slope: Float[np.ndarray, " dofs"],
    ) -> None:
        """Residuals that depend each on its own dof.

        Args:
            first: index of the first active coefficient.
            basis: weights of the active ones.
            residual: of each time and dof.
            slope: its derivative by that dof.
        """
        count, dofs = self.gradient.shape
        diagonal = np.arange(dofs)
        for later in range(ACTIVE):
            np.add.at(self.gradient, first + later, basis[:, later, None] * residual * slope)
            for earlier in range(later + 1):
                products = np.bincount(first + earlier, basis[:, later] * basis[:, earlier], count)
                self.blocks[:, later - earlier, diagonal, diagonal] += products[:, None] * slope**2

    def add_rows(
        self,
        first: Int[np.ndarray, " times"],
        rows: Float[np.ndarray, "times residuals active dofs"],
        residual: Float[np.ndarray, "times residuals"],
    ) -> None:
        """Residuals that depend on several dofs; `first` must not decrease."""
        dofs = self.gradient.shape[1]
        starts = np.flatnonzero(np.diff(first, prepend=-1))
        for since, until in zip(starts, [*starts[1:], len(first)], strict=True):
            k = first[since]
            flat = rows[since:until].reshape(-1, ACTIVE * dofs)
            flat = flat[np.any(flat, axis=1)]
            square = (flat.T @ flat).reshape(ACTIVE, dofs, ACTIVE, dofs)
            for later in range(ACTIVE):
                for earlier in range(later + 1):
                    self.blocks[k + earlier, later - earlier] += square[later, :, earlier]
            self.gradient[k : k + ACTIVE] += np.einsum(
                "tmkd,tm->kd", rows[since:until], residual[since:until], optimize=True
            )

    def factor(self) -> "BandFactor":
        """Cholesky factor of JᵀJ."""
        count, bands, dofs, _ = self.blocks.shape
        lower = np.zeros((bands * dofs, count * dofs))  # LAPACK: element (i, j) stands in row i − j, column j
        for d in range(bands):
            for i in range(dofs):
                for j in range(dofs):
                    if d * dofs + i >= j:
                        lower[d * dofs + i - j, j::dofs] = self.blocks[:, d, i, j]
        return BandFactor(cholesky_banded(lower, lower=True, overwrite_ab=True, check_finite=False))


class BandFactor:
    """A factorized JᵀJ."""

    def __init__(self, factor: Float[np.ndarray, "bands unknowns"]) -> None:
        self._factor = factor

    def solve(self, right: Float[np.ndarray, "unknowns *columns"]) -> Float[np.ndarray, "unknowns *columns"]:
        """(JᵀJ)⁻¹ times a vector or several."""
        return cho_solve_banded((self._factor, True), right, check_finite=False)

    def onto_constraints(
        self,
        step: Float[np.ndarray, " unknowns"],
        first: Int[np.ndarray, " times"],
        rows: Float[np.ndarray, "times constraints active dofs"],
        violated: Float[np.ndarray, "times constraints"],
    ) -> Float[np.ndarray, " unknowns"]:
        """The step nearest to a given one, in the metric of JᵀJ, that meets C step = −violated."""
        times, each, _, dofs = rows.shape
        spread = np.zeros((times * each, len(step)))
        for t in range(times):
            span = slice(first[t] * dofs, (first[t] + ACTIVE) * dofs)
            spread[t * each : (t + 1) * each, span] = rows[t].reshape(each, -1)
        half = self._through_lower(spread.T, np.repeat(first * dofs, each))
        missing = violated.ravel() + spread @ step
        multipliers = np.linalg.lstsq(half.T @ half, missing, rcond=1e-14)[0]
        return step - self.solve(spread.T @ multipliers)

    def _through_lower(
        self, right: Float[np.ndarray, "unknowns columns"], begins: Int[np.ndarray, " columns"]
    ) -> Float[np.ndarray, "unknowns columns"]:
        """L⁻¹ times columns that are zero before `begins`, which must not decrease.

        By square blocks of the band's width, of which L has two in a row: LAPACK's solver for bands takes one
        column at a time, which is several times slower for hundreds of them.
        """
        width, unknowns = self._factor.shape
        answer = np.array(right, order="F")
        for start in range(0, unknowns, width):
            end = min(start + width, unknowns)
            begun = int(np.searchsorted(begins, end))
            if start:
                before = self._block(start, end, start - width)
                answer[start:end, :begun] -= before @ answer[start - width : start, :begun]
            own = self._block(start, end, start)
            answer[start:end, :begun] = solve_triangular(
                own, answer[start:end, :begun], lower=True, check_finite=False
            )
        return answer

    def _block(self, start: int, end: int, column: int) -> Float[np.ndarray, "rows columns"]:
        """Rows `start` to `end` of L and as many columns as the band is wide, from `column` on."""
        width, unknowns = self._factor.shape
        below = np.arange(start, end)[:, None]
        right = np.arange(column, min(column + width, unknowns))
        diagonal = below - right
        inside = (diagonal >= 0) & (diagonal < width)
        return np.where(inside, self._factor[np.clip(diagonal, 0, width - 1), right], 0.0)
