"""Segment inertias as free parameters that stay physical, and the wrench that each of them demands.

A body's mass, centre of mass and inertia are one symmetric positive definite 4×4 matrix, its pseudo-inertia
`J = ∫ [x; 1][x; 1]ᵀ dm`. Here J = U₀ L(φ) L(φ)ᵀ U₀ᵀ, with U₀ the nominal factor and L upper triangular with
an exponential diagonal: any φ is a body that could exist, and φ = 0 is the nominal one (log-Cholesky
coordinates: Rucker & Wensing 2022, 10.1109/LRA.2022.3144517). Left and right share φ through a mirror.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.kinematics.scale_prior import scale_groups
from solver.skeleton.skeleton import Body, Skeleton

LIGHTEST_SEGMENT_KG = 0.3  # [kg] lighter ones (patella, talus) keep their inertia: nothing tells it

# The ten entries of L: stretches along x, y, z; shears; shifts of the centre of mass; mass.
ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2), (0, 3), (1, 3), (2, 3), (3, 3))
PER_BODY = len(ENTRIES)
LEAST_MOVED = 1e-3  # smallest eigenvalue of J that is near enough, the nominal one's all being 1
MIRROR = np.diag([1.0, 1.0, -1.0, 1.0])  # left and right are mirror images in z


@dataclass(frozen=True)
class InertiaParameters:
    """φ of all bodies that take part; `group[b]` is −1 for a body that keeps its nominal inertia."""

    skeleton: Skeleton
    factors: Float[np.ndarray, "bodies 4 4"]  # U₀, upper triangular; unused for bodies outside
    group: Int[np.ndarray, " bodies"]
    mirrored: Float[np.ndarray, "bodies 10"]  # +1 or −1: how the shared φ enters this body
    names: tuple[str, ...]  # of the groups

    @property
    def count(self) -> int:
        """Number of parameters."""
        return PER_BODY * len(self.names)

    def pseudo_inertias(self, phi: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, "bodies 4 4"]:
        """J of every body [kg, kg·m, kg·m²] at φ."""
        J = np.empty_like(self.factors)
        for b, U in enumerate(self.factors):
            if self.group[b] < 0:
                J[b] = pseudo_inertia(self.skeleton.bodies[b])
                continue
            UL = U @ _triangle(self._own(b, phi))
            J[b] = UL @ UL.T
        return J

    def derivatives(self, phi: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, "bodies 10 4 4"]:
        """∂J/∂φ of every body by its group's ten parameters; zero for bodies that keep theirs."""
        D = np.zeros((len(self.factors), PER_BODY, 4, 4))
        for b, U in enumerate(self.factors):
            if self.group[b] < 0:
                continue
            own = self._own(b, phi)
            UL = U @ _triangle(own)
            for k, (i, j) in enumerate(ENTRIES):
                dL = np.zeros((4, 4))
                dL[i, j] = np.exp(own[k]) if i == j else 1.0
                half = U @ dL @ UL.T
                D[b, k] = self.mirrored[b, k] * (half + half.T)
        return D

    def moved(
        self,
        phi: Float[np.ndarray, " parameters"],
        step: Float[np.ndarray, " parameters"],
        J: Float[np.ndarray, "bodies 4 4"],
        D: Float[np.ndarray, "bodies 10 4 4"],
    ) -> Float[np.ndarray, " parameters"]:
        """φ after a step whose size was found by the derivatives D at φ, where the bodies are J.

        The required wrench is linear in J, not in φ: so the bodies become J + D step, and φ what that
        takes. Where such a body could not exist, its φ moves by the step itself.
        """
        target = phi + step
        for group in range(len(self.names)):
            body = int(np.flatnonzero(self.group == group)[0])
            own = slice(PER_BODY * group, PER_BODY * (group + 1))
            inverse = np.linalg.inv(self.factors[body])
            moved = inverse @ (J[body] + np.einsum("k,kij->ij", step[own], D[body])) @ inverse.T
            if np.linalg.eigvalsh(moved)[0] > LEAST_MOVED:
                L = _upper_factor(moved)
                entries = [np.log(L[i, j]) if i == j else L[i, j] for i, j in ENTRIES]
                target[own] = self.mirrored[body] * entries
        return target

    def skeleton_at(self, phi: Float[np.ndarray, " parameters"]) -> Skeleton:
        """The skeleton with these inertias."""
        J = self.pseudo_inertias(phi)
        bodies = tuple(
            _with_pseudo_inertia(body, J[b]) if self.group[b] >= 0 else body
            for b, body in enumerate(self.skeleton.bodies)
        )
        return replace(self.skeleton, bodies=bodies)

    def _own(self, body: int, phi: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, "10"]:
        group = self.group[body]
        if group < 0:
            return np.zeros(PER_BODY)
        return self.mirrored[body] * phi[PER_BODY * group : PER_BODY * (group + 1)]


def inertia_parameters(skeleton: Skeleton) -> InertiaParameters:
    """Parameters of the bodies that weigh enough to matter; counterparts share theirs."""
    tied = scale_groups(skeleton)
    weighs = np.array([b.mass >= LIGHTEST_SEGMENT_KG and _is_physical(b) for b in skeleton.bodies])
    kept = [g for g in range(tied.count) if weighs[tied.group == g].all()]
    group = np.array([kept.index(g) if g in kept else -1 for g in tied.group])
    factors = np.stack(
        [
            _upper_factor(pseudo_inertia(b)) if g >= 0 else np.eye(4)
            for b, g in zip(skeleton.bodies, group, strict=True)
        ]
    )
    sign = np.array([MIRROR[i, i] * MIRROR[j, j] for i, j in ENTRIES])
    left = np.array([b.name.endswith("_l") or b.name.startswith("l_") for b in skeleton.bodies])
    mirrored = np.where(left[:, None], sign, 1.0)
    return InertiaParameters(skeleton, factors, group, mirrored, tuple(tied.names[g] for g in kept))


def prior_std(
    parameters: InertiaParameters, settings: TrajectorySettings
) -> Float[np.ndarray, " parameters"]:
    """How far each φ may go: half the relative scatter of lengths and mass, shifts in gyration radii."""
    shape, shift = settings.inertia_std / 2, settings.com_std_m
    one = []
    for g in range(len(parameters.names)):
        body = int(np.flatnonzero(parameters.group == g)[0])
        radius = np.sqrt(np.trace(parameters.factors[body][:3, :3] @ parameters.factors[body][:3, :3].T) / 3)
        mass = parameters.factors[body][3, 3]
        one.append(
            np.concatenate([np.full(6, shape), np.full(3, shift * mass / radius), [settings.mass_std / 2]])
        )
    return np.concatenate(one) if one else np.zeros(0)


def pseudo_inertia(body: Body) -> Float[np.ndarray, "4 4"]:
    """J of a body about its origin, in its frame."""
    second = 0.5 * np.trace(body.inertia_body) * np.eye(3) - body.inertia_body
    J = np.zeros((4, 4))
    J[:3, :3] = second + body.mass * np.outer(body.com_body, body.com_body)
    J[:3, 3] = J[3, :3] = body.mass * body.com_body
    J[3, 3] = body.mass
    return J


def required_wrench(
    acceleration: Float[np.ndarray, "frames bodies 3 4"],
    T_ground_body: Float[np.ndarray, "frames bodies 4 4"],
    J: Float[np.ndarray, "bodies *parameters 4 4"],
) -> Float[np.ndarray, "frames bodies *parameters 6"]:
    """Force and moment about the ground origin that moving these (changes of) pseudo-inertias takes.

    Args:
        acceleration: A with ẍ − g = A [x_body; 1] for material points of each body [m/s²].
        T_ground_body: homogeneous poses.
        J: of each body, or any number of changes of it.
    """
    extra = J.ndim - 3
    A = acceleration.reshape(*acceleration.shape[:2], *(1,) * extra, 3, 4)
    T = T_ground_body.reshape(*T_ground_body.shape[:2], *(1,) * extra, 4, 4)
    P = A @ J[None] @ np.swapaxes(T, -1, -2)  # ∫ (ẍ − g)[x; 1]ᵀ dm in the ground frame
    return np.stack(
        [
            P[..., 0, 3],
            P[..., 1, 3],
            P[..., 2, 3],
            P[..., 2, 1] - P[..., 1, 2],
            P[..., 0, 2] - P[..., 2, 0],
            P[..., 1, 0] - P[..., 0, 1],
        ],
        axis=-1,
    )


def wrench_by_parameters(
    acceleration: Float[np.ndarray, "frames bodies 3 4"],
    T_ground_body: Float[np.ndarray, "frames bodies 4 4"],
    parameters: InertiaParameters,
    derivatives: Float[np.ndarray, "bodies 10 4 4"],
) -> Float[np.ndarray, "frames 6 parameters"]:
    """Derivative of the whole body's required wrench by φ.

    Args:
        acceleration: as `required_wrench` takes it.
        T_ground_body: likewise.
        parameters: φ's bodies.
        derivatives: of their pseudo-inertias, by their groups' ten parameters.
    """
    frames = len(acceleration)
    by_phi = np.zeros((frames, 6, parameters.count))
    by_J = np.zeros((frames, 6, 4, 4))  # of one body's wrench
    for body, group in enumerate(parameters.group):
        if group < 0:
            continue
        A, T = acceleration[:, body], T_ground_body[:, body]
        by_J[:, :3, :, 3] = A
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            by_J[:, 3 + i] = A[:, k, :, None] * T[:, j, None, :] - A[:, j, :, None] * T[:, k, None, :]
        own = by_J.reshape(-1, 16) @ derivatives[body].reshape(PER_BODY, 16).T
        by_phi[:, :, PER_BODY * group : PER_BODY * (group + 1)] += own.reshape(frames, 6, PER_BODY)
    return by_phi


def _triangle(own: Float[np.ndarray, "10"]) -> Float[np.ndarray, "4 4"]:
    L = np.zeros((4, 4))
    for value, (i, j) in zip(own, ENTRIES, strict=True):
        L[i, j] = np.exp(value) if i == j else value
    return L


def _upper_factor(J: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "4 4"]:
    """U upper triangular with U Uᵀ = J."""
    flip = np.eye(4)[::-1]
    return flip @ np.linalg.cholesky(flip @ J @ flip) @ flip


def _with_pseudo_inertia(body: Body, J: Float[np.ndarray, "4 4"]) -> Body:
    mass, com = J[3, 3], J[:3, 3] / J[3, 3]
    second = J[:3, :3] - mass * np.outer(com, com)
    return replace(body, mass=float(mass), com_body=com, inertia_body=np.trace(second) * np.eye(3) - second)


def _is_physical(body: Body) -> bool:
    """Whether some distribution of mass has this inertia (the triangle inequalities)."""
    return bool(np.linalg.eigvalsh(pseudo_inertia(body))[0] > 1e-9) if body.mass > 0 else False
