"""Frames with missing force: what a reviewer should look at, and what a fit leaves out until one has.

Four kinds of evidence meet in contact states (`detection_search`): the balance of the whole body, where the
missing force presses, how the soles move, and which plates are loaded. What plates and centres of pressure
show by themselves comes beside it.

What a plate's own samples show: clipped peaks, hung-up values, spikes, dropouts.

What contact states are called, how sure they are, and the numbers they rest on.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import exp

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import median_filter

from solver.capture.capture import ForcePlate
from solver.common.plate_figures import CONTACT_N
from solver.common.true_runs import runs
from solver.contact.assignment import FULL_WEIGHT_LOAD
from solver.contact.detected_ranges import (
    CLIPPED,
    CONTACT_BUT_NO_FORCE,
    COP_OUTSIDE_FOOT,
    FORCE_DISCREPANCY,
    MISSING_BLIP,
    NO_PLATE_DATA,
    NOT_OVER_FORCE_PLATE,
    OUTLIERS,
    UNMEASURED_EXTERNAL_FORCE,
    ZERO_WHILE_ACCELERATING,
    Proposal,
)
from solver.contact.detection_balance import UP
from solver.contact.detection_search import Findings, search
from solver.contact.detection_settings import DROPOUT, PART_COST, STEADY_S, DetectionSettings
from solver.contact.sole import soles
from solver.contact.wrenches import TWO_FEET, ContactWrenches
from solver.kinematics.motion import Motion
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

ROLLING_S = 0.01  # [s] so long before and after a foot may carry some 50 N: too little for the balance
ROLLING_ODDS = -0.5  # as long as its sole is not clearly swinging
# of body weight: a missing force that changes by more in that time is no rolling foot's, and the balance's
# smoother shows it early
STEEP = 0.25
SURE_ODDS = 8.0  # log odds by which the doubt about a proposal has shrunk to a third
NOBODY_N = CONTACT_N  # [N] all plates together below it: nobody stands on them
FAULT_LOADED_N = CONTACT_N  # [N] gait laboratories' usual contact threshold; faults are looked for above it
FAULT_CONFIDENCE = 0.8  # of such a proposal: the samples are plain, their effect on the fit is not
COP_LOAD = FULL_WEIGHT_LOAD  # of the peak force; below it a centre of pressure is noise
COP_OUTSIDE_S = 0.05  # [s] for so long; landing and push-off may touch the limit
CLIPPED_N = 200.0  # amplifiers saturate at large forces
CLIPPED_S = 0.008  # [s] at its largest value without a change: no peak is so flat
CLIPPED_SAMPLES = 4  # [samples] and for so many, where samples are rare
CLIPPED_DROP = 0.02  # of it, lost within as long again on both sides: a round peak loses less
HELD_S = 0.1  # [s] a loaded plate that repeats one value so long is stuck
SPIKE_S = 0.002  # [s] no step rises and falls within it, not even a sprinter's
SPIKE = 0.5  # of body weight: smaller spikes vanish in the 30 Hz filter
DROPOUT_S = 0.08  # [s] no foot leaves the plate at full load and is back so soon

SAME_VALUE_SHARE = 1e-9  # of the force: equal but for rounding in a unit's conversion

FEWEST_FRAMES = 8  # below it a trial has no accelerations


def plate_faults(
    plates: Sequence[ForcePlate],
    contacts: ContactWrenches,
    times: Float[np.ndarray, " frames"],
    weight: float,
) -> Iterator[Proposal]:
    """Stretches on which a plate's amplifier or transmission failed.

    Args:
        plates: as recorded.
        contacts: forces given to feet, by plate in the same order.
        times: of the frames, on the plates' clock [s].
        weight: of the body [N].
    """
    for k, plate in enumerate(plates):
        force = np.nan_to_num(plate.force_ground)
        faults = (
            (CLIPPED, _clipped(force, plate.rate)),
            (CLIPPED, _held(force, plate.rate)),
            (OUTLIERS, _spikes(force, plate.rate, weight)),
            (MISSING_BLIP, _dropouts(force[:, UP], plate.rate, weight)),
        )
        for reason, wrong in faults:
            for start, end in runs(_at_frames(wrong, plate, times)):
                foot = _owner(contacts, k, start, end)
                part = _samples_between(plate, times[start], times[end - 1])
                peak = float(np.abs(force[part, UP]).max(initial=0.0))
                yield Proposal(
                    (start, end), foot, reason, FAULT_CONFIDENCE, {"plate": float(k + 1), "peak_N": peak}
                )


def _clipped(force: Float[np.ndarray, "samples 3"], rate: float) -> Bool[np.ndarray, " samples"]:
    """A channel that stays at its own extreme, and leaves it at once on both sides."""
    clipped = np.zeros(len(force), dtype=bool)
    shortest = max(CLIPPED_SAMPLES, CLIPPED_S * rate)
    for channel in np.abs(force).T:
        top = channel.max(initial=0.0)
        if top < CLIPPED_N:
            continue
        for start, end in runs(channel >= top * (1.0 - SAME_VALUE_SHARE)):
            length = end - start
            if length < shortest or start < length or end + length > len(channel):
                continue
            drop = top - max(channel[start - length], channel[end + length - 1])
            clipped[start:end] |= drop > CLIPPED_DROP * top
    return clipped


def _held(force: Float[np.ndarray, "samples 3"], rate: float) -> Bool[np.ndarray, " samples"]:
    """A loaded plate all of whose channels repeat one value."""
    still = np.zeros(len(force), dtype=bool)
    still[1:] = (np.diff(force, axis=0) == 0).all(axis=1)
    held = np.zeros(len(force), dtype=bool)
    for start, end in runs(still & (force[:, UP] > FAULT_LOADED_N)):
        held[start:end] = end - start >= HELD_S * rate
    return held


def _spikes(
    force: Float[np.ndarray, "samples 3"], rate: float, weight: float
) -> Bool[np.ndarray, " samples"]:
    """Samples far from the median of their neighbourhood; needs samples enough to tell them from a step."""
    width = int(SPIKE_S * rate)
    if width < 1:
        return np.zeros(len(force), dtype=bool)
    usual = median_filter(force, size=(2 * width + 1, 1), mode="nearest")
    return (np.abs(force - usual) > SPIKE * weight).any(axis=1)


def _dropouts(
    vertical: Float[np.ndarray, " samples"], rate: float, weight: float
) -> Bool[np.ndarray, " samples"]:
    """Short gaps, longer than a spike, in a contact whose force is high right before and after."""
    lost = np.zeros(len(vertical), dtype=bool)
    near = max(1, round(2.0 * SPIKE_S * rate))
    for start, end in runs(vertical < FAULT_LOADED_N):
        inside = start > 0 and end < len(vertical)
        if inside and SPIKE_S < (end - start) / rate <= DROPOUT_S:
            before, after = vertical[max(0, start - near) : start].max(), vertical[end : end + near].max()
            lost[start:end] = min(before, after) > DROPOUT * weight
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


def proposals_of(
    findings: Findings, contacts: ContactWrenches, plates: Sequence[ForcePlate], settings: DetectionSettings
) -> Iterator[Proposal]:
    """A proposal for each contact measured in part, each stretch of lost force, and each force elsewhere.

    Args:
        findings: the contact states and their evidence.
        contacts: forces given to feet.
        plates: as recorded; their corners, where all are known, tell what lies beside the plates.
        settings: thresholds.
    """
    corners = [plate.corners_ground for plate in plates if plate.corners_ground is not None]
    judge = _Judge(findings, contacts, corners if len(corners) == len(plates) else [], settings)
    for k in np.flatnonzero(findings.explained.evidence > settings.suspect * PART_COST).tolist():
        yield judge.partly_measured(k)
    for foot in range(len(contacts.foot_bodies)):
        for start, end in judge.lost_stretches(foot):
            yield judge.lost(foot, start, end).widened(findings.border, contacts.frames)
    for start, end in runs(findings.contact_states.elsewhere):
        yield judge.elsewhere(start, end).widened(findings.border, contacts.frames)


@dataclass(frozen=True)
class _Judge:
    findings: Findings
    contacts: ContactWrenches
    floor: Sequence[Float[np.ndarray, "4 3"]]  # corners of all plates; empty where any are unknown
    settings: DetectionSettings

    def partly_measured(self, index: int) -> Proposal:
        contact, explained = self.findings.recorded[index], self.findings.explained
        part = slice(contact.start, contact.end)
        share, cost = float(explained.missing[index]), PART_COST
        evidence = float(explained.evidence[index])
        off = self._share_off_plates(contact.foot, part)
        return Proposal(
            (contact.start, contact.end),
            self.contacts.foot_bodies[contact.foot],
            NOT_OVER_FORCE_PLATE if off > 0 and share > 0 else FORCE_DISCREPANCY,
            self._confidence(evidence - cost) if share else 0.5 * evidence / cost,
            {
                "missing_share": share / (1.0 + share),
                "log_odds": evidence - cost,
                **self._measured(contact.foot, part, off),
            },
        )

    def lost_stretches(self, foot: int) -> list[tuple[int, int]]:
        """Each as long as the foot may still carry some: it lands and leaves gradually."""
        frame_evidence, lost = self.findings.frame_evidence, self.findings.contact_states.lost[:, foot]
        reach, missing = round(ROLLING_S * frame_evidence.rate), self.findings.missing
        steep_N = STEEP * self.findings.weight
        near = np.zeros_like(lost)
        for start, end in runs(lost):
            before, after = max(0, start - reach), min(len(lost) - 1, end - 1 + reach)
            near[before:start] = missing[start] - missing[before] < steep_N
            near[end : after + 1] = missing[end - 1] - missing[after] < steep_N
        rolling = near & ~frame_evidence.loaded[:, foot] & (frame_evidence.ground[:, foot] > ROLLING_ODDS)
        return runs(lost | rolling)

    def lost(self, foot: int, start: int, end: int) -> Proposal:
        part, frame_evidence = slice(start, end), self.findings.frame_evidence
        off = self._share_off_plates(foot, part)
        odds = self._sum((frame_evidence.missing + frame_evidence.ground[:, foot])[part])
        return Proposal(
            (start, end),
            self.contacts.foot_bodies[foot],
            self._reason(foot, part, off),
            self._confidence(odds),
            {
                **self._balance(part),
                **self._measured(foot, part, off),
                "slip_m_s": float(np.median(self.findings.slip[part, foot])),
                "log_odds": odds,
            },
        )

    def elsewhere(self, start: int, end: int) -> Proposal:
        part = slice(start, end)
        odds = self._sum(self.findings.frame_evidence.missing[part])
        numbers = {**self._balance(part), "log_odds": odds}
        return Proposal((start, end), None, UNMEASURED_EXTERNAL_FORCE, self._confidence(odds), numbers)

    def _reason(self, foot: int, part: slice, off: float) -> str:
        partly = bool(self.contacts.in_contact[part, foot].mean() > 0.5)
        if off > 0.5 or (off > 0 and partly):
            return NOT_OVER_FORCE_PLATE
        if partly:
            return FORCE_DISCREPANCY
        if np.median(self.findings.frame_evidence.ground[part, foot]) > 0:
            return CONTACT_BUT_NO_FORCE
        total = np.nan_to_num(self.contacts.wrench_raw_ground[part, :, UP]).sum(axis=1)
        return ZERO_WHILE_ACCELERATING if total.mean() < NOBODY_N else FORCE_DISCREPANCY

    def _confidence(self, log_odds: float) -> float:
        """0.5 for what the contact states barely need, 1 for what nothing else explains."""
        return 1.0 - 0.5 * exp(-max(0.0, log_odds) / SURE_ODDS)

    def _sum(self, odds: Float[np.ndarray, " some"]) -> float:
        return float(odds.sum()) / (STEADY_S * self.findings.frame_evidence.rate)

    def _balance(self, part: slice) -> dict[str, float]:
        missing, error = self.findings.missing[part], self.findings.error[part]
        return {"missing_N": float(missing.mean()), "error_N": float(error.mean())}

    def _measured(self, foot: int, part: slice, off: float) -> dict[str, float]:
        force = np.nan_to_num(self.contacts.wrench_raw_ground[part, foot, UP])
        return {"measured_N": float(force.mean()), **({"share_off_plates": off} if self.floor else {})}

    def _share_off_plates(self, foot: int, part: slice) -> float:
        """Share of a sole's corners that lie beside every plate; 0 where no corners are known."""
        if not self.floor:
            return 0.0
        points = np.median(self.findings.corners_ground[foot][part], axis=0)[:, [0, 2]]
        over = np.any([_inside(points, plate[:, [0, 2]]) for plate in self.floor], axis=0)
        return float(1.0 - over.mean())


def _inside(
    points: Float[np.ndarray, "points 2"], corners: Float[np.ndarray, "4 2"]
) -> Bool[np.ndarray, " points"]:
    """Whether points lie in a convex polygon, whichever way round its corners are listed."""
    offset = corners - corners.mean(axis=0)
    around = corners[np.argsort(np.arctan2(offset[:, 1], offset[:, 0]))]
    edge, reach = np.roll(around, -1, axis=0) - around, points[:, None] - around
    return (edge[:, 0] * reach[..., 1] - edge[:, 1] * reach[..., 0] >= 0).all(axis=1)


def detect(
    skeleton: Skeleton,
    motion: Motion,
    contacts: ContactWrenches | None,
    plates: Sequence[ForcePlate],
    *,
    tracked: Bool[np.ndarray, " frames"] | None = None,
    settings: DetectionSettings,
) -> tuple[Proposal, ...]:
    """Propose the ranges of frames on which a foot's force is missing or wrong.

    Args:
        skeleton: scaled, with the person's mass.
        motion: as the markers gave it, not filtered.
        contacts: forces given to feet; None where the trial has no plates.
        plates: as recorded, in the order of `contacts.plate`.
        tracked: frames that show enough markers for a pose; None: all.
        settings: thresholds.

    Returns:
        In order of time. Ranges of different reasons may overlap.
    """
    if contacts is None or not contacts.observed.any():
        return (Proposal((0, motion.frames), None, NO_PLATE_DATA, 1.0),)
    tracked = np.ones(motion.frames, dtype=bool) if tracked is None else tracked
    found = [Proposal(span, None, NO_PLATE_DATA, 1.0) for span in runs(~contacts.observed)]
    if motion.frames >= FEWEST_FRAMES:
        found += _within_recording(skeleton, motion, contacts, plates, tracked=tracked, settings=settings)
    return tuple(sorted(found, key=lambda p: (p.range, p.foot or "", p.reason)))


def _within_recording(
    skeleton: Skeleton,
    motion: Motion,
    contacts: ContactWrenches,
    plates: Sequence[ForcePlate],
    *,
    tracked: Bool[np.ndarray, " frames"],
    settings: DetectionSettings,
) -> Iterator[Proposal]:
    weight = skeleton.mass * float(np.linalg.norm(skeleton.gravity))
    findings = search(skeleton, motion, contacts, tracked, settings)
    poses = body_poses(skeleton, motion.q)
    yield from proposals_of(findings, contacts, plates, settings)
    for proposal in (
        *wrong_pressure(skeleton, poses, contacts, motion.rate, settings),
        *plate_faults(plates, contacts, motion.times, weight),
    ):
        yield proposal.widened(findings.border, motion.frames)


def wrong_pressure(
    skeleton: Skeleton,
    poses: tuple[Float[np.ndarray, "frames bodies 3 3"], Float[np.ndarray, "frames bodies 3"]],
    contacts: ContactWrenches,
    rate: float,
    settings: DetectionSettings,
) -> Iterator[Proposal]:
    """Stretches on which a well loaded foot's centre of pressure lies clearly beside its sole.

    Its moment is wrong then, though its force may be right. Where two feet stand on one plate the force
    cannot be divided, and both feet's are missing.

    Args:
        skeleton: scaled.
        poses: orientations and origins of all bodies.
        contacts: forces given to feet.
        rate: [Hz].
        settings: thresholds.
    """
    for foot, sole in enumerate(soles(skeleton, contacts.foot_bodies)):
        load = contacts.wrench_ground[:, foot, UP]
        well = contacts.in_contact[:, foot] & (load > COP_LOAD * load.max(initial=0.0))
        distance = np.where(well, sole.distance(*poses, contacts.cop_ground[:, foot]), 0.0)
        distance = np.nan_to_num(distance)
        for start, end in runs(distance > settings.cop_outside_m):
            if end - start >= COP_OUTSIDE_S * rate:
                worst = float(distance[start:end].max())
                yield Proposal(
                    (start, end),
                    contacts.foot_bodies[foot],
                    COP_OUTSIDE_FOOT,
                    1.0 - 0.5 * settings.cop_outside_m / worst,
                    {"outside_m": worst, "limit_m": settings.cop_outside_m},
                )
    for start, end in runs((contacts.plate == TWO_FEET).any(axis=1)):
        yield Proposal((start, end), None, COP_OUTSIDE_FOOT, 1.0, {"feet_on_one_plate": 2.0})
