"""What contact states are called, how sure they are, and the numbers they rest on."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import exp

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import ForcePlate
from solver.common.runs import runs
from solver.contact.detection_balance import UP
from solver.contact.detection_search import Findings
from solver.contact.detection_settings import DetectionSettings
from solver.contact.proposals import (
    CONTACT_BUT_NO_FORCE,
    FORCE_DISCREPANCY,
    NOT_OVER_FORCE_PLATE,
    UNMEASURED_EXTERNAL_FORCE,
    ZERO_WHILE_ACCELERATING,
    Proposal,
)
from solver.contact.wrenches import ContactWrenches


def proposals_of(
    findings: Findings,
    contacts: ContactWrenches,
    plates: Sequence[ForcePlate],
    settings: DetectionSettings,
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
    for k in np.flatnonzero(findings.explained.evidence > settings.suspect * settings.part_cost).tolist():
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
        share, cost = float(explained.missing[index]), self.settings.part_cost
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
        reach, missing = round(self.settings.rolling_s * frame_evidence.rate), self.findings.missing
        steep_N = self.settings.steep * self.findings.weight
        near = np.zeros_like(lost)
        for start, end in runs(lost):
            before, after = max(0, start - reach), min(len(lost) - 1, end - 1 + reach)
            near[before:start] = missing[start] - missing[before] < steep_N
            near[end : after + 1] = missing[end - 1] - missing[after] < steep_N
        rolling = (
            near
            & ~frame_evidence.loaded[:, foot]
            & (frame_evidence.ground[:, foot] > self.settings.rolling_odds)
        )
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
        return ZERO_WHILE_ACCELERATING if total.mean() < self.settings.nobody_N else FORCE_DISCREPANCY

    def _confidence(self, log_odds: float) -> float:
        """0.5 for what the contact states barely need, 1 for what nothing else explains."""
        return 1.0 - 0.5 * exp(-max(0.0, log_odds) / self.settings.sure_odds)

    def _sum(self, odds: Float[np.ndarray, " some"]) -> float:
        return float(odds.sum()) / (self.settings.steady_s * self.findings.frame_evidence.rate)

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
