"""Levenberg-Marquardt on many frames at once; each has its own damping and stops when it has converged.

Start poses for any heading and posture: rigid alignment of a few postures, the best after refinement.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.common.frames_at_once import FRAMES_AT_ONCE, spans
from solver.kinematics.marker_terms import MarkerTerms
from solver.kinematics.root_joint import RootJoint
from solver.kinematics.settings import KinematicsSettings
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.rotations import nearest_rotation
from solver.skeleton.skeleton import Skeleton

CHUNK = 256  # frames worked on together: their arrays stay in the processor's cache
INITIAL_DAMPING = 1e-3  # of the diagonal; small, because most starts are close

FLEXED = {"hip_flexion": 1.4, "knee_angle": 1.4, "knee_flexion": 1.4}  # rad; sitting, squatting, landing
ONE_WAY_RAD = 1.5  # range of a joint that may bend far to one side
SLIGHTLY_BENT = 0.2  # of that range
STARTS_REFINED = 2  # starts a frame that are refined to the end
LUMBAR = "lumbar_extension"
REACHING = {"arm_flex": 1.2, "arm_add": -0.6, "elbow_flex": 1.2}  # rad; arms up and in front
LUMBAR_STD_RAD = (
    0.05  # 3°, of a frame: the distance of hips and shoulders, of which 1 cm would be 24°, has no say
)


@dataclass(frozen=True)
class FrameTerms:
    """Cost, gradient and Gauss-Newton matrix of some frames."""

    cost: Float[np.ndarray, " frames"]
    H: Float[np.ndarray, "frames dofs dofs"]
    g: Float[np.ndarray, "frames dofs"]


class PoseProblem:
    """Poses of one skeleton against measured markers, frame by frame.

    Per frame: Σ_m w_m ρ(‖f_m(q) − o_m‖²)/σ² + limits + a weak pull to `reference_q`, with Cauchy's ρ.
    """

    def __init__(
        self,
        skeleton: Skeleton,
        observed_ground: Float[np.ndarray, "frames markers 3"],
        settings: KinematicsSettings,
        robust_scale_m: float | None = None,
    ) -> None:
        """Prepare the problem.

        Args:
            skeleton: whose markers are those of `observed_ground`, in the same order.
            observed_ground: NaN where unseen [m].
            settings: weights.
            robust_scale_m: in place of the settings' own [m].
        """
        self.kinematics = ForwardKinematics(skeleton)
        self.terms = MarkerTerms(self.kinematics)
        self.seen = np.isfinite(observed_ground).all(axis=2)
        self.observed = np.where(self.seen[:, :, None], observed_ground, 0.0)
        self.settings = settings
        self.robust_scale_m = robust_scale_m or settings.robust_scale_m
        self.reference_q = np.tile(skeleton.default_q, (observed_ground.shape[0], 1))
        root = root_dofs(skeleton)
        self.pose_precision = pose_precision(skeleton, settings.pose_std_rad)
        limits = np.array([c.range for c in skeleton.free_coordinates]).reshape(-1, 2)
        self.lower = np.where(root, -np.inf, limits[:, 0])
        self.upper = np.where(root, np.inf, limits[:, 1])

    def evaluate(
        self, q: Float[np.ndarray, "some dofs"], frames: Int[np.ndarray, " some"], robust: bool = True
    ) -> FrameTerms:
        """Terms at q for the given frames (a frame may appear several times, with different q)."""
        parts = [
            self._evaluate(q[i : i + CHUNK], frames[i : i + CHUNK], robust)
            for i in range(0, len(frames), CHUNK)
        ]
        return FrameTerms(
            np.concatenate([p.cost for p in parts]),
            np.concatenate([p.H for p in parts]),
            np.concatenate([p.g for p in parts]),
        )

    def cost(
        self, q: Float[np.ndarray, "frames dofs"], frames: Int[np.ndarray, " frames"]
    ) -> Float[np.ndarray, " frames"]:
        """The robust cost alone; arguments as in `evaluate`."""
        costs = []
        for i in range(0, len(frames), CHUNK):
            some, at = frames[i : i + CHUNK], q[i : i + CHUNK]
            _, squares = self._errors(self.kinematics.markers(self.kinematics.poses(at)), some)
            costs.append(self._marker_cost(squares, robust=True) + self._priors(at, some)[0])
        return np.concatenate(costs)

    def _errors(
        self, x: Float[np.ndarray, "some markers 3"], frames: Int[np.ndarray, " some"]
    ) -> tuple[Float[np.ndarray, "some markers 3"], Float[np.ndarray, "some markers"]]:
        error = np.where(self.seen[frames][:, :, None], x - self.observed[frames], 0.0)
        return error, np.einsum("tmi,tmi->tm", error, error)

    def _marker_cost(
        self, squares: Float[np.ndarray, "some markers"], robust: bool
    ) -> Float[np.ndarray, " some"]:
        precision, c2 = self.settings.marker_std_m**-2, self.robust_scale_m**2
        if not robust:
            return precision * squares.sum(axis=1)
        return precision * c2 * np.log1p(squares / c2).sum(axis=1)

    def _priors(
        self, q: Float[np.ndarray, "some dofs"], frames: Int[np.ndarray, " some"]
    ) -> tuple[Float[np.ndarray, " some"], Float[np.ndarray, "some dofs"], Float[np.ndarray, "some dofs"]]:
        """Cost, gradient and diagonal of the limits and of the pull to the reference pose."""
        beyond = q - np.clip(q, self.lower, self.upper)
        stiffness = self.settings.limit_std_rad**-2
        pull = q - self.reference_q[frames]
        cost = stiffness * (beyond**2).sum(axis=1) + (self.pose_precision * pull**2).sum(axis=1)
        return (
            cost,
            stiffness * beyond + self.pose_precision * pull,
            stiffness * (beyond != 0) + self.pose_precision,
        )

    def _evaluate(
        self, q: Float[np.ndarray, "some dofs"], frames: Int[np.ndarray, " some"], robust: bool
    ) -> FrameTerms:
        poses = self.kinematics.poses(q)
        x = self.kinematics.markers(poses)
        error, squares = self._errors(x, frames)
        weight = self.seen[frames] * self.settings.marker_std_m**-2
        if robust:
            weight = weight / (1 + squares / self.robust_scale_m**2)
        H, g = self.terms.normal_equations(poses, x, error, weight)
        prior_cost, prior_g, prior_diagonal = self._priors(q, frames)
        diagonal = np.arange(q.shape[1])
        H[:, diagonal, diagonal] += prior_diagonal
        return FrameTerms(self._marker_cost(squares, robust) + prior_cost, H, g + prior_g)


def solve_frames(
    problem: PoseProblem,
    q0: Float[np.ndarray, "some dofs"],
    frames: Int[np.ndarray, " some"],
    *,
    robust: bool = True,
    max_iterations: int | None = None,
    after_iteration: Callable[[], None] = lambda: None,
) -> tuple[Float[np.ndarray, "some dofs"], Float[np.ndarray, " some"]]:
    """Levenberg-Marquardt from q0.

    Args:
        problem: what to minimize.
        q0: start poses [rad or m].
        frames: which frame of the problem each start belongs to.
        robust: False for far starts, where the Cauchy loss would let go of everything.
        max_iterations: in place of the settings' own.
        after_iteration: called between iterations; may raise `Cancelled`.

    Returns:
        Poses and their costs.
    """
    if len(frames) > FRAMES_AT_ONCE:
        parts = [
            solve_frames(
                problem,
                q0[some],
                frames[some],
                robust=robust,
                max_iterations=max_iterations,
                after_iteration=after_iteration,
            )
            for some in spans(len(frames))
        ]
        return np.concatenate([q for q, _ in parts]), np.concatenate([cost for _, cost in parts])
    q = q0.copy()
    now = problem.evaluate(q, frames, robust)
    cost, H, g = now.cost.copy(), now.H, now.g
    damping = np.full(len(frames), INITIAL_DAMPING)
    active = np.arange(len(frames))
    for _ in range(max_iterations or problem.settings.iterations):
        if not len(active):
            break
        after_iteration()
        step = _steps(H[active], g[active], damping[active])
        tried = problem.evaluate(q[active] + step, frames[active], robust)
        better = tried.cost < cost[active]
        decrease = cost[active] - tried.cost
        small = np.abs(step).max(axis=1) < 1e-6
        converged = (better & (decrease <= problem.settings.tolerance * cost[active])) | small
        accepted = active[better]
        q[accepted] += step[better]
        cost[accepted], H[accepted], g[accepted] = tried.cost[better], tried.H[better], tried.g[better]
        damping[active] = np.where(better, damping[active] / 10, damping[active] * 10)
        active = active[~converged & (damping[active] < 1e8)]
    return q, cost


def _steps(
    H: Float[np.ndarray, "some dofs dofs"],
    g: Float[np.ndarray, "some dofs"],
    damping: Float[np.ndarray, " some"],
) -> Float[np.ndarray, "some dofs"]:
    diagonal = np.arange(g.shape[1])
    damped = H.copy()
    own = H[:, diagonal, diagonal]
    damped[:, diagonal, diagonal] += damping[:, None] * own + 1e-9 * own.max(axis=1, keepdims=True) + 1e-12
    return np.linalg.solve(damped, -g[:, :, None])[:, :, 0]


def root_dofs(skeleton: Skeleton) -> Bool[np.ndarray, " dofs"]:
    """Which of q place the root body in the ground: those of joints whose parent is the ground."""
    names = {a.coordinate for j in skeleton.joints if j.parent < 0 for a in j.axes}
    return np.array([d in names for d in skeleton.dofs])


def pelvis_is_bare(skeleton: Skeleton) -> bool:
    """Whether no marker of its own shows how the pelvis is tilted between the legs and the trunk."""
    carrying = {skeleton.joints[marker.body].parent for marker in skeleton.markers}
    return LUMBAR in skeleton.dofs and -1 not in carrying


def pose_precision(
    skeleton: Skeleton, std_rad: float | Float[np.ndarray, " dofs"]
) -> Float[np.ndarray, " dofs"]:
    """Of the pull to a posture or to another motion [1/rad²]; none for the root.

    Args:
        skeleton: its markers are those observed.
        std_rad: of the dofs; a back whose pelvis has no marker is held nearer.
    """
    precision = np.where(root_dofs(skeleton), 0.0, std_rad**-2)
    if pelvis_is_bare(skeleton):
        precision[skeleton.dofs.index(LUMBAR)] = LUMBAR_STD_RAD**-2
    return precision


def start_postures(skeleton: Skeleton) -> Float[np.ndarray, "postures dofs"]:
    """Upright, flexed, and upright with raised arms; by the field's coordinate names, within the ranges.

    Joints that bend one way, as elbows do, start a little bent: a straight one may as well bend backwards and
    turn about itself, where one marker beyond it is all that tells.
    """
    low, high = np.array([c.range for c in skeleton.free_coordinates]).reshape(-1, 2).T
    upright = np.clip(skeleton.default_q, low, high)
    room = high - low
    wide = np.isfinite(room) & (room > ONE_WAY_RAD) & (room < 2 * np.pi)
    little = SLIGHTLY_BENT * np.where(wide, room, 0.0)
    upright += np.where(upright - low < 0.5 * little, little, 0.0)
    upright -= np.where(high - upright < 0.5 * little, little, 0.0)
    postures = [upright, _bent(skeleton, upright, FLEXED), _bent(skeleton, upright, REACHING)]
    return np.unique(np.array(postures), axis=0)


def initial_poses(
    problem: PoseProblem, root: RootJoint, frames: Int[np.ndarray, " some"]
) -> tuple[Float[np.ndarray, "some dofs"], Float[np.ndarray, " some"]]:
    """Poses of single frames from nothing but their markers.

    Args:
        problem: markers and skeleton.
        root: of the skeleton.
        frames: which frames; each is started from every posture, aligned by all markers and by the root's.

    Returns:
        The best pose of each frame, and its robust cost.
    """
    skeleton = problem.kinematics.skeleton
    postures = start_postures(skeleton)
    near_root = problem.kinematics.marker_bodies == root.body
    weights = [np.ones(len(near_root))]
    if near_root.sum() >= 3:
        weights.append(np.where(near_root, 1.0, 0.02))
    starts = [aligned(problem, root, posture, frames, weight) for posture in postures for weight in weights]
    which = np.tile(frames, len(starts))
    rough, cost = solve_frames(problem, np.concatenate(starts), which, robust=False, max_iterations=8)
    order = cost.reshape(len(starts), -1).argsort(axis=0)[:STARTS_REFINED]
    kept = (order * len(frames) + np.arange(len(frames))).ravel()
    q, cost = solve_frames(problem, rough[kept], which[kept])
    best = cost.reshape(-1, len(frames)).argmin(axis=0)
    index = best * len(frames) + np.arange(len(frames))
    return q[index], cost[index]


def aligned(
    problem: PoseProblem,
    root: RootJoint,
    posture: Float[np.ndarray, " dofs"],
    frames: Int[np.ndarray, " some"],
    weight: Float[np.ndarray, " markers"],
) -> Float[np.ndarray, "some dofs"]:
    """The posture, moved as a rigid whole onto each frame's markers (Kabsch)."""
    poses = problem.kinematics.poses(posture[None])
    model = problem.kinematics.markers(poses)[0]
    w = problem.seen[frames] * weight
    w = w / np.maximum(w.sum(axis=1, keepdims=True), 1e-12)
    observed = problem.observed[frames]
    centre_model = w @ model
    centre_observed = np.einsum("tm,tmi->ti", w, observed)
    covariance = np.einsum(
        "tm,tmi,tmj->tij", w, observed - centre_observed[:, None], model[None] - centre_model[:, None]
    )
    R = nearest_rotation(covariance)
    R_ground_root = R @ poses.R_ground_body[0, root.body]
    arm = poses.p_ground_body[0, root.body] - centre_model
    p_ground_root = centre_observed + (R @ arm[:, :, None])[:, :, 0]
    q = np.tile(posture, (len(frames), 1))
    q[:, root.dofs] = root.coordinates(R_ground_root, p_ground_root)
    return q


def _bent(
    skeleton: Skeleton, upright: Float[np.ndarray, " dofs"], angles: dict[str, float]
) -> Float[np.ndarray, " dofs"]:
    posture = upright.copy()
    for i, coordinate in enumerate(skeleton.free_coordinates):
        stem = coordinate.name.removesuffix("_r").removesuffix("_l")
        if stem in angles:
            low, high = coordinate.range
            bend = angles[stem] if low <= angles[stem] <= high else -angles[stem]
            posture[i] = np.clip(bend, low, high)
    return posture
