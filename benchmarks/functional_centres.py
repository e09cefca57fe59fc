"""Joint centres of fits, judged by the point that the raw markers on both sides turn about."""

from collections.abc import Sequence

from benchmarks.leg_joints import joint_centres, segments
from benchmarks.rigid_clusters import FEWEST_MARKERS, cluster_poses
from benchmarks.turning_point import Jointed, off_measured
from solver.fit import Fit
from solver.markers.atlas import atlas
from solver.markers.understanding import understand
from solver.skeleton.forward import body_poses


def off_turning_point(fits: Sequence[Fit], clusters_of: Fit, joint: str, side: str) -> list[float] | None:
    """How far the fits' turning points lie from that of the raw markers [m].

    Args:
        fits: of one recording.
        clusters_of: the one whose model says which marker is on which body.
        joint: "hip", "knee" or "ankle".
        side: "r" or "l".

    Returns:
        A distance for each fit; None where fewer than three markers are on either body, too few frames show
        them, or the joint turned too little.
    """
    markers = clusters_of.trials[0].capture.markers
    before, behind = (raw_columns(clusters_of, body) for body in segments(joint, side))
    if min(len(before), len(behind)) < FEWEST_MARKERS:
        return None
    clusters = tuple(cluster_poses(markers.positions_ground[:, c]) for c in (before, behind))
    return off_measured(clusters, [_jointed(fit, joint, side) for fit in fits], markers.rate)


def _jointed(fit: Fit, joint: str, side: str) -> Jointed:
    R, p = body_poses(fit.skeleton, fit.trials[0].motion.q)
    before, behind = (fit.skeleton.body_index(name) for name in segments(joint, side))
    return Jointed(
        (R[:, before], p[:, before]), (R[:, behind], p[:, behind]), joint_centres(fit, side)[joint]
    )


def raw_columns(fit: Fit, body_name: str) -> list[int]:
    """Columns of the recording's labels that the fit has on a body; computed joint centres left out."""
    assert fit.groundwork is not None
    match, markers = fit.groundwork.match, fit.trials[0].capture.markers
    body = {m.name: fit.skeleton.bodies[m.body].name for m in fit.skeleton.markers}
    computed = {
        row.label
        for row in understand(list(markers.names), [markers]).labels
        if row.landmark is not None and atlas()[row.landmark].kind == "centre"
    }
    return [
        c
        for name, c in zip(match.model, match.columns(markers), strict=True)
        if c is not None and body[name] == body_name and markers.names[c] not in computed
    ]
