"""Plates with the sign and the zero level that the whole recording tells, and a sentence on each.

Moments that a file lost where its force passes through zero are put back between the samples around.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.axes import TRUNK
from solver.capture.capture import ForcePlate, Markers, PlateWord
from solver.capture.plates.centre_of_pressure import Surface, centre_of_pressure, surface_of
from solver.capture.plates.conditioning import fill_gaps, observed_at
from solver.capture.plates.force_settings import CONDITIONING, ConditioningSettings
from solver.capture.plates.plate_sign import (
    HELD_S,
    MOST_SAMPLES,
    REST_S,
    SMOOTHING_S,
    SPACING_S,
    TARE_N,
    PlateEvidence,
    weigh_signs,
)
from solver.capture.plates.zero_level import ZERO_SMALLEST_N, less, level_of, resting_samples
from solver.capture.resampling import resample
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted
from solver.common.plate_figures import CONTACT_N, LOAD_N
from solver.common.true_runs import runs

LEVEL_STDS = 2.0  # by which a level that was held may lie off what weight and motion ask for
POINT_LOST_N = 50.0  # [N] with less, programs write no centre of pressure, or one that digits do not hold


def evidence_on_plates(
    plates: Sequence[ForcePlate],
    markers: Markers,
    mass_kg: float | None = None,
    conditioning: ConditioningSettings = CONDITIONING,
) -> tuple[PlateEvidence, ...]:
    """What a recording says of each plate's sign and zero level, without a model of the body.

    Args:
        plates: as read, y up, whichever way they count.
        markers: of the same recording, y up.
        mass_kg: as entered, if it was.
        conditioning: how gaps and the plates' surface are judged.
    """
    empty = [resting_samples(plate, markers, conditioning) for plate in plates]
    return _weighed(plates, markers, empty, mass_kg, conditioning)


def _weighed(
    plates: Sequence[ForcePlate],
    markers: Markers,
    empty: Sequence[Bool[np.ndarray, " samples"]],
    mass_kg: float | None,
    conditioning: ConditioningSettings,
    *,
    said: Sequence[PlateWord] = (),
) -> tuple[PlateEvidence, ...]:
    words = {word.name: word for word in said}
    given = [words.get(plate.name, PlateWord(plate.name)) for plate in plates]
    samples = vertical_momentum(plates, markers, conditioning)
    held = [
        word.zero_N if word.zero_N is not None else _known_level(plate, resting)
        for plate, resting, word in zip(plates, empty, given, strict=True)
    ]

    def weighed(levels: Sequence[float | None]) -> tuple[PlateEvidence, ...]:
        return weigh_signs(
            samples.readings_N,
            samples.acceleration,
            samples.agitation,
            held_N=levels,
            said=[word.sign for word in given],
            mass_kg=mass_kg,
        )

    found = weighed(held)
    rested = [
        _held_once(plate, evidence) if level is None else level
        for plate, evidence, level in zip(plates, found, held, strict=True)
    ]
    return found if rested == held else weighed(rested)


def correct_signs_and_levels(
    plates: Sequence[ForcePlate],
    markers: Markers,
    mass_kg: float | None = None,
    conditioning: ConditioningSettings = CONDITIONING,
    *,
    said: Sequence[PlateWord] = (),
) -> tuple[tuple[ForcePlate, ...], tuple[Note, ...]]:
    """The plates as forces on the person; turned and relieved of a zero level where that is clear or said.

    Returns:
        The plates, and a note on each that was changed, that may have to be, or that a person spoke of.

    Raises:
        CaptureError: somebody spoke of a plate that is not there.
    """
    words = {word.name: word for word in said}
    _refuse_unknown_plates(words, [plate.name for plate in plates])
    if not plates:
        return (), ()
    empty = [resting_samples(plate, markers, conditioning) for plate in plates]
    given = (plates, markers, empty, mass_kg, conditioning)
    alone = _weighed(*given)
    evidence_by_plate = _weighed(*given, said=said) if said else alone
    settled, notes = [], []
    for plate, evidence, unasked, seen_empty in zip(plates, evidence_by_plate, alone, empty, strict=True):
        word = words.get(plate.name, PlateWord(plate.name))
        if word.sign is not None or word.zero_N is not None:
            notes.append(_said_of(word, unasked))
        resting = seen_empty if seen_empty.any() else _resting(plate, evidence)
        lowered = evidence.is_untared() and bool(
            seen_empty.any()
            or (
                evidence.has_known_level()
                and not evidence.is_undecided()
                and resting.any()
                and np.nanmax(np.abs(plate.force_ground[:, 1] - evidence.zero_N)) > LOAD_N
            )
        )
        changed = plate
        if word.zero_N is not None:
            changed = _lowered_by(changed, word.zero_N, resting, conditioning)
        elif lowered:
            changed = _lowered(changed, resting, conditioning)
        if word.sign == -1 or (word.sign is None and evidence.is_turned()):
            changed = replace(
                changed,
                force_ground=-changed.force_ground,
                moment_ground=-changed.moment_ground,
                zero_ground=None if changed.zero_ground is None else -changed.zero_ground,
            )
        if changed is not plate and changed.point_ground is None:
            surface = surface_of(plate)
            changed = bridge_moments(changed, moments_lost(plate), surface)
            wrench = (changed.force_ground, changed.moment_ground)
            known = changed.force_ground[:, 1] >= CONTACT_N
            centre = centre_of_pressure(*wrench, surface)
            changed = replace(changed, cop_ground=np.where(known[:, None], centre, np.nan))
        settled.append(changed)
        if word.sign is None and word.zero_N is None:
            notes += _sentences(plate, evidence, lowered=lowered)
    return tuple(settled), tuple(notes)


def _refuse_unknown_plates(words: Mapping[str, PlateWord], known: Sequence[str]) -> None:
    for name in words:
        if name not in known:
            raise CaptureError(
                f"subject.toml names a plate '{name}', but the recording's plates are "
                f"{', '.join(known) or 'none'}. Correct the name below [trials.NAME.plates]."
            )


def _said_of(word: PlateWord, unasked: PlateEvidence) -> Note:
    """What was done at a person's word, and what the recording alone tells."""
    ways = {1: "its forces act on the person", -1: "its forces act on the plate, so their sign is turned"}
    said = [ways[word.sign]] if word.sign is not None else []
    if word.zero_N is not None:
        said.append(
            f"unloaded it reads {word.zero_N:.0f} N" + (", which is taken off" if word.zero_N else "")
        )
    is_against = (
        word.sign is not None
        and unasked.used
        and not unasked.is_undecided()
        and unasked.is_turned() != (word.sign == -1)
    )
    against = "; its readings contradict that" if is_against else ""
    return Note(
        Kind.FORCES_AGAINST_BODY if is_against else Kind.PLATES,
        f"{word.name}: as subject.toml says, {', and '.join(said)} (the recording alone: "
        f"{unasked.sentence()}{against})",
    )


def _sentences(plate: ForcePlate, evidence: PlateEvidence, *, lowered: bool) -> list[Note]:
    said: list[Note] = []
    if lowered and abs(evidence.zero_N) <= TARE_N:
        said += noted(
            Kind.PLATES,
            f"{plate.name}: reads {evidence.zero_N:.1f} N while nobody is on it; taken off as its zero level",
        )
    elif lowered:
        said += noted(
            Kind.PLATES,
            f"{plate.name}: its zero level is off: it reads {evidence.zero_N:.0f} N while nobody is on it; "
            "taken off. Was it tared under a load, or not at all?",
        )
    elif (
        evidence.used
        and evidence.is_untared()
        and not evidence.has_known_level()
        and not evidence.is_undecided()
    ):
        known = f" (± {2 * evidence.zero_std_N:.0f} N)" if np.isfinite(evidence.zero_std_N) else ""
        said += noted(
            Kind.OTHER,
            f"{plate.name}: its zero level is off: by the person's weight and motion it would read "
            f"{evidence.zero_N:.0f} N unloaded{known}. Was it tared while something stood on it? This "
            "recording does not show it empty, so nothing is taken off, and its forces are wrong by that "
            "much: tare it empty and record again, or leave its forces out",
        )
    if evidence.is_undecided():
        said += noted(
            Kind.OTHER,
            f"{plate.name}: the sign of its force cannot be determined from this recording (it reads "
            f"{np.nanmin(plate.force_ground[:, 1]):.0f} to {np.nanmax(plate.force_ground[:, 1]):.0f} N "
            "upwards); left unchanged. If that is not the force on the person, or if the plate was tared "
            "under a load, export it again with the right sign and zero level",
        )
    elif evidence.is_turned():
        said += noted(
            Kind.OTHER,
            f"{plate.name}: forces point downwards, on the plate; their sign is turned: only then do the "
            "plates carry the person's weight",
        )
    return said


def _known_level(plate: ForcePlate, resting: Bool[np.ndarray, " samples"]) -> float | None:
    """The vertical reading of the empty plate, where the recording shows it [N]; 0 for noise."""
    if not resting.any():
        return _held_level(plate)
    level = float(np.median(plate.force_ground[resting, 1]))
    return level if abs(level) > ZERO_SMALLEST_N else 0.0


def _held_level(plate: ForcePlate) -> float | None:
    """The vertical reading that a program gave to unloaded samples: zero, or held alike in two places [N]."""
    levels = _held_wrenches(plate)
    if any(not level.any() for level in levels):
        return 0.0
    for k, level in enumerate(levels):
        if any((level == other).all() for other in levels[k + 1 :]):
            return float(level[1])
    return None


def _held_once(plate: ForcePlate, evidence: PlateEvidence) -> float | None:
    """A level that a program held in one place, where weight and motion ask for about that one [N]."""
    if not evidence.used or not evidence.is_untared() or evidence.is_undecided():
        return None
    within = LEVEL_STDS * evidence.zero_std_N
    near = [float(w[1]) for w in _held_wrenches(plate) if abs(w[1] - evidence.zero_N) <= within]
    least = np.nanmin(evidence.sign * plate.force_ground[:, 1])
    lowest = [level for level in near if evidence.sign * level <= least + TARE_N]
    return lowest[0] if lowest else None


def _held_wrenches(plate: ForcePlate) -> list[Float[np.ndarray, "6"]]:
    """Force and moment of each stretch on which they stay the same to the last digit."""
    wrench = np.concatenate([plate.force_ground, plate.moment_ground], axis=1)
    alike = np.r_[False, (np.diff(wrench, axis=0) == 0).all(axis=1)]
    fewest = max(4, round(HELD_S * plate.rate))
    return [wrench[start] for start, end in runs(alike) if end - start >= fewest]


def _resting(plate: ForcePlate, evidence: PlateEvidence) -> Bool[np.ndarray, " samples"]:
    """Samples at the zero level, in stretches long enough to be no passage through it."""
    with np.errstate(invalid="ignore"):
        near = np.abs(plate.force_ground[:, 1] - evidence.zero_N) <= TARE_N
    near &= np.isfinite(plate.moment_ground).all(axis=1)
    for start, end in runs(near):
        if end - start < REST_S * plate.rate:
            near[start:end] = False
    return near


def _lowered_by(
    plate: ForcePlate,
    zero_N: float,
    resting: Bool[np.ndarray, " samples"],
    conditioning: ConditioningSettings,
) -> ForcePlate:
    """The plate less a zero level that somebody knows.

    All six components where it rests there; else a vertical force in the middle of the plate.
    """
    if zero_N == 0.0:
        return plate
    if resting.any():
        return _lowered(plate, resting, conditioning)
    force = np.array([0.0, zero_N, 0.0])
    level = np.concatenate([force, np.cross(surface_of(plate).point_ground, force)])
    return replace(less(plate, level[None]), point_ground=None, zero_ground=level)


def _lowered(
    plate: ForcePlate, resting: Bool[np.ndarray, " samples"], conditioning: ConditioningSettings
) -> ForcePlate:
    """The plate less what it reads at rest, all six components; centres of pressure follow from the rest."""
    level = level_of(plate, resting, conditioning)
    lowered = less(plate, level)
    moment = lowered.moment_ground
    if plate.point_ground is not None:
        empty = np.isnan(plate.point_ground).any(axis=1) & (np.abs(lowered.force_ground[:, 1]) < CONTACT_N)
        moment = np.where(empty[:, None], 0.0, moment)
    return replace(lowered, moment_ground=moment, point_ground=None, zero_ground=np.median(level, axis=0))


def moments_lost(plate: ForcePlate) -> Bool[np.ndarray, " samples"]:
    """Samples whose moment hangs on a centre of pressure that a small force does not tell.

    Args:
        plate: as its file has it; one without columns for the point loses nothing.
    """
    if plate.point_ground is None:
        return np.zeros(plate.samples, dtype=bool)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(plate.force_ground[:, 1]) < POINT_LOST_N)


def bridge_moments(plate: ForcePlate, lost: Bool[np.ndarray, " samples"], surface: Surface) -> ForcePlate:
    """The plate with the moments of these samples made anew from points between their neighbours'.

    Args:
        plate: with its true forces.
        lost: samples whose moment is not known.
        surface: where feet press.
    """
    vertical = plate.force_ground[:, 1]
    with np.errstate(invalid="ignore"):
        loaded = vertical > CONTACT_N
    wanted, known = loaded & lost, loaded & ~lost
    if not wanted.any() or known.sum() < 2:
        return plate
    force, moment = plate.force_ground, plate.moment_ground
    points = centre_of_pressure(force, moment, surface)
    free = moment - np.cross(points, force)
    order = np.arange(plate.samples)

    def between(values: Float[np.ndarray, "samples 3"]) -> Float[np.ndarray, "wanted 3"]:
        return np.stack([np.interp(order[wanted], order[known], v[known]) for v in values.T], axis=1)

    bridged = moment.copy()
    bridged[wanted] = np.cross(between(points), force[wanted]) + between(free)
    return replace(plate, moment_ground=bridged)


@dataclass(frozen=True)
class VerticalMomentum:
    """Samples at which all plates were recorded, evenly spread."""

    readings_N: Float[np.ndarray, "samples plates"]  # upwards
    acceleration: Float[np.ndarray, " samples"]  # of the trunk, upwards [m/s²]; NaN where unseen
    agitation: Float[np.ndarray, " samples"]  # its size nearby [m/s²]


def vertical_momentum(
    plates: Sequence[ForcePlate], markers: Markers, conditioning: ConditioningSettings = CONDITIONING
) -> VerticalMomentum:
    """Readings and acceleration at the markers' frames.

    The acceleration is the second derivative of cubics through a sliding window; the same window, seen as a
    weighted mean of accelerations, smooths the forces.
    """
    half = max(2, round(0.5 * SMOOTHING_S * markers.rate))
    frames = markers.frames
    if frames <= 2 * half:
        return _unsmoothed(plates, markers, conditioning)
    from scipy.signal import savgol_coeffs  # noqa: PLC0415 (slow to load, and rarely needed)

    second = savgol_coeffs(2 * half + 1, 3, deriv=2, delta=1 / markers.rate, use="dot")
    mean = np.cumsum(np.cumsum(second))[:-2]
    mean /= mean.sum()

    acceleration = np.full(frames, np.nan)
    acceleration[half:-half] = _acceleration(markers, second)
    readings = np.full((frames, len(plates)), np.nan)
    for k, plate in enumerate(plates):
        readings[half - 1 : frames - half + 1, k] = _slid(
            _at_frames(plate, markers.times, conditioning), mean
        )
    known = np.flatnonzero(np.isfinite(readings).all(axis=1))
    step = max(1, round(SPACING_S * markers.rate), -(-len(known) // MOST_SAMPLES))
    chosen = known[step // 2 :: step]
    nearby = max(1, round(0.75 * SMOOTHING_S * markers.rate))
    return VerticalMomentum(
        readings[chosen], acceleration[chosen], _size_nearby(acceleration, nearby)[chosen]
    )


def _acceleration(
    markers: Markers, second: Float[np.ndarray, " window"]
) -> Float[np.ndarray, " inner_frames"]:
    """Median over the trunk's markers [m/s²]; over the upper ones, where names do not tell."""
    height = markers.positions_ground[:, :, 1]
    seen_at_all = np.isfinite(height).any(axis=0)
    trunk = np.array([bool(TRUNK.search(name)) for name in markers.names]) & seen_at_all
    if trunk.sum() < 3 and seen_at_all.any():
        typical = np.full(len(trunk), -np.inf)
        typical[seen_at_all] = np.nanmedian(height[:, seen_at_all], axis=0)
        low, high = typical[seen_at_all].min(), typical.max()
        trunk = typical > low + 0.4 * (high - low)
    each = _slid(height[:, trunk], second)
    seen = np.isfinite(each).any(axis=1)
    middle = np.full(len(each), np.nan)
    middle[seen] = np.nanmedian(each[seen], axis=1)
    return middle


def _unsmoothed(
    plates: Sequence[ForcePlate], markers: Markers, conditioning: ConditioningSettings
) -> VerticalMomentum:
    """What a recording shorter than the window holds: readings, and no acceleration."""
    readings = np.stack([_at_frames(plate, markers.times, conditioning) for plate in plates], axis=1)
    known = readings[np.isfinite(readings).all(axis=1)]
    few = known[:: max(1, round(SPACING_S * markers.rate))]
    unknown = np.full(len(few), np.nan)
    return VerticalMomentum(few, unknown, unknown)


def _at_frames(
    plate: ForcePlate, times: Float[np.ndarray, " frames"], conditioning: ConditioningSettings
) -> Float[np.ndarray, " frames"]:
    whole, recorded, _ = fill_gaps(plate, conditioning)
    vertical = resample(whole.force_ground[:, 1], plate.rate, plate.start_time, times)
    return np.where(observed_at(times, plate, recorded), vertical, np.nan)


def _slid(
    values: Float[np.ndarray, "frames *columns"], weights: Float[np.ndarray, " window"]
) -> Float[np.ndarray, "places *columns"]:
    return np.lib.stride_tricks.sliding_window_view(values, len(weights), axis=0) @ weights


def _size_nearby(values: Float[np.ndarray, " frames"], reach: int) -> Float[np.ndarray, " frames"]:
    """Root mean square over the known frames within reach."""
    known = np.isfinite(values)
    around = np.ones(2 * reach + 1)
    count = np.convolve(known, around, mode="full")[reach:-reach]
    squares = np.convolve(np.where(known, values, 0.0) ** 2, around, mode="full")[reach:-reach]
    return np.sqrt(squares / np.maximum(count, 1))
