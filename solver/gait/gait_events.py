"""Contacts and foot-offs: where a plate carries the foot from its force, elsewhere from the feet's motion."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import FootEvent, ForcePlate, Side
from solver.capture.plates.conditioning import plate_loads
from solver.capture.plates.force_settings import ConditioningSettings
from solver.common.true_runs import runs
from solver.gait.foot_motion import FootMotion
from solver.gait.settings import STEPS_PER_S, GaitSettings

SHORTEST_CONTACT_S = 0.06  # [s] sprinters stand for 0.09 s, vibration is shorter
GAP_S = 0.03  # [s] a foot that goes from plate to plate is on both or leaves one as it takes the other
CONTACT_SHARE = 0.4  # of pace, below which a landing sole slips; by recordings
MOST_CONTACT_M_S = 2.4  # [m/s] which landing feet of runners reach; by recordings
OFF_FACTOR = 0.8  # slip of a leaving toe is this times pace to off_power, in m/s; by recordings
OFF_POWER = 0.7  # runners' toes leave at a smaller share of their pace; likewise
LEAST_SLIP_M_S = 0.2  # [m/s] soft tissue and the filter move standing feet so fast
EDGE_S = 0.06  # [s] of a recording's beginning, in which a filtered foot may seem to land
SHORTEST_SWING_S = 0.08  # [s] shorter stops between stances are noise

SAME_STANCE_S = 0.1  # by which stances of plate and motion may differ at either end and be one stance


class Kind(StrEnum):
    """What happens."""

    CONTACT = "contact"
    FOOT_OFF = "foot-off"


class Source(StrEnum):
    """What tells it."""

    FORCE = "force"
    FILE = "file"
    FEET = "feet"


@dataclass(frozen=True)
class GaitEvent:
    """A foot meets or leaves the ground."""

    time_s: float  # on the recording's clock
    foot: int  # index into the subject's foot bodies
    kind: Kind
    source: Source


@dataclass(frozen=True)
class Stance:
    """One foot on the ground; None where it already stood at the beginning, or still does at the end."""

    foot: int
    contact_s: float | None
    off_s: float | None
    source: Source


def stances_from_feet(motion: FootMotion) -> tuple[Stance, ...]:
    """Stances from slip alone: from where a sole slips less than a share of the pace until its toes leave.

    Args:
        motion: of the feet.
    """
    landing = np.clip(CONTACT_SHARE * motion.pace, LEAST_SLIP_M_S, MOST_CONTACT_M_S)
    leaving = np.maximum(OFF_FACTOR * motion.pace**OFF_POWER, LEAST_SLIP_M_S)
    edge = round(EDGE_S * STEPS_PER_S)
    found = []
    for foot in range(motion.slip.shape[1]):
        slip = motion.slip[:, foot]
        for start, end in _cores(slip < np.minimum(landing, leaving), slip, leaving):
            first, last = start, end
            while first > 0 and slip[first - 1] < landing[first - 1]:
                first -= 1
            while last < len(slip) and slip[last] < leaving[last]:
                last += 1
            contact = float(motion.times[first]) if first > edge else None
            off = float(motion.times[last - 1]) if last < len(slip) - 1 else None
            found.append(Stance(foot, contact, off, Source.FEET))
    return tuple(found)


def _cores(
    still: Bool[np.ndarray, " steps"], slip: Float[np.ndarray, " steps"], leaving: Float[np.ndarray, " steps"]
) -> list[tuple[int, int]]:
    """Runs in which the sole hardly slips; those that a twitch cuts in two are one."""
    joined: list[tuple[int, int]] = []
    for start, end in runs(still):
        if joined:
            before, gap = joined[-1], slice(joined[-1][1], start)
            is_short = start - before[1] < SHORTEST_SWING_S * STEPS_PER_S
            if is_short and bool((slip[gap] < 3 * leaving[gap]).all()):
                joined[-1] = before[0], end
                continue
        joined.append((start, end))
    return [run for run in joined if run[1] - run[0] >= SHORTEST_CONTACT_S * STEPS_PER_S]


def stances_from_plates(
    plates: Sequence[ForcePlate],
    corners_ground: Sequence[Float[np.ndarray, "frames corners 3"]],
    times: Float[np.ndarray, " frames"],
    settings: GaitSettings,
    conditioning: ConditioningSettings,
) -> tuple[Stance, ...]:
    """Stances from raw forces at the plates' own rates, zero level off: where they cross the threshold.

    Each is the foot's whose sole is nearest to the centre of pressure most of the time: the other foot swings
    past at mid-stance. Stances of one foot that overlap on two plates are one. Where a stretch without a
    recording cuts a stance, its true end is not known, and it is left to the feet's motion.

    Args:
        plates: as recorded.
        corners_ground: of each foot's sole [m], at the frames.
        times: of the frames [s].
        settings: threshold.
        conditioning: what takes off the zero level.
    """
    found: list[Stance] = []
    for plate in plates:
        loads = plate_loads(plate, conditioning)
        load = np.where(loads.recorded, loads.raw_ground[:, 1], 0.0)
        for start, end in runs(load > settings.threshold_N):
            if end - start < SHORTEST_CONTACT_S * plate.rate:
                continue
            if not loads.recorded[max(0, start - 1) : end + 1].all():
                continue
            points = plate.cop_ground[start:end]
            known = np.isfinite(points).all(axis=1)
            if load[start:end].max() < settings.least_peak_N or not known.any():
                continue
            frames = np.searchsorted(times, plate.times[start:end][known]).clip(0, len(times) - 1)
            away = [_distance(corners[frames], points[known]) for corners in corners_ground]
            contact = _crossing(plate, load, start - 1, settings.threshold_N)
            off = _crossing(plate, load, end - 1, settings.threshold_N)
            found.append(
                Stance(
                    int(np.argmin(away)),
                    contact if contact is not None and contact > times[0] else None,
                    off if off is not None and off < times[-1] else None,
                    Source.FORCE,
                )
            )
    return tuple(stance for foot in range(len(corners_ground)) for stance in _merged(found, foot, GAP_S))


def _distance(
    corners_ground: Float[np.ndarray, "samples corners 3"], points_ground: Float[np.ndarray, "samples 3"]
) -> float:
    """Over the floor, from the middle of a sole to where the force acts: the median of all samples [m]."""
    apart = (corners_ground.mean(axis=1) - points_ground)[:, [0, 2]]
    return float(np.median(np.linalg.norm(apart, axis=1)))


def _crossing(
    plate: ForcePlate, load: Float[np.ndarray, " samples"], sample: int, level: float
) -> float | None:
    """Time at which the load crosses a level between a sample and the next; None at the recording's ends."""
    if sample < 0 or sample + 1 >= len(load):
        return None
    share = (level - load[sample]) / (load[sample + 1] - load[sample])
    return float(plate.start_time + (sample + share) / plate.rate)


def _merged(found: Sequence[Stance], foot: int, gap_s: float) -> list[Stance]:
    own = sorted((s for s in found if s.foot == foot), key=_start)
    merged: list[Stance] = []
    for stance in own:
        if merged and _start(stance) - _end(merged[-1]) < gap_s:
            off = None if None in (stance.off_s, merged[-1].off_s) else max(_end(stance), _end(merged[-1]))
            merged[-1] = Stance(foot, merged[-1].contact_s, off, Source.FORCE)
        else:
            merged.append(stance)
    return merged


def _start(stance: Stance) -> float:
    return -np.inf if stance.contact_s is None else stance.contact_s


def _end(stance: Stance) -> float:
    return np.inf if stance.off_s is None else stance.off_s


def stances_of_both(by_force: Sequence[Stance], by_feet: Sequence[Stance]) -> tuple[Stance, ...]:
    """Those of the plates, and those of the feet that no plate's stance overlaps; in order of time.

    Where a plate bears only part of a stance, as its edge does, the motion's word is taken for it.

    Args:
        by_force: from plates.
        by_feet: from the motion.
    """
    taken: list[Stance] = []
    for feet in by_feet:
        same = [s for s in by_force if s.foot == feet.foot and _overlap(s, feet)]
        whole = [s for s in same if _agree(s, feet)]
        taken.append(whole[0] if whole else feet)
    seen = {id(stance) for stance in taken}
    alone = [
        s
        for s in by_force
        if id(s) not in seen and not any(_overlap(s, f) for f in by_feet if f.foot == s.foot)
    ]
    return tuple(sorted([*taken, *alone], key=lambda s: (_start(s), _end(s))))


def stances_as_stated(
    by_feet: Sequence[Stance], stated: Sequence[FootEvent], feet: Sequence[str]
) -> tuple[Stance, ...]:
    """Stances of the feet, at the times that the recording's file states where it has both ends of one.

    Args:
        by_feet: from the motion.
        stated: on the same clock.
        feet: bodies, by which stances count their foot.
    """
    found = []
    for one in by_feet:
        own = [event for event in stated if event.side == side_of(feet[one.foot])]
        contact, off = (
            None if time is None else _nearest([e.time_s for e in own if e.label == label], time)
            for time, label in ((one.contact_s, "Foot Strike"), (one.off_s, "Foot Off"))
        )
        as_stated = Stance(one.foot, contact, off, Source.FILE)
        lacks_none = (contact is None, off is None) == (one.contact_s is None, one.off_s is None)
        found.append(as_stated if lacks_none and _agree(as_stated, one) else one)
    return tuple(found)


def _nearest(times: Sequence[float], time: float) -> float | None:
    return min(times, key=lambda t: abs(t - time), default=None)


def side_of(body: str) -> Side:
    """The side that a body's name tells."""
    words = body.lower().replace("-", "_").split("_")
    if "l" in words or "left" in body.lower():
        return "Left"
    return "Right" if "r" in words or "right" in body.lower() else "General"


def _overlap(one: Stance, other: Stance) -> bool:
    return _start(one) < _end(other) and _start(other) < _end(one)


def _agree(one: Stance, other: Stance) -> bool:
    ends = ((one.contact_s, other.contact_s), (one.off_s, other.off_s))
    return all(a is None or b is None or abs(a - b) < SAME_STANCE_S for a, b in ends)


def events_of(stances: Sequence[Stance]) -> tuple[GaitEvent, ...]:
    """The events that begin and end stances, in order of time."""
    events = [
        GaitEvent(time, stance.foot, kind, stance.source)
        for stance in stances
        for time, kind in ((stance.contact_s, Kind.CONTACT), (stance.off_s, Kind.FOOT_OFF))
        if time is not None
    ]
    return tuple(sorted(events, key=lambda event: (event.time_s, event.foot)))
