"""What is told by thresholds: classes without examples, and the sub-labels of all."""

from itertools import pairwise

import numpy as np
from jaxtyping import Bool

from solver.common.true_runs import runs
from solver.gait.activity import Activity, Kind
from solver.gait.body_motion import BodyMotion, Foothold

BELT_M_S = 0.3  # [m/s] slower treadmills are not walked on
BELT_TRAVEL = 0.3  # of the way over the surface; on a belt the body stays
RISER_M = 0.08  # [m] risers of stairs are 0.10 to 0.22 m
RAMP = 0.03  # slope of contacts; floors of laboratories are level
BOX_M = 0.15  # [m] between floor and box; runners' feet differ by less
FLIGHT_S = 0.1  # [s] of a jump; shorter ones are noise of the feet's contacts
PAUSE_S = 0.3  # [s] in a squat before a jump, without which it is a swing
KNEE_DEG = 60.0  # [deg] of flexion, from which on knees are deep
SITTING_BW = 0.9  # [body weights] a seat bears more than a tenth of the weight
RISE = 0.15  # [leg lengths] by which a pelvis rises from a chair, at the least
LUNGE_STEP = 0.4  # [leg lengths] fore-aft between the feet of a lunge
STILL = 0.1  # [m/s] of the pelvis: slower, a person stands
WALKING_M_S = 0.4  # [m/s] faster, a person surely walks
ONE_FOOT_S = 1.0  # [s] unloaded: no step of a walk takes as long

Span = tuple[int, int]


def unlearnt(motion: BodyMotion, span: Span) -> dict[Activity, float]:
    """How far a window is beyond the thresholds of each class without examples: 0.5 at the threshold.

    Args:
        motion: of the trial.
        span: the window's frames.
    """
    return {
        Activity.STAIRS: _stairs(motion, span),
        Activity.SIT_TO_STAND: _sit_to_stand(motion, span),
        Activity.LUNGE: _lunge(motion, span),
        Activity.TRANSITION: _transition(motion, span),
    }


def kind_of(motion: BodyMotion, activity: Activity, span: Span) -> Kind | None:
    """The sub-label of a stretch; None where the activity has none or nothing tells it.

    Args:
        motion: of the trial.
        activity: of the stretch.
        span: its frames.
    """
    match activity:
        case Activity.WALKING | Activity.RUNNING:
            if on_belt(motion, span):
                return Kind.TREADMILL
            steep = activity is Activity.WALKING and abs(_slope(motion, span)) >= RAMP
            return Kind.INCLINE if steep else Kind.OVERGROUND
        case Activity.STAIRS:
            return Kind.UP if sum(_rises(motion, span)) > 0 else Kind.DOWN
        case Activity.JUMP:
            return _jump(motion, span)
        case Activity.STANDING:
            alone = motion.stands[slice(*span)].sum(axis=1) == 1
            longest = max((end - start for start, end in runs(alone)), default=0)
            return Kind.ONE_FOOT if longest > ONE_FOOT_S * motion.rate else Kind.BOTH_FEET
        case Activity.TRANSITION:
            before, after = _halves(motion, span)
            return Kind.START if after > before else Kind.END
        case _:
            return None


def on_belt(motion: BodyMotion, span: Span) -> bool:
    """Whether the surface moves and the body stays where it is.

    Args:
        motion: of the trial.
        span: frames.
    """
    part = slice(*span)
    way = float(motion.pace[part].sum()) / motion.rate
    travel = float(np.linalg.norm((motion.pelvis[span[1] - 1] - motion.pelvis[span[0]])[[0, 2]]))
    return float(np.median(motion.belt[part])) > BELT_M_S and travel < BELT_TRAVEL * way


def _stairs(motion: BodyMotion, span: Span) -> float:
    """Two successive contacts, both up or both down, by a riser at least, while the person goes on."""
    rises = _rises(motion, span)
    both = max((min(a, b) if a > 0 else min(-a, -b) for a, b in pairwise(rises) if a * b > 0), default=0.0)
    return _beyond(both, RISER_M, 0.02)


def _sit_to_stand(motion: BodyMotion, span: Span) -> float:
    """Feet planted, the pelvis rises or sinks, and low down the plates miss a part of the weight.

    Where plates never carry the whole person, nothing tells a chair from a squat: then one half.
    """
    part = slice(*span)
    height = motion.pelvis[part, 1]
    looks = min(
        _beyond(float(motion.stands[part].all(axis=1).mean()), 0.95, 0.02),
        _beyond(float(np.ptp(height)) / motion.leg, RISE, 0.03),
        _beyond(float(np.degrees(motion.knees[part].min(axis=1).max())), KNEE_DEG, 8.0),
    )
    load = np.full(len(height), np.nan) if motion.load_BW is None else motion.load_BW[part]
    low = load[(height < height.min() + 0.1 * motion.leg) & np.isfinite(load)]
    if not len(low) or np.nanquantile(load, 0.9) < SITTING_BW:
        return min(looks, 0.5)
    return min(looks, _beyond(-float(np.median(low)), -SITTING_BW, 0.05))


def _lunge(motion: BodyMotion, span: Span) -> float:
    """One foot far ahead of the other, the knee deep, both on the ground, the pelvis hardly going on."""
    part = slice(*span)
    held = motion.stands[part].all(axis=1) & (motion.knees[part].max(axis=1) > np.radians(KNEE_DEG))
    if not held.any():
        return 0.0
    seconds = float(held.sum()) / motion.rate
    return min(
        _beyond(float(np.median(motion.ahead[part][held])) / motion.leg, LUNGE_STEP, 0.05),
        _beyond(seconds, PAUSE_S, 0.1),
        _beyond(-float(np.median(motion.pace[part][held])), -WALKING_M_S, 0.1),
    )


def _transition(motion: BodyMotion, span: Span) -> float:
    """The person stands at one end of the window and walks at the other, by steps and not through the air."""
    slow, fast = sorted(_halves(motion, span))
    begin, end = motion.times[span[0]], motion.times[span[1] - 1]
    moved = {
        s.foot for s in motion.stances for t in (s.contact_s, s.off_s) if t is not None and begin < t < end
    }
    longest = max((b - a for a, b in runs(_nobody(motion)[slice(*span)])), default=0)
    if len(moved) < motion.stands.shape[1] or longest >= FLIGHT_S * motion.rate:
        return 0.0
    return min(_beyond(-slow, -STILL, 0.05), _beyond(fast, WALKING_M_S, 0.1))


def _halves(motion: BodyMotion, span: Span) -> tuple[float, float]:
    """How fast the pelvis goes over the surface at both ends of a window: a quarter of it each [m/s]."""
    quarter = max(1, (span[1] - span[0]) // 4)
    pace = motion.pace
    return float(pace[span[0] : span[0] + quarter].mean()), float(pace[span[1] - quarter : span[1]].mean())


def _jump(motion: BodyMotion, span: Span) -> Kind:
    """By what the feet leave and where they land, and by what the knees do before."""
    flights = [
        (a, b)
        for a, b in runs(_nobody(motion))
        if a < span[1] and b > span[0] and b - a >= FLIGHT_S * motion.rate
    ]
    for start, end in flights:
        change = np.diff(motion.soles[[max(0, start - 1), min(end, motion.frames - 1)]].min(axis=1))[0]
        if change <= -BOX_M:
            return Kind.DROP_JUMP
        if change >= BOX_M:
            return Kind.BOX_JUMP
    for start, _ in flights:
        if start > 0 and _pauses(motion, start):
            return Kind.SQUAT_JUMP
    return Kind.PLAIN_JUMP


def _nobody(motion: BodyMotion) -> Bool[np.ndarray, " frames"]:
    return np.asarray(~motion.stands.any(axis=1))


def _pauses(motion: BodyMotion, takeoff: int) -> bool:
    """Whether the person waits with deep knees before the last push."""
    first = max(0, takeoff - round(1.5 * motion.rate))
    deep = motion.knees[first:takeoff].min(axis=1) > np.radians(KNEE_DEG)
    waits = np.abs(motion.velocity[first:takeoff, 1]) < STILL
    longest = max((b - a for a, b in runs(np.asarray(deep & waits))), default=0)
    return longest >= PAUSE_S * motion.rate


def _footholds(motion: BodyMotion, span: Span) -> list[Foothold]:
    """Those that begin in a span."""
    begin, end = motion.times[span[0]], motion.times[span[1] - 1]
    return [hold for hold in motion.footholds if begin <= hold.begins_s <= end]


def _rises(motion: BodyMotion, span: Span) -> list[float]:
    """From each foothold to the other foot's next, up [m]."""
    holds = _footholds(motion, span)
    return [b.height_m - a.height_m for a, b in pairwise(holds) if a.foot != b.foot]


def _slope(motion: BodyMotion, span: Span) -> float:
    """Height of footholds over the way between them; 0 with fewer than four."""
    holds = _footholds(motion, span)
    if len(holds) < 4:
        return 0.0
    heights, ways = (np.array([getattr(hold, name) for hold in holds]) for name in ("height_m", "way_m"))
    return float(np.polyfit(ways, heights, 1)[0]) if np.ptp(ways) > 0 else 0.0


def _beyond(value: float, threshold: float, width: float) -> float:
    """0.5 at a threshold, 0.88 twice the width beyond it: a logistic curve."""
    return float(1 / (1 + np.exp(np.clip(-(value - threshold) / width, -50, 50))))
