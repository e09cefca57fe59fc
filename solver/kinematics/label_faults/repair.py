"""A trial's labels corrected before anything is fitted to them."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Capture, Markers
from solver.kinematics.label_faults.fault import EXCHANGED, MASKED, Exchange, LabelFault, notes_of
from solver.kinematics.label_faults.rigid_neighbours import (
    RigidNeighbours,
    on_near_segments,
    on_one_segment,
    rigid_neighbours,
)
from solver.kinematics.label_faults.settings import LabelRepairSettings
from solver.kinematics.label_faults.wrong_labels import (
    Crashed,
    Exchanged,
    crashed_labels,
    exchanged_back,
    exchanged_pairs,
)
from solver.kinematics.marker_matching import MarkerMatch
from solver.skeleton.skeleton import Skeleton

FEWEST_ACROSS_JOINTS = 3  # likewise where some are on the next body, before a label is left out: joints bend

SAMPLED_FRAMES = 100  # frames of another recording tell its distances


def repair_labels_of(
    capture: Capture,
    others: Sequence[Markers],
    match: MarkerMatch,
    skeleton: Skeleton,
    settings: LabelRepairSettings,
    *,
    accepted: Iterable[Exchange] = (),
) -> tuple[Capture, tuple[LabelFault, ...]]:
    """Exchange labels back that were exchanged, and take out those that lie elsewhere, where that is clear.

    Args:
        capture: one trial.
        others: recordings of the same person beside it, the static one included.
        match: which label is which marker.
        skeleton: unscaled, with the shared markers in the match's order.
        settings: when a label is taken to be on the wrong trajectory.
        accepted: exchanges of any trial that a person says are there; done whatever the settings.

    Returns:
        The trial with its labels repaired and a note on each fault; and the faults in the order of time.
    """
    markers, faults = _as_accepted(capture, accepted)
    if settings.enabled:
        markers, found = _as_found(markers, others, match, skeleton)
        faults += found
    if not faults:
        return capture, ()
    faults = tuple(sorted(faults, key=lambda f: (f.start, f.labels)))
    return replace(capture, markers=markers, notes=(*capture.notes, *notes_of(faults))), faults


def _as_accepted(capture: Capture, accepted: Iterable[Exchange]) -> tuple[Markers, tuple[LabelFault, ...]]:
    markers, faults = capture.markers, []
    for exchange in accepted:
        if exchange.trial != capture.name or not set(exchange.labels) <= set(markers.names):
            continue
        a, b = (markers.names.index(label) for label in exchange.labels)
        start, end = exchange.start, min(exchange.end, markers.frames)
        points = exchanged_back(markers.positions_ground, (a, b), start, end)
        markers = replace(markers, positions_ground=points)
        faults.append(
            LabelFault(
                exchange.labels, start, end, EXCHANGED, _seen(points[start:end, [a, b]]), accepted=True
            )
        )
    return markers, tuple(faults)


def _as_found(
    markers: Markers, others: Sequence[Markers], match: MarkerMatch, skeleton: Skeleton
) -> tuple[Markers, tuple[LabelFault, ...]]:
    columns = match.columns(markers)
    shown = [m for m, column in enumerate(columns) if column is not None]
    own = tuple(column for column in columns if column is not None)
    body = skeleton.with_markers([skeleton.markers[m] for m in shown])
    rigid = rigid_neighbours(markers.positions_ground[:, own], body)
    elsewhere_m = _distances_elsewhere(rigid, [match.observed(o)[:, shown] for o in others], body)
    swaps = exchanged_pairs(rigid, elsewhere_m, markers.rate)
    for swap in swaps:
        if swap.named_right:
            exchanged = exchanged_back(rigid.points_ground, swap.pair, swap.start, swap.end)
            rigid = replace(rigid, points_ground=exchanged)
    crashes = _crashes(rigid, body, markers, own, swaps)
    points = markers.positions_ground.copy()
    points[:, own] = rigid.points_ground
    faults = [_swap_fault(s, rigid, markers.names, own) for s in swaps if s.named_right]
    for crash in crashes:
        faults.append(_crash_fault(crash, rigid, markers.names, own))
        points[crash.start : crash.end, own[crash.marker]] = np.nan
    return replace(markers, positions_ground=points), tuple(faults)


def _crashes(
    rigid: RigidNeighbours, body: Skeleton, markers: Markers, own: tuple[int, ...], swaps: Sequence[Exchanged]
) -> list[Crashed]:
    """By the segment's own markers; then by those of the next ones as well, where a label leaves at a step.

    Whatever stands beside labels of which nobody knows when they are right is left alone.
    """
    trajectories = markers.positions_ground.copy()
    trajectories[:, own] = rigid.points_ground
    one = replace(rigid, usual_m=np.where(on_one_segment(body), rigid.usual_m, np.nan))
    near = replace(rigid, longest_gap_s=0.0, fewest_neighbours=FEWEST_ACROSS_JOINTS)
    unsure = np.zeros(len(own), dtype=bool)
    for swap in swaps:
        if not swap.named_right:
            unsure |= on_near_segments(body)[list(swap.pair)].any(axis=0)
    found: list[Crashed] = []
    for more in (
        *crashed_labels(one, trajectories, own, markers.rate),
        *crashed_labels(near, trajectories, own, markers.rate),
    ):
        known = any(more.marker == f.marker and more.start < f.end and f.start < more.end for f in found)
        if not known and not unsure[more.marker]:
            found.append(more)
    return found


def _distances_elsewhere(
    rigid: RigidNeighbours, others: Sequence[Float[np.ndarray, "frames markers 3"]], body: Skeleton
) -> Float[np.ndarray, "markers markers"]:
    """Distances of neighbours in other recordings [m], else between landmarks of one segment on the model."""
    place = np.array([marker.position_body for marker in body.markers]).reshape(-1, 3)
    bony = np.array([marker.fixed for marker in body.markers], dtype=bool)
    told = np.linalg.norm(place[:, None] - place[None], axis=2)
    told[~(on_one_segment(body) & bony[:, None] & bony[None])] = np.nan
    for a, b in np.argwhere(np.isfinite(rigid.usual_m)):
        distances = [
            np.linalg.norm(
                x[:: len(x) // SAMPLED_FRAMES + 1, a] - x[:: len(x) // SAMPLED_FRAMES + 1, b], axis=1
            )
            for x in others
        ]
        known = np.concatenate([d[np.isfinite(d)] for d in distances]) if distances else np.zeros(0)
        if len(known):
            told[a, b] = np.median(known)
    return told


def _swap_fault(
    swap: Exchanged, rigid: RigidNeighbours, names: tuple[str, ...], own: tuple[int, ...]
) -> LabelFault:
    a, b = swap.pair
    return LabelFault(
        (names[own[a]], names[own[b]]),
        swap.start,
        swap.end,
        EXCHANGED,
        _seen(rigid.points_ground[swap.start : swap.end, [a, b]]),
        swap.off_m,
        swap.repaired_off_m,
        swap.neighbours,
    )


def _crash_fault(
    crash: Crashed, rigid: RigidNeighbours, names: tuple[str, ...], own: tuple[int, ...]
) -> LabelFault:
    return LabelFault(
        (names[own[crash.marker]],),
        crash.start,
        crash.end,
        MASKED,
        _seen(rigid.points_ground[crash.start : crash.end, [crash.marker]]),
        crash.off_m,
        None,
        crash.neighbours,
        None if crash.onto is None else names[crash.onto],
    )


def _seen(points_ground: Float[np.ndarray, "frames markers 3"]) -> int:
    """On how many frames one of them is."""
    return int(np.isfinite(points_ground).all(axis=2).any(axis=1).sum())
