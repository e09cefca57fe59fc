"""Inverse kinematics of a whole trial: min over q_t of Σ‖f(q_t, s) − o_t‖², robust, continuous over gaps."""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.linalg import solveh_banded

from solver.common.errors import FitError
from solver.common.frames_at_once import FRAMES_AT_ONCE, by_frames, joined, overlapping
from solver.common.one_thread import one_thread
from solver.common.progress import Progress, silent
from solver.common.true_runs import runs
from solver.kinematics.determined import posed_frames
from solver.kinematics.frame_solver import PoseProblem, initial_poses, solve_frames
from solver.kinematics.root_joint import RootJoint, root_joint
from solver.kinematics.settings import KinematicsSettings
from solver.skeleton.skeleton import Skeleton

# [rad/s² or m/s²] bridges gaps; a hundred times above human accelerations, so no filter
SMOOTHNESS_STD = 1.0e4
KEYFRAME_SPACING_S = 0.4  # [s] frames solved from several start poses; the rest start between them

FEWEST_MARKERS = 3  # seen on a frame for it to say anything about the pose
MOST_BRIDGING_STEPS = 2
SMALL_STEP = 0.01  # rad or m: one Gauss-Newton step of that size lands within 1e-4
COST_OF_SMOOTHNESS = 0.01  # of a marker at one standard deviation; a frame that pays more keeps its pose
REFINEMENT = 8  # each pass solves that many times more frames, started between those already solved
MOST_TRACKING_STEPS = 15  # for stragglers; what they miss, their neighbours and the last step correct
WORSE_THAN_NEIGHBOURS = 1.5  # times their cost: such a frame is started again from both sides
WORSE_PER_MARKER = 0.2  # and by that much a marker, in squares of the expected error
BRIDGED_AT_ONCE = 6000  # frames of a longer trial in one pass; a pass of 8192 takes half a GB
BRIDGED_TWICE = 600  # of these shared by neighbours: bridges of 3 s at 100 Hz do not feel the border
MOST_RETRIES = 50  # each corrects the edge of a bad stretch by one frame


def inverse_kinematics(
    skeleton: Skeleton,
    observed_ground: Float[np.ndarray, "frames markers 3"],
    rate: float,
    settings: KinematicsSettings,
    progress: Progress = silent,
) -> Float[np.ndarray, "frames dofs"]:
    """Poses of all frames that have one: NaN where the markers leave open where the person is.

    Key frames are solved from several postures; the others start between their solved neighbours, so most
    need two iterations. A last step over each stretch with poses bridges what no marker saw.

    Args:
        skeleton: scaled; its markers are those of `observed_ground`, in the same order.
        observed_ground: measured markers, NaN where unseen [m].
        rate: [Hz].
        settings: weights and thresholds.
        progress: told the fraction done; may raise `Cancelled`.

    Raises:
        FitError: on no frame do the markers determine the pose.
    """
    with one_thread():
        problem = PoseProblem(skeleton, observed_ground, settings)
        root = root_joint(skeleton)
        usable = np.flatnonzero(problem.seen.sum(axis=1) >= FEWEST_MARKERS)
        if not len(usable):
            raise FitError(
                f"No frame shows {FEWEST_MARKERS} or more markers that the model '{skeleton.name}' knows."
            )
        q = np.tile(skeleton.default_q, (len(observed_ground), 1))
        spacing = max(1, round(KEYFRAME_SPACING_S * rate))
        q[usable] = _track(problem, root, usable, spacing, progress)
        posed, own = posed_frames(problem, q, usable, rate)
        if not own.any():
            on = [skeleton.bodies[body].name for body in sorted({m.body for m in skeleton.markers})]
            raise FitError(
                "The markers determine no pose on any frame: a person is placed by pelvis and legs, pelvis "
                f"and trunk, or legs and trunk, seen together; here markers are on {', '.join(on)}. Neither "
                "angles nor torques can be told."
            )
        usable = np.flatnonzero(own)
        q = _unwrapped(q, usable, _turning_round(problem))
        progress("inverse kinematics", 0.9)
        q = _bridged(problem, q, usable, posed, rate)
        progress("inverse kinematics", 1.0)
        return q


def _track(
    problem: PoseProblem,
    root: RootJoint,
    usable: Int[np.ndarray, " usable"],
    spacing: int,
    progress: Progress,
) -> Float[np.ndarray, "usable dofs"]:
    """Solve key frames from scratch, then halve the gaps until all usable frames are solved."""
    count = len(usable)
    turning = _turning_round(problem)
    stride = 1 << max(0, spacing.bit_length() - 1)
    keys = np.unique(np.append(np.arange(0, count, stride), count - 1))
    poses = np.zeros((count, problem.kinematics.chain.dofs))
    cost = np.zeros(count)
    poses[keys], cost[keys] = initial_poses(problem, root, usable[keys])
    keys_q = np.unwrap(poses[keys], axis=0)
    poses[np.ix_(keys, turning)] = keys_q[:, turning]
    solved = np.zeros(count, dtype=bool)
    solved[keys] = True
    while stride > 1:
        stride = max(1, stride // REFINEMENT)
        fresh = np.setdiff1d(np.arange(0, count, stride), np.flatnonzero(solved))
        if not len(fresh):
            continue
        known = np.flatnonzero(solved)
        start = _between(fresh, known, poses)
        poses[fresh], cost[fresh] = solve_frames(
            problem,
            start,
            usable[fresh],
            max_iterations=MOST_TRACKING_STEPS,
            after_iteration=lambda: progress("inverse kinematics", 0.1),
        )
        solved[fresh] = True
        progress("inverse kinematics", 0.8 * solved.mean())
    _retry_worse_than_neighbours(problem, usable, poses, cost)
    return poses


def _between(
    fresh: Int[np.ndarray, " fresh"], known: Int[np.ndarray, " known"], poses: Float[np.ndarray, "count dofs"]
) -> Float[np.ndarray, "fresh dofs"]:
    """Linear between the nearest solved frames."""
    right = (
        np.clip(np.searchsorted(known, fresh), 1, len(known) - 1) if len(known) > 1 else np.zeros_like(fresh)
    )
    left = np.maximum(right - 1, 0)
    a, b = known[left], known[right]
    fraction = np.clip((fresh - a) / np.maximum(b - a, 1), 0.0, 1.0)[:, None]
    return poses[a] + fraction * (poses[b] - poses[a])


def _retry_worse_than_neighbours(
    problem: PoseProblem,
    usable: Int[np.ndarray, " usable"],
    poses: Float[np.ndarray, "usable dofs"],
    cost: Float[np.ndarray, " usable"],
) -> None:
    """Frames in a worse minimum than their neighbours are started again from the neighbours' poses."""
    per_marker = cost / np.maximum(problem.seen[usable].sum(axis=1), 1)
    for _ in range(MOST_RETRIES):
        padded = np.pad(per_marker, 1, mode="edge")
        best_neighbour = np.minimum(padded[:-2], padded[2:])
        bad = np.flatnonzero(per_marker > WORSE_THAN_NEIGHBOURS * best_neighbour + WORSE_PER_MARKER)
        if not len(bad):
            return
        from_left, from_right = np.maximum(bad - 1, 0), np.minimum(bad + 1, len(usable) - 1)
        start = np.concatenate([poses[from_left], poses[from_right]])
        q, tried = solve_frames(problem, start, usable[np.tile(bad, 2)])
        tried, q = tried.reshape(2, -1), q.reshape(2, len(bad), -1)
        better_side = tried.argmin(axis=0)
        pick = np.arange(len(bad))
        improved = tried[better_side, pick] < 0.9 * cost[bad]
        if not improved.any():
            return
        rows = bad[improved]
        poses[rows] = q[better_side, pick][improved]
        cost[rows] = tried[better_side, pick][improved]
        per_marker = cost / np.maximum(problem.seen[usable].sum(axis=1), 1)


def _turning_round(problem: PoseProblem) -> Int[np.ndarray, " turning"]:
    """Angles that may make whole turns; of any other, a jump is no turn but another way to lie on markers."""
    skeleton = problem.kinematics.skeleton
    rotations = {a.coordinate for j in skeleton.joints for a in j.axes if a.kind == "rotation"}
    free = problem.upper - problem.lower >= 2 * np.pi
    return np.flatnonzero([d in rotations and f for d, f in zip(skeleton.dofs, free, strict=True)])


def _unwrapped(
    q: Float[np.ndarray, "frames dofs"],
    usable: Int[np.ndarray, " usable"],
    turning: Int[np.ndarray, " turning"],
) -> Float[np.ndarray, "frames dofs"]:
    """Angles without jumps of whole turns, starting within half a turn; unusable frames filled linearly."""
    known = q[usable]
    known[:, turning] = np.unwrap(known[:, turning], axis=0)
    known[:, turning] -= 2 * np.pi * np.round(known[len(known) // 2, turning] / (2 * np.pi))
    frames = np.arange(len(q))
    return np.stack([np.interp(frames, usable, column) for column in known.T], axis=1)


def _bridged(
    problem: PoseProblem,
    q: Float[np.ndarray, "frames dofs"],
    usable: Int[np.ndarray, " usable"],
    posed: Bool[np.ndarray, " frames"],
    rate: float,
) -> Float[np.ndarray, "frames dofs"]:
    """One Gauss-Newton pass over each stretch with poses, with a whisper of smoothness; NaN elsewhere.

    Where markers see a degree of freedom they decide; where they don't, it moves smoothly from the last frame
    that saw it to the next.
    """
    reference = _reference(problem, q)
    whole = np.full_like(q, np.nan)
    for start, end in runs(posed):
        whole[start:end] = q[start:end]
        if end - start < 3:
            continue
        parts = overlapping(end - start, most=FRAMES_AT_ONCE, window=BRIDGED_AT_ONCE, shared=BRIDGED_TWICE)
        parts = [slice(start + part.start, start + part.stop) for part in parts]
        bridged = [
            _bridged_part(problem, q[some], some, reference=reference, usable=usable, rate=rate)
            for some in parts
        ]
        whole[start:end] = joined(bridged, [some.start - start for some in parts])
    return whole


def _bridged_part(
    problem: PoseProblem,
    q: Float[np.ndarray, "some dofs"],
    part: slice,
    *,
    reference: Float[np.ndarray, "frames dofs"],
    usable: Int[np.ndarray, " usable"],
    rate: float,
) -> Float[np.ndarray, "some dofs"]:
    frames = np.arange(part.start, part.stop)
    smooth = (rate**2 / SMOOTHNESS_STD) ** 2
    unusable = ~np.isin(frames, usable)
    terms = problem.evaluate(q, frames)
    terms.g[:] += problem.pose_precision * (problem.reference_q[part] - reference[part])
    problem.reference_q[part] = reference[part]
    for _ in range(MOST_BRIDGING_STEPS):
        step = _smoothed_step(terms.H, terms.g, q, smooth)
        allowed = terms.cost + COST_OF_SMOOTHNESS * problem.seen[part].sum(axis=1) + 1e-9
        accepted = (problem.cost(q + step, frames) <= allowed) | unusable
        q = np.where(accepted[:, None], q + step, q)
        if np.abs(step).max() < SMALL_STEP:
            break
        terms = problem.evaluate(q, frames)
    return q


def _reference(problem: PoseProblem, q: Float[np.ndarray, "frames dofs"]) -> Float[np.ndarray, "frames dofs"]:
    """Where no marker sees a dof for a while, its reference is the line between the frames that saw it."""
    frames = np.arange(len(q))
    stiffness = by_frames(
        lambda some, at: np.einsum("tii->ti", problem.evaluate(some, at).H).copy(), q, frames
    )
    own = stiffness - problem.pose_precision
    sees = own > 10.0 * np.maximum(problem.pose_precision, 1e-6)
    reference = problem.reference_q.copy()
    for dof in range(q.shape[1]):
        known = frames[sees[:, dof]]
        if len(known):
            reference[:, dof] = np.interp(frames, known, q[known, dof])
    return reference


def _smoothed_step(
    H: Float[np.ndarray, "frames dofs dofs"],
    g: Float[np.ndarray, "frames dofs"],
    q: Float[np.ndarray, "frames dofs"],
    smooth: float,
) -> Float[np.ndarray, "frames dofs"]:
    """Solve the block-banded system: H_t on the diagonal, `smooth` times the squared second difference."""
    frames, dofs = q.shape
    band = np.zeros((2 * dofs + 1, frames * dofs))  # row r, column c: entry (c + r, c) below the diagonal
    column = np.arange(frames) * dofs
    diagonal_of_DtD = _second_difference_square(frames)
    for j in range(dofs):
        for i in range(j, dofs):
            band[i - j, column + j] = H[:, i, j]
        for lag in range(3):
            band[lag * dofs, (column + j)[: frames - lag]] += smooth * diagonal_of_DtD[lag][: frames - lag]
    band[0] += 1e-9
    curvature = np.diff(q, n=2, axis=0)
    bend = np.zeros_like(q)
    bend[:-2] += curvature
    bend[1:-1] -= 2 * curvature
    bend[2:] += curvature
    right = -(g + smooth * bend)
    return solveh_banded(band, right.ravel(), lower=True, check_finite=False).reshape(frames, dofs)


def _second_difference_square(frames: int) -> tuple[Float[np.ndarray, " frames"], ...]:
    """Main diagonal and the two below it of DᵀD, D the second difference."""
    main, first, second = np.zeros(frames), np.zeros(frames), np.zeros(frames)
    for offset, own in enumerate((1.0, -2.0, 1.0)):
        main[offset : frames - 2 + offset] += own**2
    first[: frames - 2] += -2.0
    first[1 : frames - 1] += -2.0
    second[: frames - 2] += 1.0
    return main, first, second
