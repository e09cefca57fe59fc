"""What holds a trajectory beside markers and forces, and the inertias beside the forces.

The pull to the marker fit: dofs that markers barely see, or not at all, would absorb the residual.
Smoothness: jerk against the level of each dof's own. Held ends: what is beyond a part of a trial
is not asked again.
"""

import numpy as np
from jaxtyping import Bool, Float

from solver.dynamics.inertia_parameters import PER_BODY, InertiaParameters, prior_std
from solver.dynamics.trajectory.bordered_system import TrialGradient, TrialSystem
from solver.dynamics.trajectory.spline_band import CoefficientBand
from solver.dynamics.trajectory.spline_basis import DEGREE
from solver.dynamics.trajectory.terms.term import SharedParameters, TrialPoint
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trial_data import ExtraParameters
from solver.kinematics.frame_solver import pose_precision
from solver.kinematics.motion import Motion
from solver.kinematics.unseen_bodies import undetermined_dofs
from solver.skeleton.skeleton import Skeleton

JERK_CUTOFF_HZ = 8.0  # [Hz] a dof's own jerk level is taken below it: above, marker noise dominates
LEAST_JERK_SHARE = 0.05  # of the mean level, for dofs that hardly move: they may still have to
# [rad] 3.4°: likewise for dofs that move no marker, which are neutral there. A trunk without markers else
# bends by 20 to 40° in place of what forces, clocks and masses have wrong
UNDETERMINED_STD_RAD = 0.06

HELD_STD = 1e-9  # [rad or m] less than anybody measures; its square is far from what doubles resolve


def pull_precision(
    skeleton: Skeleton, observed_ground: Float[np.ndarray, "frames markers 3"], settings: TrajectorySettings
) -> Float[np.ndarray, " dofs"]:
    """Of each frame's pull to the marker fit [1/rad²]; none for the root.

    Args:
        skeleton: its markers are those observed.
        observed_ground: NaN where unseen [m].
        settings: how far dofs may leave the marker fit that markers see, and those that none sees.
    """
    undetermined = undetermined_dofs(skeleton, observed_ground)
    return pose_precision(skeleton, np.where(undetermined, UNDETERMINED_STD_RAD, settings.pose_std_rad))


class PosePull:
    """Σ_t Σ_j (q_tj − q⁰_tj)²/σ_j², over all dofs but the root's."""

    def __init__(self, start: Motion, precision: Float[np.ndarray, " dofs"]) -> None:
        """Of a trial.

        Args:
            start: the marker fit.
            precision: `pull_precision`.
        """
        self.start_q, self.precision = start.q, precision

    def pulls_of_errors(
        self, at: TrialPoint, errors: Float[np.ndarray, "frames dofs errors"]
    ) -> Float[np.ndarray, "coefficients dofs errors"]:
        """Where a marker fit that is so far off pulls the spline."""
        by_frame = self.precision[:, None] * errors
        flat = CoefficientBand.gather(at.basis, by_frame.reshape(len(by_frame), -1), 0)
        return at.frame_weight * flat.reshape(len(flat), *by_frame.shape[1:])

    def cost(self, at: TrialPoint) -> float:
        """The sum."""
        return at.frame_weight * float((self.precision * (at.q - self.start_q) ** 2).sum())

    def add_gradient(self, at: TrialPoint, gradient: TrialGradient) -> None:
        """By the coefficients."""
        gradient.add_frames(at.basis, at.frame_weight * self.precision * (at.q - self.start_q))
        gradient.cost += self.cost(at)

    def add_linearized(self, at: TrialPoint, system: TrialSystem) -> None:
        """Quadratic, so the band's share is the same everywhere."""
        system.band.add_values(at.frame_weight * self.precision)
        self.add_gradient(at, system.gradient)


class Smoothness:
    """κ Σ_j ∫ (d³q_j/dt³)² dt / ȷ_j², with ȷ_j the dof's jerk level in the marker fit."""

    def __init__(self, jerk: Float[np.ndarray, " dofs"], settings: TrajectorySettings) -> None:
        """Of a trial.

        Args:
            jerk: `jerk_level` of the marker fit [rad/s³ or m/s³].
            settings: κ.
        """
        self.weight = settings.smoothness / jerk**2

    def cost(self, at: TrialPoint) -> float:
        """The sum."""
        c = at.coefficients[:, : len(self.weight)]
        return float(self.weight @ (at.basis.jerk(c) ** 2).sum(axis=(0, 2)))

    def add_gradient(self, at: TrialPoint, gradient: TrialGradient) -> None:
        """By the coefficients."""
        columns = slice(len(self.weight))
        c = at.coefficients[:, columns]
        gradient.coefficients[:, columns] += self.weight * at.basis.jerk_product(c)
        gradient.cost += self.cost(at)

    def add_linearized(self, at: TrialPoint, system: TrialSystem) -> None:
        """Quadratic, so the band's share is the same everywhere."""
        system.band.add_jerk(self.weight)
        self.add_gradient(at, system.gradient)


def jerk_level(motion: Motion) -> Float[np.ndarray, " dofs"]:
    """RMS third derivative of each dof in the marker fit below its noise [rad/s³ or m/s³].

    Running jerks ten times as much as walking; a smoothness that fits one would bend the other.
    """
    jerk = motion.low_passed(JERK_CUTOFF_HZ).derivative(3)
    inner = jerk[len(jerk) // 10 : len(jerk) - len(jerk) // 10]
    own = np.sqrt((inner**2).mean(axis=0))
    return np.maximum(own, LEAST_JERK_SHARE * np.sqrt((own**2).mean()))


class HeldEnds:
    """Σ (c − c⁰)²/σ² over the coefficients that act beyond the ends of a part, at a σ of next to nothing.

    All other coefficients act on the part's frames alone. So with these held, its cost is that of the whole
    trial by the others, but for a constant.
    """

    def __init__(
        self, coefficients: Float[np.ndarray, "coefficients dofs"], *, before: bool, after: bool
    ) -> None:
        """Of a part.

        Args:
            coefficients: where they stay.
            before: whether the trial has frames before the part.
            after: whether it has frames after it; then the part's last frame is on a knot.
        """
        self.coefficients = coefficients
        held = np.zeros(len(coefficients), dtype=bool)
        held[:DEGREE] = before
        if after:
            held[-DEGREE:] = True
        self.held: Bool[np.ndarray, " coefficients"] = held

    def _away(self, at: TrialPoint) -> Float[np.ndarray, "held dofs"]:
        return at.coefficients[self.held, : self.coefficients.shape[1]] - self.coefficients[self.held]

    def cost(self, at: TrialPoint) -> float:
        """The sum."""
        return float((self._away(at) ** 2).sum()) / HELD_STD**2

    def add_gradient(self, at: TrialPoint, gradient: TrialGradient) -> None:
        """By the coefficients."""
        gradient.coefficients[self.held, : self.coefficients.shape[1]] += self._away(at) / HELD_STD**2
        gradient.cost += self.cost(at)

    def add_linearized(self, at: TrialPoint, system: TrialSystem) -> None:
        """Quadratic, so the band's share is the same everywhere."""
        dofs = np.arange(self.coefficients.shape[1])
        rows = np.flatnonzero(self.held)
        system.band.panels[rows[:, None], dofs, 0, dofs] += 1 / HELD_STD**2
        self.add_gradient(at, system.gradient)


class InertiaPrior:
    """What anthropometric tables say of segments, and of the whole body's mass.

    w Σ_k φ_k²/σ_k² + w_m (m(φ) − m⁰)²/σ_m², m the body's mass and m⁰ the skeleton's.
    """

    def __init__(
        self,
        inertias: InertiaParameters,
        weight: float,
        settings: TrajectorySettings,
        mass_weight: float | None = None,
    ) -> None:
        """Of a skeleton.

        Args:
            inertias: about those of the skeleton.
            weight: w.
            settings: σ_k and σ_m.
            mass_weight: w_m; None: w.
        """
        mass_weight = weight if mass_weight is None else mass_weight
        self.entered_mass = inertias.skeleton.mass
        self.precision = weight / prior_std(inertias, settings) ** 2
        self.mass_precision = mass_weight / (settings.body_mass_std * self.entered_mass) ** 2

    def cost(self, shared: SharedParameters) -> float:
        """Both sums."""
        excess = self._excess(shared)
        return float(self.precision @ shared.phi**2 + self.mass_precision * excess**2)

    def gradient(self, shared: SharedParameters) -> Float[np.ndarray, " shared"]:
        """By φ, where it is free."""
        by_phi = self.precision * shared.phi
        by_phi += self.mass_precision * self._excess(shared) * mass_by_phi(shared)
        gradient, free = np.zeros(shared.count), shared.free_inertias
        gradient[:free] = by_phi[:free]
        return gradient

    def curvature(self, shared: SharedParameters) -> Float[np.ndarray, "shared shared"]:
        """Of the mass, to first order in φ."""
        slope, free = mass_by_phi(shared), shared.free_inertias
        by_phi = np.diag(self.precision) + self.mass_precision * np.outer(slope, slope)
        curvature = np.zeros((shared.count, shared.count))
        curvature[:free, :free] = by_phi[:free, :free]
        return curvature

    def _excess(self, shared: SharedParameters) -> float:
        """Of the body over the entered mass [kg]."""
        inertias = shared.inertias
        moved = shared.pseudo_inertias[inertias.group >= 0, 3, 3].sum()
        kept = sum(b.mass for b, g in zip(inertias.skeleton.bodies, inertias.group, strict=True) if g < 0)
        return float(moved + kept - self.entered_mass)


def masses_by_phi(shared: SharedParameters) -> Float[np.ndarray, "bodies parameters"]:
    """Derivative of every body's mass by φ [kg]; zero for bodies that keep theirs."""
    slopes = np.zeros((len(shared.inertias.group), len(shared.phi)))
    for body, group in enumerate(shared.inertias.group):
        if group >= 0:
            slopes[body, PER_BODY * group : PER_BODY * (group + 1)] = shared.by_phi[body, :, 3, 3]
    return slopes


def mass_by_phi(shared: SharedParameters) -> Float[np.ndarray, " parameters"]:
    """Likewise of the whole body's."""
    return np.asarray(masses_by_phi(shared).sum(axis=0))


class ExtraPrior:
    """N(0, σ_k²) for each parameter of extra columns: Σ_k x_k²/σ_k²."""

    def __init__(self, extra: ExtraParameters) -> None:
        self.precision = extra.prior_std**-2.0

    def cost(self, shared: SharedParameters) -> float:
        """The sum."""
        return float(self.precision @ shared.x**2)

    def gradient(self, shared: SharedParameters) -> Float[np.ndarray, " shared"]:
        """By x."""
        return np.concatenate([np.zeros(shared.free_inertias), self.precision * shared.x])

    def curvature(self, shared: SharedParameters) -> Float[np.ndarray, "shared shared"]:
        """Constant."""
        return np.diag(np.concatenate([np.zeros(shared.free_inertias), self.precision]))
