"""On which frames the markers determine a pose, and on which nobody can say where the person is.

What markers tell is the information of the frame's own least-squares problem, JᵀWJ; what people can do adds a
little: a joint is within a radian of where it usually is. Two markers of a foot, or the five of an arm, leave
the pelvis anywhere on a sphere; a leg and a spine, or a pelvis and one thigh, place the whole person.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.common.frames_at_once import by_frames
from solver.common.true_runs import runs
from solver.kinematics.frame_solver import PoseProblem, root_dofs
from solver.kinematics.settings import KinematicsSettings
from solver.skeleton.segment_tables import RANGES_DEG
from solver.skeleton.skeleton import Skeleton

JOINT_STD_RAD = 0.5  # of a joint that no marker shows, about the pose the fit gives it
PLACED_M = 0.1  # the root's standard deviation, at most
TURNED_RAD = 0.4  # likewise, about its least certain axis: what one free joint between it and markers leaves
USUALLY_SHOWN_SHARE = 0.8  # of the coordinates that a trial usually shows, where a stretch begins and ends
SHOWN_STD_SHARE = 0.7  # of JOINT_STD_RAD: with less left, markers show a coordinate
BEYOND_RAD = 0.35  # past people's ranges of motion; joints of sound recordings go 0.2 past them at most
BRIDGED_S = 0.2  # a shorter gap is bridged by the motion before and after, within about a centimetre


def posed_frames(
    problem: PoseProblem, q: Float[np.ndarray, "frames dofs"], usable: Int[np.ndarray, " usable"], rate: float
) -> tuple[Bool[np.ndarray, " frames"], Bool[np.ndarray, " frames"]]:
    """Frames that have a pose, short gaps among them; and those whose own markers determine it.

    Args:
        problem: markers and skeleton.
        q: fitted poses.
        usable: frames that were fitted to markers.
        rate: [Hz].
    """
    shown = np.zeros(len(q))
    if len(usable):
        placed, told = by_frames(lambda some, at: _determined(problem, some, at), q[usable], usable).T
        shown[usable] = np.where(placed, told, 0.0)
    own, short = shown >= problem.settings.fewest_seen_share, BRIDGED_S * rate
    posed = own.copy()
    for start, end in runs(~own):
        if start > 0 and end < len(own) and end - start <= short:
            posed[start:end] = True
    seen = [_entered(shown, start, end) for start, end in runs(posed)]
    longest = max((end - start for start, end in seen), default=0)
    posed[:] = False
    for start, end in seen:
        posed[start:end] = end - start >= min(short, longest)
    return posed, own & posed


def left_open(
    skeleton: Skeleton,
    observed_ground: Float[np.ndarray, "frames markers 3"],
    q: Float[np.ndarray, "frames dofs"],
    settings: KinematicsSettings,
) -> Bool[np.ndarray, "frames dofs"]:
    """Coordinates that all the person's markers together would show, and those seen on a frame do not.

    Args:
        skeleton: its markers are those of `observed_ground`, in the same order; some recording shows each.
        observed_ground: NaN where unseen [m].
        q: fitted poses; where there is none (NaN), everything is open.
        settings: of the fit.
    """
    posed, seen = np.isfinite(q).all(axis=1), np.isfinite(observed_ground).all(axis=2)
    result = np.tile(~posed[:, None], q.shape[1])
    gaps = np.flatnonzero(posed & ~seen.all(axis=1))
    if len(gaps):
        problems = (
            PoseProblem(skeleton, x, settings) for x in (observed_ground, np.nan_to_num(observed_ground))
        )
        own, together = (
            by_frames(lambda some, at, of=of: _shown(_covariance(of, some, at, robust=False)), q[gaps], gaps)
            for of in problems
        )
        result[gaps] = together & ~own & ~root_dofs(skeleton)
    return result


def beyond_bridges(
    open_there: Bool[np.ndarray, "frames dofs"], rate: float
) -> Bool[np.ndarray, "frames dofs"]:
    """Those that the motion before and after does not tell; half as many frames where one of them lacks.

    Args:
        open_there: coordinates that a frame's own markers leave open.
        rate: [Hz].
    """
    result = np.zeros_like(open_there)
    for dof in np.flatnonzero(open_there.any(axis=0)):
        for start, end in runs(open_there[:, dof]):
            sides = int(start > 0) + int(end < len(open_there))
            result[start:end, dof] = end - start > sides * BRIDGED_S / 2 * rate
    return result


def beyond_people(
    skeleton: Skeleton, q: Float[np.ndarray, "frames dofs"], rate: float
) -> Bool[np.ndarray, "frames dofs"]:
    """Where markers have a joint of the default body bend as nobody's does, and half a bridge around.

    The ranges of a model of the user's own are its author's, and tell nothing of people.

    Args:
        skeleton: fitted.
        q: fitted poses; NaN where there is none.
        rate: [Hz].
    """
    result = np.zeros(q.shape, dtype=bool)
    around = round(BRIDGED_S / 2 * rate) + 1
    for dof, coordinate in enumerate(skeleton.free_coordinates):
        low, high = np.radians(RANGES_DEG.get(coordinate.name[:-2], RANGES_DEG.get(coordinate.name, (0, 0))))
        if low < high and np.allclose(coordinate.range, (low, high)):
            beyond = (q[:, dof] < low - BEYOND_RAD) | (q[:, dof] > high + BEYOND_RAD)
            for start, end in runs(beyond):
                result[max(0, start - around) : end + around, dof] = True
    return result


def _shown(covariance: Float[np.ndarray, "some dofs dofs"]) -> Bool[np.ndarray, "some dofs"]:
    return np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)) < SHOWN_STD_SHARE * JOINT_STD_RAD


def _entered(shown: Float[np.ndarray, " frames"], start: int, end: int) -> tuple[int, int]:
    """Without ends on which a leg is still, or already, out of sight: beyond an end nothing bridges."""
    whole = start + np.flatnonzero(shown[start:end] >= USUALLY_SHOWN_SHARE)
    return (int(whole[0]), int(whole[-1]) + 1) if len(whole) else (start, end)


def _determined(
    problem: PoseProblem, q: Float[np.ndarray, "some dofs"], frames: Int[np.ndarray, " some"]
) -> Float[np.ndarray, "some 2"]:
    """Whether the root is placed, and the share of coordinates shown of those that usually are."""
    covariance = _covariance(problem, q, frames)
    placed = _root_is_placed(problem, q, covariance)
    joints = ~root_dofs(problem.kinematics.skeleton)
    shown = _shown(covariance)[:, joints]
    usual = shown[placed].mean(axis=0) > 0.5 if placed.any() else np.zeros(shown.shape[1], dtype=bool)
    share = shown[:, usual].mean(axis=1) if usual.any() else np.ones(len(q))
    return np.stack([placed, share], axis=1)


def _covariance(
    problem: PoseProblem,
    q: Float[np.ndarray, "some dofs"],
    frames: Int[np.ndarray, " some"],
    robust: bool = True,
) -> Float[np.ndarray, "some dofs dofs"]:
    """Of each frame's coordinates, by its own markers and what joints do."""
    information = problem.evaluate(q, frames, robust).H
    own = np.arange(q.shape[1])
    information[:, own, own] += np.where(root_dofs(problem.kinematics.skeleton), 1e-6, JOINT_STD_RAD**-2)
    return np.linalg.inv(information)


def _root_is_placed(
    problem: PoseProblem, q: Float[np.ndarray, "some dofs"], covariance: Float[np.ndarray, "some dofs dofs"]
) -> Bool[np.ndarray, " some"]:
    chain, poses = problem.kinematics.chain, problem.kinematics.poses(q)
    (root,) = (body for body, joint in enumerate(problem.kinematics.skeleton.joints) if joint.parent < 0)
    own = np.flatnonzero(chain.body == root)
    twists = poses.twists()[:, own]
    angular, linear = twists[..., :3], twists[..., 3:]
    linear = linear + np.cross(angular, poses.p_ground_body[:, root, None])
    of_root = covariance[:, chain.dof[own][:, None], chain.dof[own]]

    def largest_std(columns: Float[np.ndarray, "some six 3"]) -> Float[np.ndarray, " some"]:
        spread = np.einsum("tki,tkl,tlj->tij", columns, of_root, columns)
        return np.sqrt(np.linalg.eigvalsh(spread)[:, -1])

    return (largest_std(linear) < PLACED_M) & (largest_std(angular) < TURNED_RAD)
