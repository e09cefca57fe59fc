"""What a trial's forces say about a trajectory: root residuals, frame by frame, with their derivatives."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.dynamics.inertia_parameters import InertiaParameters, demanded_wrench, wrench_by_parameters
from solver.dynamics.material_acceleration import material_accelerations
from solver.dynamics.momentum_terms import momentum_terms
from solver.dynamics.root_wrench import root_centre
from solver.dynamics.trajectory_settings import TrajectorySettings
from solver.dynamics.trial_states import TrialStates
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import cross, point_jacobian
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.rotations import skew
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class ResidualLinearization:
    """Whitened residual rows [force, moment about the root joint's centre] and their derivatives."""

    value: Float[np.ndarray, "frames 6"]
    by_q: Float[np.ndarray, "frames 6 dofs"]
    by_v: Float[np.ndarray, "frames 6 dofs"]
    by_a: Float[np.ndarray, "frames 6 dofs"]
    by_shared: Float[np.ndarray, "frames 6 shared"]  # by φ and x, one after the other
    cost: float

    @property
    def shared_gradient(self) -> Float[np.ndarray, " shared"]:
        """Of half the cost, by φ and x."""
        return self.by_shared.reshape(self.value.size, self.by_shared.shape[2]).T @ self.value.ravel()


class ResidualTrack:
    """Σ_{t ∉ U} ρ(‖r_t‖²/σ_r²): external wrench demanded by the motion less what is known to act.

    That is wrench + columns x, with x shared by trials. ρ is Cauchy's: a frame whose force is plainly
    missing, though nobody said so, does not bend the body.
    """

    def __init__(
        self,
        wrench_ground: Float[np.ndarray, "frames 6"],
        counts: Bool[np.ndarray, " frames"],
        settings: TrajectorySettings,
        columns_ground: Float[np.ndarray, "frames 6 extra"] | None = None,
    ) -> None:
        self.counts, self.measured = counts, wrench_ground
        self.columns = np.zeros((len(counts), 6, 0)) if columns_ground is None else columns_ground
        scale = (settings.residual_force_std_N, settings.residual_moment_std_Nm)
        self.whitening = 1.0 / np.repeat(scale, 3)
        self.robust2 = settings.residual_robust_scale**2

    def cost(self, model: "ResidualModel", states: TrialStates) -> float:
        """What the sum takes of some frames."""
        at, states = self._known(states)
        if not len(at):
            return 0.0
        poses, inertias = states.poses, model.inertias
        A, T = material_accelerations(states.kinematics, poses, states.q, states.v, states.a)
        wrench = demanded_wrench(A, T, model.pseudo_inertias).sum(axis=1)
        wrench -= self.measured[at] + self.columns[at] @ model.x
        centre = root_centre(root_joint(inertias.skeleton), poses)
        wrench[:, 3:] -= cross(centre, wrench[:, :3])
        return self._robust(((self.whitening * wrench) ** 2).sum(axis=1))

    def linearized(
        self, model: "ResidualModel", states: TrialStates, *, with_inertias: bool
    ) -> ResidualLinearization:
        """Rows of some frames; zero on those of U."""
        at, known = self._known(states)
        rows = self._rows(model, at, known, with_inertias=with_inertias)
        if len(at) == len(states.q):
            return rows
        here = at - states.frames.start

        def padded(part: np.ndarray) -> np.ndarray:
            whole = np.zeros((len(states.q), *part.shape[1:]))
            whole[here] = part
            return whole

        return ResidualLinearization(
            value=padded(rows.value),
            by_q=padded(rows.by_q),
            by_v=padded(rows.by_v),
            by_a=padded(rows.by_a),
            by_shared=padded(rows.by_shared),
            cost=rows.cost,
        )

    def _known(self, states: TrialStates) -> tuple[Int[np.ndarray, " known"], TrialStates]:
        """Which of these frames count, as frames of the trial, and their states."""
        here = np.flatnonzero(self.counts[states.frames])
        return here + states.frames.start, states.only(here)

    def _robust(self, squares: Float[np.ndarray, " some"]) -> float:
        return float(self.robust2 * np.log1p(squares / self.robust2).sum())

    def _rows(
        self,
        model: "ResidualModel",
        at: Int[np.ndarray, " some"],
        states: TrialStates,
        *,
        with_inertias: bool,
    ) -> ResidualLinearization:
        """Whitened residuals of some frames that count, and their derivatives by q, q̇, q̈, φ and x."""
        inertias, columns = model.inertias, self.columns[at]
        kinematics, poses = states.kinematics, states.poses
        q, v, a = states.q, states.v, states.a
        terms = momentum_terms(model.rigid_bodies, q, v, a, self.measured[at] + columns @ model.x)
        root = root_joint(inertias.skeleton)
        centre = root_centre(root, poses)
        centre_by_q = point_jacobian(kinematics, poses, root.body, centre)
        com_by_q = terms.by_a[:, :3] / model.skeleton.mass
        arm, force = skew(terms.com_ground - centre), terms.residual[:, :3]
        value = terms.residual.copy()
        value[:, 3:] += (arm @ force[:, :, None])[:, :, 0]
        for rows in (terms.by_q, terms.by_v, terms.by_a):
            rows[:, 3:] += arm @ rows[:, :3]
        terms.by_q[:, 3:] -= skew(force) @ (com_by_q - centre_by_q)
        by_phi = np.zeros((len(q), 6, inertias.count if with_inertias else 0))
        if with_inertias:
            A, T = material_accelerations(kinematics, poses, q, v, a)
            by_phi = wrench_by_parameters(A, T, inertias, model.by_phi)
        by_shared = np.concatenate([by_phi, -columns], axis=2)
        by_shared[:, 3:] -= skew(centre) @ by_shared[:, :3]
        squares = ((self.whitening * value) ** 2).sum(axis=1)
        weights = self.whitening / np.sqrt(1 + squares / self.robust2)[:, None]
        for derivative in (terms.by_q, terms.by_v, terms.by_a, by_shared):
            np.multiply(derivative, weights[:, :, None], out=derivative)
        return ResidualLinearization(
            weights * value, terms.by_q, terms.by_v, terms.by_a, by_shared, self._robust(squares)
        )


@dataclass(frozen=True)
class ResidualModel:
    """What trials share: inertias at φ, the model made of them, and x of the extra columns."""

    inertias: InertiaParameters
    phi: Float[np.ndarray, " parameters"]
    x: Float[np.ndarray, " extra"]

    def shared(self, *, with_inertias: bool) -> int:
        """How many shared parameters there are."""
        return len(self.x) + (self.inertias.count if with_inertias else 0)

    @cached_property
    def skeleton(self) -> Skeleton:
        """With the inertias of φ."""
        return self.inertias.skeleton_at(self.phi)

    @cached_property
    def rigid_bodies(self) -> RigidBodyModel:
        """Made of that skeleton."""
        return RigidBodyModel(self.skeleton)

    @cached_property
    def pseudo_inertias(self) -> Float[np.ndarray, "bodies 4 4"]:
        """J of every body [kg, kg·m, kg·m²]."""
        return self.inertias.pseudo_inertias(self.phi)

    @cached_property
    def by_phi(self) -> Float[np.ndarray, "bodies 10 4 4"]:
        """∂J/∂φ of every body by its group's ten parameters."""
        return self.inertias.derivatives(self.phi)
