"""From what a movement should look like to a motion that the ground can carry.

Unknown are the coefficients of the motion's spline. Joint angles are wanted as the pattern has them, standing
feet stay put, the ground's demanded force passes through the wanted centre of pressure, and in flight it is zero
exactly: Gauss-Newton with equality constraints, its matrix banded in time.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_solve_banded, cholesky_banded

from solver.simulate.contacts import ContactPlan
from solver.simulate.foot_points import FootPoints
from solver.simulate.ground_demand import GroundDemand
from solver.simulate.spline_motion import ACTIVE, SplineMotion, coefficient_count, local_basis
from solver.skeleton.pinocchio_model import RigidBodyModel


@dataclass(frozen=True)
class Wish:
    """What the motion should look like, on an even grid of times."""

    times: Float[np.ndarray, " times"]  # [s]
    q: Float[np.ndarray, "times dofs"]  # [rad or m]
    tolerance: Float[np.ndarray, " dofs"]  # [rad or m]
    contacts: ContactPlan
    force: Float[np.ndarray, "times 3"]  # [N] from the ground in all
    clearance: Float[np.ndarray, "times feet"]  # [m] least height of a swinging foot's points


@dataclass(frozen=True)
class FitSettings:
    """Tolerances of the fit, as standard deviations."""

    planted: float = 0.0005  # [m] what a foot under load may move
    force: float = 0.08  # body weights; the demand follows from the angles, the wish is a sketch
    cop: float = 0.004  # [m] times the load: the arm of the moment about the wanted centre of pressure
    smallest_moment: float = 0.05  # [N·m] where the load vanishes
    clearance: float = 0.004  # [m]
    jerk_joint: float = 2500.0  # [rad/s³] a running knee reaches about 3000
    jerk_root: float = 150.0  # [m/s³]
    iterations: int = 25
    converged: float = 1e-4  # relative decrease of the cost
    flight: float = 1e-7  # [N, N·m] largest demand left in flight


def fit_trajectory(
    wish: Wish, model: RigidBodyModel, spacing: float, settings: FitSettings | None = None
) -> SplineMotion:
    """The motion nearest to the wish.

    Args:
        wish: its grid should be at least twice as fine as the knots.
        model: of the skeleton that moves.
        spacing: [s] between knots.
        settings: tolerances.
    """
    problem = _Problem(wish, model, spacing, settings or FitSettings())
    motion = problem.starting_motion()
    motion = problem.solved(motion, with_demand=False)
    return problem.solved(motion, with_demand=True)


class _Problem:
    def __init__(self, wish: Wish, model: RigidBodyModel, spacing: float, settings: FitSettings) -> None:
        self.wish, self.settings, self.spacing = wish, settings, spacing
        self.demand = GroundDemand(model)
        self.feet = FootPoints(model.skeleton, wish.contacts.sole)
        self.dofs = model.skeleton.dofs
        times = wish.times
        self.count = coefficient_count(times[-1] - times[0], spacing)
        position, last = (times - times[0]) / spacing, self.count - ACTIVE
        self.first = local_basis(position, 0, spacing, last)[0]
        self.basis = [local_basis(position, order, spacing, last)[1] for order in range(4)]
        self.flying = wish.contacts.flight(times)
        loads = wish.contacts.loads(times)
        self.load = loads.sum(axis=1)
        cop = np.nan_to_num(wish.contacts.centres_of_pressure(times))
        self.cop = np.einsum("tf,tfi->ti", wish.contacts.shares(times), cop)
        places = [self.dofs.index(name) for name in ("pelvis_tx", "pelvis_ty", "pelvis_tz")]
        self.cop[self.flying] = wish.q[np.ix_(self.flying, places)]  # moments in flight count about the pelvis
        self.planted, self.planted_weight = self._planted_targets()
        root = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
        self.jerk = np.array([settings.jerk_root if d in root else settings.jerk_joint for d in self.dofs])

    def _planted_targets(self) -> tuple[np.ndarray, np.ndarray]:
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

    def starting_motion(self) -> SplineMotion:
        """The least-squares spline through the wanted angles."""
        blocks = np.zeros((self.count, ACTIVE, 1, 1))
        right = np.zeros((self.count, len(self.dofs)))
        for j, first in enumerate(self.first):
            b, jerk = self.basis[0][j], self.basis[3][j] * 1e-5
            square = np.outer(b, b) + np.outer(jerk, jerk)
            _add_lower(blocks, first, square[:, None, :, None])
            right[first : first + ACTIVE] += b[:, None] * self.wish.q[j]
        factor = cholesky_banded(_banded(blocks), lower=True)
        return self._motion(cho_solve_banded((factor, True), right))

    def _motion(self, coefficients: np.ndarray) -> SplineMotion:
        return SplineMotion(self.dofs, coefficients, float(self.wish.times[0]), self.spacing)

    def solved(self, motion: SplineMotion, with_demand: bool) -> SplineMotion:
        """Gauss-Newton from a motion, halving steps that do not help."""
        cost, violation = self._cost(motion, with_demand)
        for _ in range(self.settings.iterations):
            step = self._step(motion, with_demand)
            price = 10.0  # of constraint violation [1/N] against the cost
            for halving in range(6):
                trial = self._motion(motion.coefficients + step * 0.5**halving)
                trial_cost, trial_violation = self._cost(trial, with_demand)
                if trial_cost + price * trial_violation < cost + price * violation:
                    break
            else:
                break
            gained = cost - trial_cost
            motion, cost, violation = trial, trial_cost, trial_violation
            print("   ", round(cost,2), violation, halving)
            if abs(gained) < self.settings.converged * cost and violation < self.settings.flight:
                break
        return motion

    # ---- residuals ----------------------------------------------------------------------------------------

    def _cost(self, motion: SplineMotion, with_demand: bool) -> tuple[float, float]:
        q, v, a = motion.state(self.wish.times)
        third = motion.derivative(self.wish.times, 3)
        cost = np.sum(((q - self.wish.q) / self.wish.tolerance) ** 2) + np.sum((third / self.jerk) ** 2)
        points = self.feet.positions(q)
        cost += np.sum(((points - self.planted) * self.planted_weight[..., None]) ** 2)
        cost += np.sum(self._too_low(points) ** 2)
        if not with_demand:
            return float(cost), 0.0
        wrench = self.demand.wrench(q, v, a)
        moment = wrench[:, 3:] - np.cross(self.cop, wrench[:, :3])
        scaled = (np.concatenate([wrench[:, :3], moment], axis=1) - self._wanted_demand) / self._demand_tolerance
        violation = np.abs(scaled[self.flying] * self._demand_tolerance[self.flying]).max(initial=0.0)
        return float(cost + np.sum(scaled[~self.flying] ** 2)), float(violation)

    def _too_low(self, points: np.ndarray) -> np.ndarray:
        missing = np.maximum(self.wish.clearance[..., None] - points[..., 1], 0.0)
        return np.where(self.planted_weight > 0, 0.0, missing / self.settings.clearance)

    @property
    def _wanted_demand(self) -> np.ndarray:
        return np.concatenate([self.wish.force, np.zeros_like(self.wish.force)], axis=1)

    @property
    def _demand_tolerance(self) -> np.ndarray:
        settings = self.settings
        weight = np.linalg.norm(self.demand.weight)
        tolerance = np.empty((len(self.load), 6))
        tolerance[:, :3] = settings.force * weight * (0.02 + np.minimum(self.load / weight, 1.0))[:, None]
        tolerance[:, 3:] = settings.cop * self.load[:, None] + settings.smallest_moment
        return tolerance

    # ---- one step -----------------------------------------------------------------------------------------

    def _step(self, motion: SplineMotion, with_demand: bool) -> np.ndarray:
        q, v, a = motion.state(self.wish.times)
        third = motion.derivative(self.wish.times, 3)
        n = len(self.dofs)
        blocks, gradient = np.zeros((self.count, ACTIVE, n, n)), np.zeros((self.count, n))
        self._add_diagonal(blocks, gradient, 0, (q - self.wish.q) / self.wish.tolerance, 1 / self.wish.tolerance)
        self._add_diagonal(blocks, gradient, 3, third / self.jerk, 1 / self.jerk)

        points, by_q = self.feet.slopes(q)
        frames = len(q)
        weight = np.repeat(self.planted_weight.reshape(frames, -1), 3, axis=1)
        residual = (points - self.planted).reshape(frames, -1) * weight
        low = self._too_low(points).reshape(frames, -1)
        low_slope = by_q[..., 1, :].reshape(frames, -1, n) * ((low > 0) / -self.settings.clearance)[..., None]
        residual = np.concatenate([residual, low], axis=1)
        slopes = np.concatenate([by_q.reshape(frames, -1, n) * weight[..., None], low_slope], axis=1)
        rows = np.einsum("tk,tmd->tmkd", self.basis[0], slopes)
        constraint_rows = np.zeros((0, 6, ACTIVE, n))
        violated = np.zeros((0, 6))
        if with_demand:
            table = self.demand.slopes(q, v, a, self.cop)
            demand_rows = sum(
                np.einsum("tk,tmd->tmkd", self.basis[order], slope)
                for order, slope in enumerate((table.by_q, table.by_v, table.by_a))
            )
            scaled = (table.wrench - self._wanted_demand) / self._demand_tolerance
            on = ~self.flying
            demand = np.where(on[:, None, None, None], demand_rows / self._demand_tolerance[..., None, None], 0)
            rows = np.concatenate([rows, demand], axis=1)
            residual = np.concatenate([residual, scaled * on[:, None]], axis=1)
            constraint_rows, violated = demand_rows[self.flying], table.wrench[self.flying]
        self._add_rows(blocks, gradient, rows, residual)
        factor = cholesky_banded(_banded(blocks), lower=True, overwrite_ab=True, check_finite=False)
        step = -cho_solve_banded((factor, True), gradient.ravel())
        if len(violated):
            step = self._onto_constraints(step, factor, constraint_rows, violated)
        return step.reshape(self.count, n)

    def _onto_constraints(
        self, step: np.ndarray, factor: np.ndarray, rows: np.ndarray, violated: np.ndarray
    ) -> np.ndarray:
        n, count = len(self.dofs), violated.size
        spread = np.zeros((count, self.count * n))
        firsts = np.repeat(self.first[self.flying], 6)
        flat = rows.reshape(count, ACTIVE * n)
        for i in range(count):
            spread[i, firsts[i] * n : (firsts[i] + ACTIVE) * n] = flat[i]
        answer = cho_solve_banded((factor, True), spread.T, check_finite=False)
        multipliers = np.linalg.lstsq(spread @ answer, violated.ravel() + spread @ step, rcond=1e-13)[0]
        out = step - answer @ multipliers
        S = spread @ answer
        print("lin res", np.abs(spread @ out + violated.ravel()).max(), "cond", np.linalg.cond(S), np.abs(S-S.T).max()/np.abs(S).max(), "step", np.abs(out).max())
        return out

    def _add_diagonal(
        self, blocks: np.ndarray, gradient: np.ndarray, order: int, residual: np.ndarray, slope: np.ndarray
    ) -> None:
        basis = self.basis[order]
        diagonal = np.arange(len(self.dofs))
        for later in range(ACTIVE):
            np.add.at(gradient, self.first + later, basis[:, later, None] * residual * slope)
            for earlier in range(later + 1):
                product = np.bincount(self.first + earlier, basis[:, later] * basis[:, earlier], self.count)
                blocks[:, later - earlier, diagonal, diagonal] += product[:, None] * slope**2

    def _add_rows(
        self, blocks: np.ndarray, gradient: np.ndarray, rows: np.ndarray, residual: np.ndarray
    ) -> None:
        n = len(self.dofs)
        starts = np.flatnonzero(np.diff(self.first, prepend=-1))
        for since, until in zip(starts, [*starts[1:], len(self.first)], strict=True):
            first = self.first[since]
            flat = rows[since:until].reshape(-1, ACTIVE * n)
            flat = flat[np.any(flat, axis=1)]
            _add_lower(blocks, first, (flat.T @ flat).reshape(ACTIVE, n, ACTIVE, n))
            own = np.einsum("tmkd,tm->kd", rows[since:until], residual[since:until])
            gradient[first : first + ACTIVE] += own


def _add_lower(blocks: np.ndarray, first: int, square: np.ndarray) -> None:
    """Add a square over the active coefficients to the lower block band."""
    for later in range(ACTIVE):
        for earlier in range(later + 1):
            blocks[first + earlier, later - earlier] += square[later, :, earlier]


def _banded(blocks: np.ndarray) -> np.ndarray:
    """LAPACK's lower banded storage of a lower block band: blocks[k, d] stands at row k + d, column k."""
    count, bands, n, _ = blocks.shape
    banded = np.zeros((bands * n, count * n))
    for d in range(bands):
        for i in range(n):
            for j in range(n):
                offset = d * n + i - j
                if offset >= 0:
                    banded[offset, j::n] = blocks[:, d, i, j]
    return banded
