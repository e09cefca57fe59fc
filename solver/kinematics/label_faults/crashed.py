"""A label that for a while lies on another trajectory or on a ghost, while its neighbours stay together."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.kinematics.label_faults.rigid_neighbours import NORMAL, RigidNeighbours
from solver.kinematics.label_faults.steps import edges, step_m
from solver.kinematics.label_faults.stretches import RIGHT, UNCLEAR, UNKNOWN, WRONG, Stretch, stretches


@dataclass(frozen=True)
class Crashed:
    """A marker, by column, on frames start to end − 1."""

    marker: int
    start: int
    end: int
    off_m: float  # distances against the usual ones, median over the frames
    neighbours: int
    onto: int | None  # column of `trajectories_ground` that it lay on


def crashed_labels(
    rigid: RigidNeighbours,
    trajectories_ground: Float[np.ndarray, "frames trajectories 3"],
    own: tuple[int, ...],
    rate: float,
) -> tuple[Crashed, ...]:
    """All labels of a trial that leave their segment for a while.

    Args:
        rigid: the trial's markers and the distances that they keep.
        trajectories_ground: of all labels, those that are no marker of the model as well [m].
        own: for each marker of `rigid` its column there.
        rate: [Hz].
    """
    found: list[Crashed] = []
    while True:
        more = max(_candidates(rigid, trajectories_ground, own, rate), key=_clearness, default=None)
        if more is None:
            return tuple(found)
        found.append(more)
        points, trajectories_ground = rigid.points_ground.copy(), trajectories_ground.copy()
        points[more.start : more.end, more.marker] = np.nan
        trajectories_ground[more.start : more.end, own[more.marker]] = np.nan
        rigid = replace(rigid, points_ground=points)


def _clearness(found: Crashed) -> float:
    return found.off_m * (found.end - found.start)


def _candidates(
    rigid: RigidNeighbours,
    trajectories_ground: Float[np.ndarray, "frames trajectories 3"],
    own: tuple[int, ...],
    rate: float,
) -> Iterator[Crashed]:
    settings = rigid.settings
    off = [rigid.off_m(m, rigid.points_ground[:, m]) for m in range(len(own))]
    for m, (off_m, known) in enumerate(off):
        if (off_m > settings.loosest_hold_m).sum() < settings.fewest_frames:
            continue
        met = _met(rigid, m, trajectories_ground, own)
        for stretch in _of_label(rigid, m, off_m, np.any(met, axis=1), rate):
            frames = np.arange(stretch.start, stretch.end)
            onto = met[frames].sum(axis=0)
            yield Crashed(
                m,
                stretch.start if stretch.after_right is None else stretch.after_right + 1,
                stretch.end if stretch.before_right is None else stretch.before_right,
                float(np.nanmedian(off_m[frames])),
                int(np.median(known[frames])),
                int(onto.argmax()) if 2 * onto.max() > len(frames) else None,
            )


def _met(
    rigid: RigidNeighbours,
    marker: int,
    trajectories_ground: Float[np.ndarray, "frames trajectories 3"],
    own: tuple[int, ...],
) -> Bool[np.ndarray, "frames trajectories"]:
    """Where a label lies on another trajectory, usually apart from it, that keeps its own distances."""
    settings, column = rigid.settings, own[marker]
    distance = np.linalg.norm(trajectories_ground - trajectories_ground[:, column, None], axis=2)
    with np.errstate(invalid="ignore"):
        met = distance < settings.same_place_m
    met[:, column] = False
    for k in np.flatnonzero(met.any(axis=0)):
        met[:, k] &= np.median(distance[np.isfinite(distance[:, k]), k]) > settings.apart_m
        if k in own:
            other = own.index(k)
            off_m, _ = rigid.off_m(other, rigid.points_ground[:, other], without=(marker,))
            with np.errstate(invalid="ignore"):
                met[:, k] &= ~(off_m > rigid.hold_m[other])
    return met


def _of_label(
    rigid: RigidNeighbours,
    m: int,
    off_m: Float[np.ndarray, " frames"],
    met: Bool[np.ndarray, " frames"],
    rate: float,
) -> Iterator[Stretch]:
    settings, deviation = rigid.settings, rigid.deviation_m(m, rigid.points_ground[:, m])
    known = np.isfinite(deviation).sum(axis=1)
    with np.errstate(invalid="ignore"):
        most = 2 * (np.abs(deviation) > rigid.hold_m[m]).sum(axis=1) > known
        wrong = (off_m > settings.crash_m) | (met & (off_m > settings.loosest_hold_m))
        state = np.where(wrong & most, WRONG, np.where(off_m < rigid.hold_m[m], RIGHT, UNCLEAR)).astype(
            np.int8
        )
    state[~np.isfinite(off_m)] = UNKNOWN
    for stretch in stretches(state, off_m, rate, settings):
        frames = slice(stretch.start, stretch.end)
        returns = stretch.after_right is not None and stretch.before_right is not None
        if not _leaves(rigid, m, stretch, rate):
            continue
        if returns or met[frames].mean() > settings.clear_share or _wanders(rigid, m, frames):
            yield stretch


def _leaves(rigid: RigidNeighbours, m: int, stretch: Stretch, rate: float) -> bool:
    """Whether it is the label that moves at both ends of a stretch, and not its neighbours."""
    across = edges(rigid, (m,), stretch, rate)
    least = rigid.settings.loosest_hold_m
    return all(frames is not None and step_m(rigid, (m, m), frames) > least for frames in across)


def _wanders(rigid: RigidNeighbours, m: int, frames: slice) -> bool:
    """Whether the distances to most neighbours vary: a marker that slipped keeps its new ones."""
    near, x = rigid.of(m), rigid.points_ground[frames]
    distance = np.linalg.norm(x[:, near] - x[:, m, None], axis=2)
    varies = []
    for column in distance.T:
        known = column[np.isfinite(column)]
        if len(known) >= rigid.settings.fewest_frames:
            varies.append(NORMAL * np.median(np.abs(known - np.median(known))) > rigid.settings.rigid_m)
    return bool(varies) and 2 * sum(varies) > len(varies)
