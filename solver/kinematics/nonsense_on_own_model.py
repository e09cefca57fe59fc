"""Labels that mean nothing, on a model of the subject's own: found on the default body, carried over."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from solver.kinematics.label_reading import ReadLabels
from solver.kinematics.scale_prior import stature
from solver.markers.atlas import atlas, place_on
from solver.markers.understanding import understand
from solver.skeleton.forward import carried_joint_centres
from solver.skeleton.skeleton import Marker, Skeleton

ALIKE_M = 0.03  # how far joint centres and markers of two models' bodies may lie apart in the body's frame
CARRIED_STD_M = 0.05  # of a place that was measured on one body and carried over to such another


def carried_over(
    read: ReadLabels, labels: Iterable[str], default: Skeleton, model: Skeleton
) -> dict[str, Marker]:
    """Markers for labels that the model has none for, on its bodies of the same name.

    Only on bodies whose frames agree: joint centres, and markers that the model calls by a landmark's name,
    lie where those of the default body lie, within ALIKE_M.

    Args:
        read: what was found on the default body.
        labels: those wanted.
        default: the default body.
        model: the subject's own, unscaled.
    """
    ratio = (stature(model) or 0.0) / (stature(default) or 1.0)
    if not ratio:
        return {}
    used = {row.label for row in read.understanding.labels if row.used}
    apart = _apart(default, model, ratio)
    carried = {}
    for label in labels:
        marker = read.found[label]
        body = default.bodies[marker.body].name
        if label in used and apart.get(body, np.inf) < ALIKE_M:
            carried[label] = replace(
                marker,
                body=model.body_index(body),
                position_body=ratio * marker.position_body,
                fixed=False,
                spread_m=max(marker.spread_m or 0.0, CARRIED_STD_M),
            )
    return carried


def _apart(default: Skeleton, model: Skeleton, ratio: float) -> dict[str, float]:
    """By body of both: how far what lies on it lies apart, in the mean [m]."""
    here, there = _points(default, default), _points(model, default)
    apart = {}
    for body in set(default.body_names) & set(model.body_names):
        shared = here[body].keys() & there[body].keys()
        if shared:
            far = [np.linalg.norm(there[body][name] - ratio * here[body][name]) for name in shared]
            apart[body] = float(np.mean(far))
    return apart


def _points(skeleton: Skeleton, default: Skeleton) -> Mapping[str, dict[str, Float[np.ndarray, "3"]]]:
    """Of each body: centres of the joints that it carries, and places of its landmarks, in its frame [m]."""
    points = carried_joint_centres(skeleton, skeleton.default_q)
    if skeleton is default:
        for mark in atlas().values():
            points[mark.body][f"at {mark.name}"] = place_on(mark, default)
        return points
    rows = understand(skeleton.marker_names).by_label()
    for marker in skeleton.markers:
        row = rows[marker.name]
        if row.used and row.landmark is not None and not atlas()[row.landmark].tracks_only:
            points[skeleton.bodies[marker.body].name][f"at {row.landmark}"] = marker.position_body
    return points
