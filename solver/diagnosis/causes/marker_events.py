"""Several markers that seem to slip at one instant: which of them did, if any.

A jump is seen by the pose that all markers together take. Trunks bend, shoulders rise, soft tissue swings
at a landing, or a neighbour slips, that pose is off and sound markers seem to jump. The distances within a
segment know no pose: they are asked which marker moved. One that slips changes its distances from the
segment's other markers and leaves theirs as they are. A segment that bends, soft tissue that swings, or a
pose beyond the model changes none, or others as well.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.lib.stride_tricks import sliding_window_view

from solver.common.notes import Kind, Note
from solver.diagnosis.causes.marker_effect import RESOLVED_M, SHIFT_STD_M, MarkerFinding
from solver.diagnosis.causes.marker_slip import MarkerSlip, slip_at
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.causes.segment_displaced import TOGETHER_S, SegmentDisplaced

CLEAR = 6.0  # [nats] by which distances show a slip; sound jumps reach 5.5
PARTED = 3.0  # [nats] between two markers of a segment, or either may be the one
UNDECIDED_GAIN = 23.0  # of the markers' likelihood: nine to one, where distances do not tell
SPAN_S = 0.15  # of medians before and after
APART_S = 0.3  # changes nearer to the instant are not usual ones
AT_S = 0.03  # within which the instant is known
FALLBACK_STD_M = 0.004  # of a trial too short to show usual changes
FEWEST_USUAL = 5
FEWEST_SEEN = 0.5  # share of the frames


@dataclass(frozen=True, eq=False)
class SegmentDistances:
    """What the distances within one segment say of an instant."""

    markers: Int[np.ndarray, " markers"]  # of the segment, those that are seen
    gains: Float[np.ndarray, " markers"]  # [nats] for a slip of each, over nothing that happened
    predicted: float  # [nats] that the distances would show for the slip that was asked about
    among_others_m: float  # by how much distances that are not its own change at the instant, at most

    def gain(self, marker: int) -> float:
        """Of one marker's slip."""
        return float(self.gains[self.markers == marker][0])

    @property
    def likeliest(self) -> int:
        """The marker whose slip explains most."""
        return int(self.markers[np.argmax(self.gains)])


def segment_distances(
    scene: Scene, marker: int, frame: int, shift_body: Float[np.ndarray, "3"]
) -> SegmentDistances:
    """The markers of a marker's segment before and after a frame.

    Args:
        scene: markers as recorded.
        marker: that seems to slip, seen before and after.
        frame: first one after it.
        shift_body: by how much, in the segment's axes [m].
    """
    observed, body = scene.markers.observed_ground, int(scene.markers.body[marker])
    seen = np.isfinite(observed).all(axis=2).mean(axis=0) >= FEWEST_SEEN
    own = np.flatnonzero((scene.markers.body == body) & (seen | (np.arange(len(seen)) == marker)))
    in_body = np.einsum(
        "tji,tmj->tmi", scene.R_ground_body[:, body], observed[:, own] - scene.p_ground_body[:, body, None]
    )
    places = np.nanmedian(in_body, axis=0)
    pairs = list(combinations(range(len(own)), 2))
    if not pairs:
        return SegmentDistances(own, np.zeros(len(own)), 0.0, 0.0)
    found = [_change(observed[:, own[i]], observed[:, own[k]], frame, scene.rate) for i, k in pairs]
    change, std = np.array(found).T
    ends = np.array(pairs)
    apart = places[ends[:, 0]] - places[ends[:, 1]]
    along = apart / np.linalg.norm(apart, axis=1, keepdims=True)
    gains = []
    for m in range(len(own)):
        sign = (ends[:, 0] == m).astype(float) - (ends[:, 1] == m)
        gains.append(_gain(change / std, sign[:, None] * along / std[:, None], sign != 0))
        if own[m] == marker:
            moved = np.linalg.norm(apart + sign[:, None] * shift_body, axis=1) - np.linalg.norm(apart, axis=1)
    others = np.abs(change)[(own[ends] != marker).all(axis=1)]
    predicted = float(0.5 * ((moved / std) ** 2).sum())
    return SegmentDistances(own, np.array(gains), predicted, float(others.max(initial=0.0)))


def _gain(
    change: Float[np.ndarray, " pairs"],
    by_shift: Float[np.ndarray, "pairs 3"],
    its: Bool[np.ndarray, " pairs"],
) -> float:
    """Of a free shift of one marker; changes and slopes in standard deviations, in the pairs that are its."""
    y, A = change[its], by_shift[its]
    shift = np.linalg.solve(A.T @ A + np.eye(3) / SHIFT_STD_M**2, A.T @ y)
    left = y - A @ shift
    return float(0.5 * (y @ y - left @ left - shift @ shift / SHIFT_STD_M**2))


def _change(
    one_ground: Float[np.ndarray, "frames 3"],
    other_ground: Float[np.ndarray, "frames 3"],
    frame: int,
    rate: float,
) -> tuple[float, float]:
    """Of a distance at a frame, and the standard deviation of such changes elsewhere in the trial [m]."""
    count = max(2, round(SPAN_S * rate))
    edge = np.full(count, np.nan)
    distance = np.concatenate([edge, np.linalg.norm(one_ground - other_ground, axis=1), edge])
    windows = sliding_window_view(distance, count)
    known = np.isfinite(windows).any(axis=1)
    medians = np.full(len(windows), np.nan)
    medians[known] = np.nanmedian(windows[known], axis=1)
    changes = medians[count : count + len(one_ground)] - medians[: len(one_ground)]
    away = np.abs(np.arange(len(changes)) - frame)
    usual = np.abs(changes[(away > APART_S * rate) & np.isfinite(changes)])
    std = np.percentile(usual, 95) / 2 + RESOLVED_M if len(usual) >= FEWEST_USUAL else FALLBACK_STD_M
    near = changes[(away <= max(1, round(AT_S * rate))) & np.isfinite(changes)]
    return (float(near[np.argmax(np.abs(near))]) if len(near) else 0.0), float(std)


@dataclass(frozen=True)
class MarkerEvents:
    """What a trial's jumps are."""

    slips: tuple[MarkerSlip, ...]
    notes: tuple[Note, ...] = ()


def events_of(
    scene: Scene, jumps: Sequence[MarkerSlip], before: Sequence[MarkerFinding] = ()
) -> MarkerEvents:
    """Slips among a trial's jumps, and a note on what is none.

    A jump that distances show is a slip, of the marker that they show. One that they should show and do not
    is none. Where they cannot tell, several at once, or the same marker twice, are the segment's or its
    soft tissue's; one alone stays, less sure, unless the others move against one another by more: then
    the pose that it seems to leave is not known so well.

    Args:
        scene: markers as they are by now, in which the jumps were found.
        jumps: the clearest first.
        before: what was found in this trial and repaired; no segment slips twice at one instant.
    """
    reach = TOGETHER_S * scene.rate
    fresh = [jump for jump in jumps if not any(_is_one_event(jump, known, reach) for known in before)]
    lost = ~np.isfinite(scene.markers.observed_ground).all(axis=2)
    slips: list[MarkerSlip] = []
    notes: list[Note] = []
    for event in _at_once(fresh, reach):
        distances = [segment_distances(scene, j.marker, j.frames.start, j.shift_body) for j in event]
        jumping = {jump.marker for jump in event}
        clear = [_show(scene, j, a, jumping) for j, a in zip(event, distances, strict=True)]
        shown = _once_each([slip for slip in clear if slip is not None])
        if shown:
            slips += [s if _was_lost(s, lost, reach) else _less_sure(s) for s in shown]
        elif len(event) == 1 and distances[0].predicted < CLEAR and _stands_out(event[0], distances[0]):
            slips.append(_less_sure(event[0]))
        else:
            notes.append(_note(scene, event))
    lasting = [s for s in slips if sum(o.marker == s.marker for o in slips) == 1]
    return MarkerEvents(tuple(sorted(lasting, key=lambda slip: -slip.gain)), tuple(notes))


def _stands_out(jump: MarkerSlip, distances: SegmentDistances) -> bool:
    """Whether it moved by more than others of its segment against one another, as where arms are raised."""
    return float(np.linalg.norm(jump.shift_body)) > distances.among_others_m


def _show(
    scene: Scene, jump: MarkerSlip, distances: SegmentDistances, jumping: Collection[int]
) -> MarkerSlip | None:
    """The slip that distances show in a jump's segment at its time, if any."""
    likeliest = distances.likeliest
    if distances.gain(likeliest) < CLEAR:
        return None
    if distances.gain(likeliest) - distances.gain(jump.marker) > PARTED:
        return slip_at(scene, likeliest, jump.frames.start)
    alike = distances.markers[distances.gains > distances.gain(jump.marker) - PARTED]
    rivals = [m for m in alike if m != jump.marker and (len(distances.markers) == 2 or m in jumping)]
    return _less_sure(jump) if rivals else jump


def _was_lost(slip: MarkerSlip, lost: Bool[np.ndarray, "frames markers"], reach: float) -> bool:
    """Whether the cameras lost it meanwhile; one that was seen all the time has no step in its path.

    Then the others may as well have been carried away together, and it stayed: distances cannot tell.
    """
    around = slice(max(0, slip.frames.start - max(1, round(reach))), slip.frames.start + 1)
    return bool(lost[around, slip.marker].any())


def _less_sure(jump: MarkerSlip) -> MarkerSlip:
    return replace(jump, gain=min(jump.gain, UNDECIDED_GAIN))


def _once_each(slips: Sequence[MarkerSlip]) -> list[MarkerSlip]:
    """One slip a marker, and one of those between which distances do not decide: the clearest."""
    kept: list[MarkerSlip] = []
    for slip in sorted(slips, key=lambda s: -s.gain):
        undecided = slip.gain <= UNDECIDED_GAIN and any(k.gain <= UNDECIDED_GAIN for k in kept)
        if not undecided and all(k.marker != slip.marker for k in kept):
            kept.append(slip)
    return kept


def _is_one_event(jump: MarkerSlip, known: MarkerFinding, reach: float) -> bool:
    slips = known.slips if isinstance(known, SegmentDisplaced) else (known,)
    return any(
        isinstance(slip, MarkerSlip)
        and slip.frames.trial == jump.frames.trial
        and slip.body == jump.body
        and abs(slip.frames.start - jump.frames.start) <= reach
        for slip in slips
    )


def _at_once(jumps: Sequence[MarkerSlip], frames: float) -> list[list[MarkerSlip]]:
    """Jumps by events, in the order of time."""
    events: list[list[MarkerSlip]] = []
    for jump in sorted(jumps, key=lambda j: j.frames.start):
        if events and jump.frames.start - events[-1][-1].frames.start <= frames:
            events[-1].append(jump)
        else:
            events.append([jump])
    return events


def _note(scene: Scene, event: Sequence[MarkerSlip]) -> Note:
    names = ", ".join(dict.fromkeys(jump.target for jump in event))
    at = event[0].frames.start / scene.rate
    return Note(
        Kind.OTHER,
        f"at {at:.2f} s {names} seem to move on the body, but distances between markers do not "
        "show that one slipped: a bending segment, soft tissue, clothing or an impact; no marker is named",
        trial=scene.name,
    )
