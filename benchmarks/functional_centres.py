"""Joint centres of fits, judged by the point that the raw markers on both sides turn about."""

from collections.abc import Mapping, Sequence

from benchmarks.leg_joints import PosedFit, segments
from benchmarks.rigid_clusters import FEWEST_MARKERS, cluster_poses
from benchmarks.turning_point import Jointed, off_measured
from solver.capture.capture import Markers


def off_turning_point(
    fits: Sequence[PosedFit], markers: Markers, columns: Mapping[str, list[int]], joint: str, side: str
) -> list[float] | None:
    """How far the fits' turning points lie from that of the raw markers [m].

    Args:
        fits: of one recording.
        markers: of that recording.
        columns: of the markers on each body.
        joint: "hip", "knee" or "ankle".
        side: "r" or "l".

    Returns:
        A distance for each fit; None where fewer than three markers are on either body, too few frames show
        them, or the joint turned too little.
    """
    before, behind = (columns[body] for body in segments(joint, side))
    if min(len(before), len(behind)) < FEWEST_MARKERS:
        return None
    clusters = (
        cluster_poses(markers.positions_ground[:, before]),
        cluster_poses(markers.positions_ground[:, behind]),
    )
    bodies = [Jointed(*fit.segments(joint, side), fit.joint_centres(side)[joint]) for fit in fits]
    return off_measured(clusters, bodies, markers.rate)
