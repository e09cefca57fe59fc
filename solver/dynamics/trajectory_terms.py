"""What markers and forces say about a trajectory, frame by frame, with Gauss-Newton terms."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from solver.dynamics.inertia_parameters import InertiaParameters, demanded_wrench
from solver.dynamics.material_acceleration import material_accelerations
from solver.dynamics.momentum_terms import momentum_terms
from solver.dynamics.root_wrench import root_centre
from solver.dynamics.trajectory_settings import TrajectorySettings
from solver.kinematics.motion import Motion
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import ForwardKinematics, cross, marker_jacobian, point_jacobian
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.rotations import skew
from solver.skeleton.skeleton import Skeleton

CHUNK = 256  # frames whose dense marker Jacobians are held at once


@dataclass(frozen=True)
class MarkerLinearization:
    """Gauss-Newton terms of the marker errors and of their changes from frame to frame."""

    H: Float[np.ndarray, "frames dofs dofs"]
    H_previous: Float[np.ndarray, "pairs dofs dofs"]  # at (q_(i+1), q_i)
    g: Float[np.ndarray, "frames dofs"]


class MarkerTrack:
    """Σ ρ(‖e_t‖²)/σ_m² + Σ w_t ‖e_t − e_(t−1)‖²/σ_d²: a marker that lies far off has little to say in either.

    The weights w of the changes come from the marker fit and stay.
    """

    def __init__(
        self,
        skeleton: Skeleton,
        observed_ground: Float[np.ndarray, "frames markers 3"],
        start: Motion,
        settings: TrajectorySettings,
    ) -> None:
        self.kinematics = ForwardKinematics(skeleton)
        self.seen = np.isfinite(observed_ground).all(axis=2)
        self.observed = np.where(self.seen[:, :, None], observed_ground, 0.0)
        self.precision = settings.marker_std_m**-2
        self.scale2 = settings.marker_robust_scale_m**2
        _, squares = self._errors(self.kinematics.markers(self.kinematics.poses(start.q)))
        trust = self.seen / (1 + squares / self.scale2)
        both_seen = self.seen[1:] & self.seen[:-1]
        drift_precision = (settings.marker_drift_std_m_s / start.rate) ** -2
        self.pair_weight = drift_precision * both_seen * np.minimum(trust[1:], trust[:-1])

    def cost(self, q: Float[np.ndarray, "frames dofs"]) -> float:
        """Both sums."""
        error, squares = self._errors(self.kinematics.markers(self.kinematics.poses(q)))
        changes = self.pair_weight[:, :, None] * np.diff(error, axis=0) ** 2
        static = self.precision * self.scale2 * np.log1p(squares / self.scale2).sum()
        return float(static + changes.sum())

    def linearized(self, q: Float[np.ndarray, "frames dofs"]) -> MarkerLinearization:
        """Terms at q; the robust weights of the errors are held."""
        frames, dofs = q.shape
        poses = self.kinematics.poses(q)
        x = self.kinematics.markers(poses)
        error, squares = self._errors(x)
        weight = self.seen * self.precision / (1 + squares / self.scale2)
        change, pair_weight = np.diff(error, axis=0), self.pair_weight
        both = weight.copy()  # every frame's own terms: its error, and its share in the changes to both sides
        both[1:] += pair_weight
        both[:-1] += pair_weight
        pull = weight[:, :, None] * error
        pull[1:] += pair_weight[:, :, None] * change
        pull[:-1] -= pair_weight[:, :, None] * change
        H, g = np.empty((frames, dofs, dofs)), np.empty((frames, dofs))
        H_previous = np.empty((max(0, frames - 1), dofs, dofs))
        last: Float[np.ndarray, "1 coordinates dofs"] | None = None
        for low in range(0, frames, CHUNK):
            at = slice(low, min(frames, low + CHUNK))
            J = marker_jacobian(self.kinematics, poses.at(at), x[at])
            wide = np.repeat(both[at], 3, axis=1)[:, :, None]
            H[at] = J.transpose(0, 2, 1) @ (wide * J)
            g[at] = np.einsum("tij,ti->tj", J, pull[at].reshape(len(J), -1))
            before = J[:-1] if last is None else np.concatenate([last, J[:-1]])
            after = J[1:] if last is None else J
            pairs = slice(at.stop - 1 - len(after), at.stop - 1)
            between = np.repeat(pair_weight[pairs], 3, axis=1)[:, :, None]
            H_previous[pairs] = -after.transpose(0, 2, 1) @ (between * before)
            last = J[-1:]
        return MarkerLinearization(H, H_previous, g)

    def _errors(
        self, x: Float[np.ndarray, "frames markers 3"]
    ) -> tuple[Float[np.ndarray, "frames markers 3"], Float[np.ndarray, "frames markers"]]:
        error = np.where(self.seen[:, :, None], x - self.observed, 0.0)
        return error, (error**2).sum(axis=2)


@dataclass(frozen=True)
class ResidualLinearization:
    """Whitened residual rows [force, moment about the root joint's centre] and their derivatives."""

    value: Float[np.ndarray, "frames 6"]
    by_q: Float[np.ndarray, "frames 6 dofs"]
    by_v: Float[np.ndarray, "frames 6 dofs"]
    by_a: Float[np.ndarray, "frames 6 dofs"]
    by_shared: Float[np.ndarray, "frames 6 shared"]  # by φ and x, one after the other


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
        self.counts = np.flatnonzero(counts)
        self.frames = len(counts)
        self.measured = wrench_ground[self.counts]
        none = np.zeros((self.frames, 6, 0))
        self.columns = (none if columns_ground is None else columns_ground)[self.counts]
        scale = (settings.residual_force_std_N, settings.residual_moment_std_Nm)
        self.whitening = 1.0 / np.repeat(scale, 3)
        self.robust2 = settings.residual_robust_scale**2

    def cost(
        self,
        model: "ResidualModel",
        q: Float[np.ndarray, "frames dofs"],
        v: Float[np.ndarray, "frames dofs"],
        a: Float[np.ndarray, "frames dofs"],
    ) -> float:
        """The sum."""
        if not len(self.counts):
            return 0.0
        at, inertias = self.counts, model.inertias
        kinematics = ForwardKinematics(inertias.skeleton)
        poses = kinematics.poses(q[at])
        A, T = material_accelerations(kinematics, poses, q[at], v[at], a[at])
        wrench = demanded_wrench(A, T, inertias.pseudo_inertias(model.phi)).sum(axis=1)
        wrench -= self.measured + self.columns @ model.x
        centre = root_centre(root_joint(inertias.skeleton), poses)
        wrench[:, 3:] -= cross(centre, wrench[:, :3])
        squares = ((self.whitening * wrench) ** 2).sum(axis=1)
        return float(self.robust2 * np.log1p(squares / self.robust2).sum())

    def linearized(
        self,
        model: "ResidualModel",
        q: Float[np.ndarray, "frames dofs"],
        v: Float[np.ndarray, "frames dofs"],
        a: Float[np.ndarray, "frames dofs"],
        *,
        with_inertias: bool,
    ) -> ResidualLinearization:
        """Rows of all frames; zero on those of U."""
        dofs, shared = q.shape[1], len(model.x) + (model.inertias.count if with_inertias else 0)
        widths = ((6,), (6, dofs), (6, dofs), (6, dofs), (6, shared))
        whole = [np.zeros((self.frames, *width)) for width in widths]
        for low in range(0, len(self.counts), CHUNK):
            some = slice(low, low + CHUNK)
            frames = self.counts[some]
            rows = self._rows(model, some, q[frames], v[frames], a[frames], with_inertias=with_inertias)
            for target, part in zip(whole, rows, strict=True):
                target[frames] = part
        return ResidualLinearization(*whole)

    def _rows(
        self,
        model: "ResidualModel",
        some: slice,
        q: Float[np.ndarray, "some dofs"],
        v: Float[np.ndarray, "some dofs"],
        a: Float[np.ndarray, "some dofs"],
        *,
        with_inertias: bool,
    ) -> tuple[np.ndarray, ...]:
        """Whitened residuals of some frames that count, and their derivatives by q, q̇, q̈, φ and x."""
        inertias, skeleton, columns = model.inertias, model.skeleton, self.columns[some]
        terms = momentum_terms(model.rigid_bodies, q, v, a, self.measured[some] + columns @ model.x)
        kinematics = ForwardKinematics(skeleton)
        poses = kinematics.poses(q)
        root = root_joint(skeleton)
        centre = root_centre(root, poses)
        centre_by_q = point_jacobian(kinematics, poses, root.body, centre)
        com_by_q = terms.by_a[:, :3] / skeleton.mass
        arm, force = skew(terms.com_ground - centre), terms.residual[:, :3]
        value = terms.residual.copy()
        value[:, 3:] += (arm @ force[:, :, None])[:, :, 0]
        for rows in (terms.by_q, terms.by_v, terms.by_a):
            rows[:, 3:] += arm @ rows[:, :3]
        terms.by_q[:, 3:] -= skew(force) @ (com_by_q - centre_by_q)
        by_phi = np.zeros((len(q), 6, inertias.count if with_inertias else 0))
        if with_inertias:
            A, T = material_accelerations(kinematics, poses, q, v, a)
            each = demanded_wrench(A, T, inertias.derivatives(model.phi))
            for body, group in enumerate(inertias.group):
                if group >= 0:
                    by_phi[:, :, 10 * group : 10 * group + 10] += each[:, body].transpose(0, 2, 1)
        by_shared = np.concatenate([by_phi, -columns], axis=2)
        by_shared[:, 3:] -= skew(centre) @ by_shared[:, :3]
        squares = ((self.whitening * value) ** 2).sum(axis=1)
        weights = self.whitening / np.sqrt(1 + squares / self.robust2)[:, None]
        wide = weights[:, :, None]
        return weights * value, wide * terms.by_q, wide * terms.by_v, wide * terms.by_a, wide * by_shared


@dataclass(frozen=True)
class ResidualModel:
    """What trials share: inertias at φ, the model made of them, and x of the extra columns."""

    inertias: InertiaParameters
    phi: Float[np.ndarray, " parameters"]
    x: Float[np.ndarray, " extra"]

    @cached_property
    def skeleton(self) -> Skeleton:
        """With the inertias of φ."""
        return self.inertias.skeleton_at(self.phi)

    @cached_property
    def rigid_bodies(self) -> RigidBodyModel:
        """Made of that skeleton."""
        return RigidBodyModel(self.skeleton)
