"""Marker swap: two markers carry each other's names for a while, or to the end."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.common.true_runs import runs
from solver.diagnosis.causes.about import About, CorrectedBy, Entry, Markers, Named, TimeHistory
from solver.diagnosis.causes.effect import Range
from solver.diagnosis.causes.marker_effect import TRUSTED_M, MarkerFinding, Places
from solver.diagnosis.causes.observed_trial import Scene

SHORT_GAP_S = 0.035  # over which a marker is expected to keep its velocity; beyond, to stay on its segment
LONGEST_GAP_S = 2.0
VELOCITY_S = 0.05  # the velocity is taken from frames this near
LEAST_JUMP_M = 0.025  # of each; markers nearer than that can be exchanged unseen, and it matters little
NEARER_SHARE = 0.4  # exchanged, both have to land at most this share as far from where they were expected
LEAST_NOISE_M = 0.002
ORDINARY = 0.95  # quantile of a marker's errors from frame to frame, taken for two standard deviations
ON_SEGMENT_M = 0.02  # likewise, expected from the segment's pose after a longer gap
LEAST_GAIN = 10.0
MOST_EDGES = 40


@dataclass(frozen=True, eq=False)
class MarkerSwap(MarkerFinding):
    """observed A = true B and observed B = true A on the frames.

    It shows at its ends, where both jump to where the other was expected; a swap of the whole trial has none.
    """

    pair: tuple[int, int]

    about = About(
        id="marker_swap",
        entry=Entry("markers", "two labels exchanged for a while", ""),
        title="swapped markers: {target}",
        sentence="Two markers carry each other's names: {target}.",
        remedy="Exchange the two labels on these frames in the tracking software.",
        separate_by=("the cameras' own view: labels are swapped where the markers pass or were hidden"),
        branch="markers/one",
        names=Named.MARKERS,
        time_history=TimeHistory.EVENT,
        corrected_by=CorrectedBy.LABELS,
        in_markers=True,
        picture=Markers(),
    )

    def repair(self, observed_ground: Places) -> Places:
        """The two exchanged back."""
        corrected = observed_ground.copy()
        frames = slice(self.frames.start, self.frames.end)
        a, b = self.pair
        corrected[frames, [a, b]] = observed_ground[frames, [b, a]]
        return corrected


@dataclass(frozen=True)
class _Edge:
    """Where two markers are exchanged, from this frame on."""

    frame: int
    pair: tuple[int, int]
    gain: float
    smooth: bool  # both were followed up to it without a gap


def findings(scene: Scene) -> list[MarkerFinding]:
    """Exchanged pairs of a trial, one finding for each stretch of frames.

    Two trajectories that only go on smoothly when exchanged are exchanged. Which of the stretches between two
    such moments has the wrong names, the model tells: its offsets follow the longer one. Behind a gap the
    model has to agree; without one it need not: a forearm with two markers turns round when they are
    exchanged.
    """
    edges = _edges(scene)
    found: list[MarkerFinding] = []
    for pair in dict.fromkeys(edge.pair for edge in edges):
        own = [edge for edge in edges if edge.pair == pair]
        frames = np.array([edge.frame for edge in own])
        exchanged = np.searchsorted(frames, np.arange(scene.frames), side="right") % 2 == 1
        if _distance(scene, pair, ~exchanged) < _distance(scene, pair, exchanged):
            exchanged = ~exchanged
        gain = sum(edge.gain for edge in own)
        found += [
            _finding(scene, pair, start, end, gain)
            for start, end in runs(exchanged)
            if all(edge.smooth for edge in own) or _is_steadier(scene, pair, start, end)
        ]
    return found


def _finding(scene: Scene, pair: tuple[int, int], start: int, end: int, gain: float) -> MarkerSwap:
    names = scene.markers.names
    return MarkerSwap(
        target=f"{names[pair[0]]}+{names[pair[1]]}",
        parameters={},
        frames=Range(scene.name, start, end),
        gain=gain,
        pair=pair,
    )


def _edges(scene: Scene) -> list[_Edge]:
    """Every moment at which two markers are exchanged, in the order of time."""
    positions = scene.markers.observed_ground.copy()
    expected, noise = _expected_places(scene, positions)
    edges: list[_Edge] = []
    frame = 1
    while len(edges) < MOST_EDGES:
        edge = next(_exchanges(positions, expected, noise, frame), None)
        if edge is None:
            break
        edges.append(edge)
        a, b = edge.pair
        positions[edge.frame :, [a, b]] = positions[edge.frame :, [b, a]]
        expected, noise = _expected_places(scene, positions)
        frame = edge.frame
    return edges


def _exchanges(
    positions: Float[np.ndarray, "frames markers 3"],
    expected: Float[np.ndarray, "frames markers 3"],
    noise: Float[np.ndarray, "frames markers"],
    first: int,
) -> Iterator[_Edge]:
    """Frames from `first` on where two markers land where the other was expected."""
    with np.errstate(invalid="ignore"):
        astray = np.linalg.norm(positions - expected, axis=2) > LEAST_JUMP_M
    searched = float(np.log(positions.shape[0] * positions.shape[1] ** 2))
    for t in np.flatnonzero(astray[first:].sum(axis=1) >= 2) + first:
        jumped = np.flatnonzero(astray[t])
        for i, a in enumerate(jumped):
            for b in jumped[i + 1 :]:
                kept = _far(positions[t, [a, b]], expected[t, [a, b]])
                swapped = _far(positions[t, [b, a]], expected[t, [a, b]])
                if swapped.sum() > NEARER_SHARE * kept.sum():
                    continue
                gain = 0.5 * float(((kept**2 - swapped**2) / noise[t, [a, b]] ** 2).sum()) - searched
                if gain > LEAST_GAIN:
                    smooth = bool((noise[t, [a, b]] < ON_SEGMENT_M).all())
                    yield _Edge(int(t), (int(a), int(b)), gain, smooth)


def _far(here: Float[np.ndarray, "2 3"], there: Float[np.ndarray, "2 3"]) -> Float[np.ndarray, "2"]:
    return np.linalg.norm(here - there, axis=1)


def _expected_places(
    scene: Scene, positions: Float[np.ndarray, "frames markers 3"]
) -> tuple[Float[np.ndarray, "frames markers 3"], Float[np.ndarray, "frames markers"]]:
    """Where each marker should be from the frames before, and how far that may be off [m]; NaN if unknown."""
    total, count = positions.shape[:2]
    expected, noise = np.full(positions.shape, np.nan), np.full((total, count), np.nan)
    reach = max(1, round(VELOCITY_S * scene.rate))
    for m in range(count):
        seen = np.flatnonzero(np.isfinite(positions[:, m]).all(axis=1))
        if len(seen) < 3:
            continue
        here, before = seen[1:], seen[:-1]
        earlier = np.r_[seen[0], seen[:-2]]
        gap = (here - before) / scene.rate
        known = (before - earlier > 0) & (before - earlier <= reach)
        velocity = (positions[before, m] - positions[earlier, m]) / np.maximum(before - earlier, 1)[:, None]
        straight = positions[before, m] + velocity * (here - before)[:, None]
        carried = _carry_on(scene, int(scene.markers.body[m]), positions[before, m], before, here)
        smooth = known & (gap <= SHORT_GAP_S)
        expected[here, m] = np.where(smooth[:, None], straight, carried)
        astray = np.linalg.norm(positions[here, m] - straight, axis=1)[smooth & (here - before == 1)]
        ordinary = max(LEAST_NOISE_M, np.quantile(astray, ORDINARY) / 2 if len(astray) else ON_SEGMENT_M)
        noise[here, m] = np.where(smooth, ordinary * (here - before) ** 2, ON_SEGMENT_M)
        expected[here[gap > LONGEST_GAP_S], m] = np.nan
    return expected, noise


def _carry_on(
    scene: Scene, body: int, points_ground: np.ndarray, before: np.ndarray, here: np.ndarray
) -> Float[np.ndarray, "some 3"]:
    """Points of a segment some frames later."""
    R, p = scene.R_ground_body[:, body], scene.p_ground_body[:, body]
    points_body = np.einsum("tji,tj->ti", R[before], points_ground - p[before])
    return p[here] + np.einsum("tij,tj->ti", R[here], points_body)


def _is_steadier(scene: Scene, pair: tuple[int, int], start: int, end: int) -> bool:
    """Whether the exchange on these frames lets both keep one place on their segments, wherever that is."""
    here = (np.arange(scene.frames) >= start) & (np.arange(scene.frames) < end)
    return _distance(scene, pair, here, anywhere=True) < _distance(scene, pair, here & False, anywhere=True)


def _distance(
    scene: Scene, pair: tuple[int, int], exchanged: Bool[np.ndarray, " frames"], anywhere: bool = False
) -> float:
    """Of both markers from the model's, or from their usual place, robust, if exchanged on some frames."""
    observed, total = scene.markers.observed_ground, 0.0
    for m, other in (pair, pair[::-1]):
        corrected = np.where(exchanged[:, None], observed[:, other], observed[:, m])
        R = scene.R_ground_body[:, scene.markers.body[m]]
        error = np.einsum("tji,tj->ti", R, corrected - scene.markers.model_ground[:, m])
        error = error[np.isfinite(error).all(axis=1)]
        if anywhere and len(error):
            error = error - np.median(error, axis=0)
        total += float(np.log1p((error**2).sum(axis=1) / TRUSTED_M**2).sum())
    return total
