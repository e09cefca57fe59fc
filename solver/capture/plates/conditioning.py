"""From a plate as recorded to the wrench that the solver uses, on the markers' clock.

In this order: short gaps filled, zero level taken off, unloaded samples set to zero, and only then filtered:
force and moment about the ground origin alike, both with the filter of the
kinematics. The centre of pressure comes last, from the filtered wrench; filtering it as such would average
numbers without meaning.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import ForcePlate
from solver.capture.plates.centre_of_pressure import centre_of_pressure, surface_of
from solver.capture.plates.force_settings import CONDITIONING, ConditioningSettings
from solver.capture.plates.zero_level import zeroed
from solver.capture.resampling import bridge_gaps, covered, interpolate, rate_of, resample
from solver.common.filters import low_pass
from solver.common.notes import Kind, Note, noted
from solver.common.true_runs import runs


@dataclass(frozen=True)
class ConditionedPlate:
    """A plate's wrench on the foot at the markers' frames; NaN on frames that the recording doesn't cover.

    The filter spreads a contact's edges by some 10 ms, so that small forces remain beside `loaded` frames.
    They belong to the filtered signal; so do the filtered accelerations that they balance.
    """

    name: str
    force_ground: Float[np.ndarray, "frames 3"]  # [N]
    moment_ground: Float[np.ndarray, "frames 3"]  # [N·m] about the ground origin
    cop_ground: Float[np.ndarray, "frames 3"]  # [m] NaN unless loaded
    loaded: Bool[np.ndarray, " frames"]
    observed: Bool[np.ndarray, " frames"]
    force_raw_ground: Float[np.ndarray, "frames 3"]  # [N] zero level off, resampled, nothing else
    moment_raw_ground: Float[np.ndarray, "frames 3"]  # [N·m]
    notes: tuple[Note, ...] = ()


def condition(
    plate: ForcePlate, times: Float[np.ndarray, " frames"], settings: ConditioningSettings = CONDITIONING
) -> ConditionedPlate:
    """Clean, filter and resample one plate.

    Args:
        plate: force on the foot, at its own rate and start.
        times: the markers' frames, equally spaced [s], on the same clock.
        settings: thresholds and filter.
    """
    loads = plate_loads(plate, settings)
    cutoff = shared_cutoff(rate_of(times), settings)
    smooth = smooth_samples(loads.wrench_ground, loads.recorded, plate.rate, cutoff, settings)
    filtered = interpolate(smooth, plate.rate, plate.start_time, times)
    raw = resample(loads.raw_ground, plate.rate, plate.start_time, times)
    observed = observed_at(times, plate, loads.recorded)
    filtered[~observed] = np.nan
    raw[~observed] = np.nan
    surface = surface_of(plate)
    spread_s = 0.5 / cutoff  # how far the filter carries a contact's edge
    pressing = filtered[:, :3] @ surface.normal_ground
    loaded = (
        observed
        & (pressing >= settings.threshold_N)
        & at_nearest_samples(_widened(loads.carrying, spread_s * plate.rate), plate, times)
    )
    cop = centre_of_pressure(filtered[:, :3], filtered[:, 3:], surface)
    return ConditionedPlate(
        name=plate.name,
        force_ground=filtered[:, :3],
        moment_ground=filtered[:, 3:],
        cop_ground=np.where(loaded[:, None], cop, np.nan),
        loaded=loaded,
        observed=observed,
        force_raw_ground=raw[:, :3],
        moment_raw_ground=raw[:, 3:],
        notes=(
            *loads.notes,
            *_cutoff_notes(plate, cutoff, settings),
            *_coverage_notes(plate.name, observed, times),
        ),
    )


@dataclass(frozen=True)
class PlateLoads:
    """A plate's samples at its own rate, ready for the filter: force [N], moment about the origin [N·m]."""

    wrench_ground: Float[np.ndarray, "samples 6"]  # zero where recorded as unloaded
    raw_ground: Float[np.ndarray, "samples 6"]  # zero level off, nothing else
    carrying: Bool[np.ndarray, " samples"]
    recorded: Bool[np.ndarray, " samples"]
    notes: tuple[Note, ...] = ()


def plate_loads(plate: ForcePlate, settings: ConditioningSettings = CONDITIONING) -> PlateLoads:
    """Gaps filled, zero level off, unloaded samples set to zero."""
    whole, recorded, gap_notes = fill_gaps(plate, settings)
    tared, zero_notes = zeroed(whole, settings)
    wrench = np.concatenate([tared.force_ground, tared.moment_ground], axis=1)
    carrying = contact_samples(tared, settings) & recorded
    masked = np.where((carrying | ~recorded)[:, None], wrench, 0.0)
    return PlateLoads(masked, wrench, carrying, recorded, (*gap_notes, *zero_notes))


def smooth_samples(
    samples: Float[np.ndarray, "samples *columns"],
    recorded: Bool[np.ndarray, " samples"],
    rate: float,
    cutoff_Hz: float,
    settings: ConditioningSettings,
) -> Float[np.ndarray, "samples *columns"]:
    """A plate's samples through the filter that kinematics share, each recorded stretch by itself.

    What stands where nothing was recorded is made up: it stays as it is, and reaches no sample beside it.

    Args:
        samples: at the plate's rate; no NaN.
        recorded: which of them are.
        rate: of the plate [Hz].
        cutoff_Hz: `shared_cutoff`.
        settings: the filter's order.
    """
    smooth = np.array(samples, dtype=float)
    for start, end in runs(recorded):
        smooth[start:end] = low_pass(samples[start:end], rate, cutoff_Hz, settings.order)
    return smooth


def shared_cutoff(marker_rate: float, settings: ConditioningSettings = CONDITIONING) -> float:
    """The corner that forces and kinematics share [Hz]: below the markers' Nyquist frequency."""
    return min(settings.cutoff_Hz, settings.nyquist_share * marker_rate / 2)


def resample_plate(
    plate: ForcePlate, times: Float[np.ndarray, " frames"]
) -> tuple[ForcePlate, Bool[np.ndarray, " frames"]]:
    """The plate on another clock, and which frames its recording covers; NaN on the others.

    Args:
        plate: no NaN in force and moment.
        times: equally spaced [s].
    """
    wrench = np.concatenate([plate.force_ground, plate.moment_ground], axis=1)
    values = resample(wrench, plate.rate, plate.start_time, times)
    pressed = at_nearest_samples(np.isfinite(plate.cop_ground).all(axis=1), plate, times)
    cop = centre_of_pressure(values[:, :3], values[:, 3:], surface_of(plate))
    rate = rate_of(times)
    moved = replace(
        plate,
        force_ground=values[:, :3],
        moment_ground=values[:, 3:],
        cop_ground=np.where(pressed[:, None], cop, np.nan),
        rate=rate if np.isfinite(rate) else plate.rate,
        start_time=float(times[0]),
        point_ground=None,
    )
    return moved, covered(plate.rate, plate.start_time, plate.samples, times)


def of_a_person(
    plate: ForcePlate, settings: ConditioningSettings = CONDITIONING
) -> tuple[ForcePlate, tuple[Note, ...]]:
    """The plate with forces that nobody exerts unmeasured (NaN), and a note if there are any."""
    with np.errstate(invalid="ignore"):
        beyond = (np.abs(plate.force_ground) > settings.largest_N).any(axis=1)
    if not beyond.any():
        return plate, ()
    note = Note(
        Kind.OTHER,
        f"{plate.name}: {int(beyond.sum())} samples above {settings.largest_N:g} N, more than a person can "
        f"exert, count as missing (first at {plate.times[int(np.argmax(beyond))]:.3f} s)",
    )
    return plate.unrecorded_at(beyond), (note,)


def fill_gaps(
    plate: ForcePlate, settings: ConditioningSettings = CONDITIONING
) -> tuple[ForcePlate, Bool[np.ndarray, " samples"], tuple[Note, ...]]:
    """No NaN in force and moment: gaps are bridged by lines; and which samples count as recorded.

    Forces that nobody exerts are gaps, too. Samples in gaps longer than `longest_gap_s`, and at the ends,
    don't count.
    """
    plate, notes = of_a_person(plate, settings)
    wrench = np.concatenate([plate.force_ground, plate.moment_ground], axis=1)
    known = np.isfinite(wrench).all(axis=1)
    if known.all():
        return plate, known, ()
    recorded = known.copy()
    interpolated, lost = 0, []
    for start, end in runs(~known):
        inside = start > 0 and end < plate.samples
        if inside and (end - start) <= settings.longest_gap_s * plate.rate:
            recorded[start:end] = True
            interpolated += end - start
        else:
            lost.append(f"{plate.times[start]:.3f} to {plate.times[end - 1]:.3f} s")
    if interpolated:
        notes += noted(
            Kind.OTHER,
            f"{plate.name}: {interpolated} missing samples interpolated, in gaps of up to "
            f"{settings.longest_gap_s:g} s",
        )
    if lost:
        listed = ", ".join(lost[:5]) + (f" and {len(lost) - 5} more" if len(lost) > 5 else "")
        notes += noted(
            Kind.LEFT_OUT, f"{plate.name}: no values from {listed}; those frames count as not observed"
        )
    filled = bridge_gaps(wrench, known) if known.any() else np.zeros_like(wrench)
    return replace(plate, force_ground=filled[:, :3], moment_ground=filled[:, 3:]), recorded, notes


def contact_samples(
    plate: ForcePlate, settings: ConditioningSettings = CONDITIONING
) -> Bool[np.ndarray, " samples"]:
    """Where the plate carries a load: above the threshold, for longer than vibration lasts."""
    above = plate.force_ground @ surface_of(plate).normal_ground >= settings.threshold_N
    for start, end in runs(above):
        inside = start > 0 and end < plate.samples
        if inside and (end - start) < settings.shortest_contact_s * plate.rate:
            above[start:end] = False
    return above


def at_nearest_samples(
    mask: Bool[np.ndarray, " samples"], plate: ForcePlate, times: Float[np.ndarray, " frames"]
) -> Bool[np.ndarray, " frames"]:
    """The mask at the sample nearest to each time."""
    nearest = np.round((times - plate.start_time) * plate.rate).astype(int)
    return mask[np.clip(nearest, 0, plate.samples - 1)]


def observed_at(
    times: Float[np.ndarray, " frames"], plate: ForcePlate, recorded: Bool[np.ndarray, " samples"]
) -> Bool[np.ndarray, " frames"]:
    """At which times a plate was recorded: within its record, and nearest to a sample that counts."""
    within = covered(plate.rate, plate.start_time, plate.samples, times)
    return within & at_nearest_samples(recorded, plate, times)


def _widened(mask: Bool[np.ndarray, " samples"], by: float) -> Bool[np.ndarray, " samples"]:
    reach = round(by)
    return np.convolve(mask, np.ones(2 * reach + 1), mode="same") > 0.5 if reach else mask


def _cutoff_notes(plate: ForcePlate, cutoff: float, settings: ConditioningSettings) -> tuple[Note, ...]:
    if cutoff >= plate.rate / 2:
        return noted(
            Kind.PLATES,
            f"{plate.name}: not low-passed at {cutoff:.3g} Hz: at {plate.rate:g} samples a second it holds "
            f"nothing above {plate.rate / 2:g} Hz, and contacts are blurred accordingly",
        )
    if cutoff == settings.cutoff_Hz:
        return ()
    return noted(
        Kind.PLATES,
        f"{plate.name}: low-passed at {cutoff:.3g} Hz instead of {settings.cutoff_Hz:g}: the markers' "
        "rate is too low",
    )


def _coverage_notes(
    name: str, observed: Bool[np.ndarray, " frames"], times: Float[np.ndarray, " frames"]
) -> tuple[Note, ...]:
    if observed.all():
        return ()
    if not observed.any():
        return noted(
            Kind.FORCES_AGAINST_BODY,
            f"{name}: its recording covers none of the marker frames; do both share one clock?",
        )
    listed = ", ".join(f"{times[start]:.3f} to {times[end - 1]:.3f} s" for start, end in runs(~observed))
    return noted(Kind.LEFT_OUT, f"{name}: {int((~observed).sum())} marker frames are not observed ({listed})")
