"""What a plate's own samples show: clipped peaks, hung-up values, spikes, dropouts."""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import median_filter

from solver.capture.capture import ForcePlate
from solver.common.runs import runs
from solver.contact.detection_balance import UP
from solver.contact.detection_settings import DetectionSettings
from solver.contact.proposals import CLIPPED, MISSING_BLIP, OUTLIERS, Proposal
from solver.contact.wrenches import ContactWrenches

SAME = 1e-9  # of the force: equal but for rounding in a unit's conversion


def plate_faults(
    plates: Sequence[ForcePlate],
    contacts: ContactWrenches,
    times: Float[np.ndarray, " frames"],
    weight: float,
    settings: DetectionSettings,
) -> Iterator[Proposal]:
    """Stretches on which a plate's amplifier or transmission failed.

    Args:
        plates: as recorded.
        contacts: forces given to feet, by plate in the same order.
        times: of the frames, on the plates' clock [s].
        weight: of the body [N].
        settings: thresholds.
    """
    for k, plate in enumerate(plates):
        force = np.nan_to_num(plate.force_ground)
        faults = (
            (CLIPPED, _clipped(force, plate.rate, settings)),
            (CLIPPED, _held(force, plate.rate, settings)),
            (OUTLIERS, _spikes(force, plate.rate, weight, settings)),
            (MISSING_BLIP, _dropouts(force[:, UP], plate.rate, weight, settings)),
        )
        for reason, wrong in faults:
            for start, end in runs(_at_frames(wrong, plate, times)):
                foot = _owner(contacts, k, start, end)
                part = _samples_between(plate, times[start], times[end - 1])
                peak = float(np.abs(force[part, UP]).max(initial=0.0))
                yield Proposal(
                    (start, end),
                    foot,
                    reason,
                    settings.fault_confidence,
                    {"plate": float(k + 1), "peak_N": peak},
                )


def _clipped(
    force: Float[np.ndarray, "samples 3"], rate: float, settings: DetectionSettings
) -> Bool[np.ndarray, " samples"]:
    """A channel that stays at its own extreme, and leaves it at once on both sides."""
    clipped = np.zeros(len(force), dtype=bool)
    shortest = max(settings.clipped_samples, settings.clipped_s * rate)
    for channel in np.abs(force).T:
        top = channel.max(initial=0.0)
        if top < settings.clipped_N:
            continue
        for start, end in runs(channel >= top * (1.0 - SAME)):
            length = end - start
            if length < shortest or start < length or end + length > len(channel):
                continue
            drop = top - max(channel[start - length], channel[end + length - 1])
            clipped[start:end] |= drop > settings.clipped_drop * top
    return clipped


def _held(
    force: Float[np.ndarray, "samples 3"], rate: float, settings: DetectionSettings
) -> Bool[np.ndarray, " samples"]:
    """A loaded plate all of whose channels repeat one value."""
    still = np.zeros(len(force), dtype=bool)
    still[1:] = (np.diff(force, axis=0) == 0).all(axis=1)
    held = np.zeros(len(force), dtype=bool)
    for start, end in runs(still & (force[:, UP] > settings.fault_loaded_N)):
        held[start:end] = end - start >= settings.held_s * rate
    return held


def _spikes(
    force: Float[np.ndarray, "samples 3"], rate: float, weight: float, settings: DetectionSettings
) -> Bool[np.ndarray, " samples"]:
    """Samples far from the median of their neighbourhood; needs samples enough to tell them from a step."""
    width = int(settings.spike_s * rate)
    if width < 1:
        return np.zeros(len(force), dtype=bool)
    usual = median_filter(force, size=(2 * width + 1, 1), mode="nearest")
    return (np.abs(force - usual) > settings.spike * weight).any(axis=1)


def _dropouts(
    vertical: Float[np.ndarray, " samples"], rate: float, weight: float, settings: DetectionSettings
) -> Bool[np.ndarray, " samples"]:
    """Short gaps, longer than a spike, in a contact whose force is high right before and after."""
    lost = np.zeros(len(vertical), dtype=bool)
    near = max(1, round(2.0 * settings.spike_s * rate))
    for start, end in runs(vertical < settings.fault_loaded_N):
        inside = start > 0 and end < len(vertical)
        if inside and settings.spike_s < (end - start) / rate <= settings.dropout_s:
            before, after = vertical[max(0, start - near) : start].max(), vertical[end : end + near].max()
            lost[start:end] = min(before, after) > settings.dropout * weight
    return lost


def _at_frames(
    wrong: Bool[np.ndarray, " samples"], plate: ForcePlate, times: Float[np.ndarray, " frames"]
) -> Bool[np.ndarray, " frames"]:
    """Frames that any wrong sample lies nearer to than to the next frame."""
    flags = np.zeros(len(times), dtype=bool)
    hit = np.flatnonzero(wrong)
    if len(hit) and len(times) > 1:
        rate = (len(times) - 1) / (times[-1] - times[0])
        frames = np.round((plate.start_time + hit / plate.rate - times[0]) * rate).astype(int)
        flags[frames[(frames >= 0) & (frames < len(times))]] = True
    return flags


def _samples_between(plate: ForcePlate, start_time: float, end_time: float) -> slice:
    first, last = (max(0, round((t - plate.start_time) * plate.rate)) for t in (start_time, end_time))
    return slice(first, last + 1)


def _owner(contacts: ContactWrenches, plate: int, start: int, end: int) -> str | None:
    """The foot that the plate carries there; None where none or several."""
    owners = set(contacts.plate[start:end, plate].tolist())
    owner = owners.pop() if len(owners) == 1 else -1
    return contacts.foot_bodies[owner] if owner >= 0 else None
