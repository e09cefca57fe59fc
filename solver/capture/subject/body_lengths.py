"""Whether recordings show one person: by distances between markers that sit on one segment in both."""

from itertools import combinations
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Markers
from solver.common.errors import CaptureError

FRAMES_JUDGED = 100  # [frames] of a recording, evenly spread; lengths hardly change
FEWEST_FRAMES = 8  # in which both markers are seen
RIGID_M = 0.006  # scatter over time: soft tissue; joints move markers further
SHORTEST_M = 0.12  # shorter ones tell where a marker was stuck, not who it is on
FEWEST_LENGTHS = 5  # on three markers or so; fewer tell of one segment only
REPLACED_M = 0.009  # two landmarks found again, 6 mm each (Della Croce et al. 2005)
PEOPLE_SHARE = 0.06  # scatter of one bone's length between two adults (Winter 2009)
STRAY_SHARE = 0.15  # of lengths: exchanged labels, joints that were held still
STRAY_M = 0.3  # how far these may be off
LENGTHS_PER_MARKER = 0.5  # independent lengths a marker: lengths of one segment share markers


ONE_SEGMENT_M = 0.25  # longer distances may join two segments that keep still, as all do in a static trial
STAYS_M, MOVES_M = 0.001, 0.02  # four fifths of the time, a bone's length and what is beyond its joint
ON_A_BONE_M = 0.05  # nearer points may be on one plate
FEWEST_JOINTS, JOINTS_SHARE = 4, 0.33  # two legs' knees and ankles; of a suit's 23 points 10, of markers 0

Lengths = dict[tuple[str, str], float]


def body_lengths(markers: Markers) -> Lengths:
    """Median distances [m] of markers that keep it, by their names in alphabetical order."""
    chosen = np.unique(np.linspace(0, markers.frames - 1, FRAMES_JUDGED).round().astype(int))
    positions = markers.positions_ground[chosen]
    lengths: Lengths = {}
    for i, j in combinations(np.argsort(markers.names), 2):
        apart = np.linalg.norm(positions[:, i] - positions[:, j], axis=1)
        apart = apart[np.isfinite(apart)]
        if len(apart) < FEWEST_FRAMES:
            continue
        low, middle, high = np.percentile(apart, [10, 50, 90])
        if middle >= SHORTEST_M and (high - low) / 2.56 < RIGID_M:
            lengths[markers.names[i], markers.names[j]] = float(middle)
    return lengths


def short_lengths(markers: Markers) -> Lengths:
    """Those that lie within one segment, whatever the labels mean."""
    return {pair: length for pair, length in body_lengths(markers).items() if length < ONE_SEGMENT_M}


def odds_for_two(one: Lengths, other: Lengths) -> float | None:
    """Log odds, base e, for two people against one whose markers may have been placed again.

    Args:
        one: of a recording.
        other: of another; only lengths between markers of the same names are compared.

    Returns:
        None where too few lengths can be compared.
    """
    both = [pair for pair in one if pair in other]
    if len(both) < FEWEST_LENGTHS:
        return None
    lengths = np.array([[one[pair], other[pair]] for pair in both])
    off = lengths[:, 0] - lengths[:, 1]
    of_people = PEOPLE_SHARE * lengths.mean(axis=1)
    gain = np.log(_density(off, np.hypot(REPLACED_M, of_people))) - np.log(
        _density(off, np.full(len(off), REPLACED_M))
    )
    markers = {name for pair in both for name in pair}
    return float(np.mean(gain) * LENGTHS_PER_MARKER * len(markers))


def refuse_no_markers(markers: Markers, path: Path) -> None:
    """Nothing is made of a recording without a marker, or whose points are a skeleton's joints.

    Raises:
        CaptureError: it is one.
    """
    if not markers.names:
        raise CaptureError(f"{path}: no marker was ever seen. Export the trial with its trajectories.")
    joints = joints_of_a_skeleton(markers)
    if joints:
        raise CaptureError(
            f"{path}: its points are joints of a skeleton ({', '.join(joints[:4])}, …), of an inertial suit "
            "or another program's solve, not markers: they do not show how segments turn about their length. "
            "Export markers, or use that program's angles."
        )


def joints_of_a_skeleton(markers: Markers) -> tuple[str, ...]:
    """Points that keep their distance from two others that move against each other, where many do.

    A joint's centre does, which is on two segments at once; what sits on skin cannot. Where a third of all
    points are such, they are the joints of a skeleton that an inertial suit or another program has solved.
    """
    chosen = np.unique(np.linspace(0, markers.frames - 1, FRAMES_JUDGED).round().astype(int))
    positions = markers.positions_ground[chosen]
    positions = positions[np.isfinite(positions).all(axis=(1, 2))]
    if len(positions) < FEWEST_FRAMES:
        return ()
    apart = np.linalg.norm(positions[:, :, None] - positions[:, None], axis=3)
    spread = np.subtract(*np.percentile(apart, [90, 10], axis=0))
    stays = (spread < STAYS_M) & (apart.mean(axis=0) > ON_A_BONE_M)
    moves = (spread > MOVES_M).astype(float)
    joints = np.flatnonzero(np.einsum("ki,ij,kj->k", stays * 1.0, moves, stays * 1.0))
    if len(joints) < FEWEST_JOINTS or len(joints) < JOINTS_SHARE * len(markers.names):
        return ()
    return tuple(markers.names[k] for k in joints)


def _density(
    off: Float[np.ndarray, " lengths"], scatter: Float[np.ndarray, " lengths"]
) -> Float[np.ndarray, " lengths"]:
    normal = np.exp(-0.5 * np.square(off / scatter)) / (np.sqrt(2 * np.pi) * scatter)
    return (1 - STRAY_SHARE) * normal + STRAY_SHARE / (2 * STRAY_M)
