"""What the story's states are called, how sure they are, and the numbers they rest on."""

from collections.abc import Iterator, Sequence
from math import exp

import numpy as np
from jaxtyping import Float
from scipy.ndimage import binary_dilation

from solver.capture.capture import ForcePlate
from solver.contact.detection_balance import UP
from solver.contact.detection_search import Findings, RecordedContact
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
from solver.runs import runs

LOADED_N = 20.0  # all plates together below it: nobody stands on them
SURE = 8.0  # log odds by which the doubt has shrunk to a third


def proposals_of(
    findings: Findings,
    contacts: ContactWrenches,
    plates: Sequence[ForcePlate],
    rate: float,
    settings: DetectionSettings,
) -> Iterator[Proposal]:
    """A proposal for each contact measured in part, each stretch of lost force, and each force elsewhere.

    Args:
        findings: the story and its evidence.
        contacts: forces given to feet.
        plates: as recorded; their corners, where known, tell what lies beside a plate.
        rate: [Hz].
        settings: thresholds.
    """
    floor = [p.corners_ground for p in plates]
    known_floor = [c for c in floor if c is not None] if all(c is not None for c in floor) else []
    for k, contact in enumerate(findings.recorded):
        if findings.explained.evidence[k] > 0:
            yield _of_part(findings, k, contact, contacts, known_floor, settings)
    for foot, name in enumerate(contacts.foot_bodies):
        for start, end in _widened(findings, foot, rate, settings):
            yield _of_lost(findings, foot, name, (start, end), contacts, known_floor, rate, settings)
    for start, end in runs(findings.story.elsewhere):
        part = slice(start, end)
        odds = float(findings.clues.missing[part].sum()) / (settings.steady_s * rate)
        yield Proposal(
            (start, end), None, UNMEASURED_EXTERNAL_FORCE, _confidence(odds), _balance_numbers(findings, part)
        )


def _widened(
    findings: Findings, foot: int, rate: float, settings: DetectionSettings
) -> list[tuple[int, int]]:
    """Stretches of lost force, each as long as the foot may still carry some: it lands and leaves gradually."""
    lost = findings.story.lost[:, foot]
    slow = ~findings.clues.loaded[:, foot] & (findings.clues.ground[:, foot] > settings.rolling_odds)
    reach = round(settings.rolling_s * rate)
    wide = lost | (slow & binary_dilation(lost, iterations=reach)) if reach else lost
    return [(a, b) for a, b in runs(wide) if lost[a:b].any()]


def _of_part(
    findings: Findings,
    index: int,
    contact: RecordedContact,
    contacts: ContactWrenches,
    floor: Sequence[Float[np.ndarray, "4 3"]],
    settings: DetectionSettings,
) -> Proposal:
    part = slice(contact.start, contact.end)
    share, evidence = float(findings.explained.missing[index]), float(findings.explained.evidence[index])
    off = _share_off_plates(findings.corners_ground[contact.foot][part], floor)
    sure = _confidence(evidence - settings.part_cost) if share else 0.5 * evidence / settings.part_cost
    return Proposal(
        (contact.start, contact.end),
        contacts.foot_bodies[contact.foot],
        NOT_OVER_FORCE_PLATE if off > 0 and share > 0 else FORCE_DISCREPANCY,
        sure,
        {
            "missing_share": share / (1.0 + share),
            "log_odds": evidence - settings.part_cost,
            "measured_N": float(np.nanmean(contacts.wrench_raw_ground[part, contact.foot, UP])),
            **({"share_off_plates": off} if floor else {}),
        },
    )


def _of_lost(
    findings: Findings,
    foot: int,
    name: str,
    span: tuple[int, int],
    contacts: ContactWrenches,
    floor: Sequence[Float[np.ndarray, "4 3"]],
    rate: float,
    settings: DetectionSettings,
) -> Proposal:
    part = slice(*span)
    clues = findings.clues
    off = _share_off_plates(findings.corners_ground[foot][part], floor)
    odds = float((clues.missing + clues.ground[:, foot])[part].sum()) / (settings.steady_s * rate)
    loaded = float(contacts.in_contact[part, foot].mean())
    total = float(np.nan_to_num(contacts.wrench_raw_ground[part, :, UP]).sum(axis=1).mean())
    if off > 0.5 or (off > 0 and loaded > 0.5):
        reason = NOT_OVER_FORCE_PLATE
    elif loaded > 0.5:
        reason = FORCE_DISCREPANCY
    elif np.median(clues.ground[part, foot]) > 0:
        reason = CONTACT_BUT_NO_FORCE
    else:
        reason = ZERO_WHILE_ACCELERATING if total < LOADED_N else FORCE_DISCREPANCY
    numbers = {
        **_balance_numbers(findings, part),
        "measured_N": float(np.nan_to_num(contacts.wrench_raw_ground[part, foot, UP]).mean()),
        "slip_m_s": float(np.median(findings.slip[part, foot])),
        "log_odds": odds,
        **({"share_off_plates": off} if floor else {}),
    }
    return Proposal(span, name, reason, _confidence(odds), numbers)


def _balance_numbers(findings: Findings, part: slice) -> dict[str, float]:
    return {
        "missing_N": float(findings.missing[part].mean()),
        "error_N": float(findings.error[part].mean()),
    }


def _confidence(log_odds: float) -> float:
    """0.5 for what the story barely needs, 1 for what nothing else explains."""
    return 1.0 - 0.5 * exp(-max(0.0, log_odds) / SURE)


def _share_off_plates(
    corners_ground: Float[np.ndarray, "frames corners 3"], floor: Sequence[Float[np.ndarray, "4 3"]]
) -> float:
    """Share of a sole's corners beside every plate, on the frame of its middle; 0 where no corners are known."""
    if not floor:
        return 0.0
    points = np.median(corners_ground, axis=0)[:, [0, 2]]
    over = np.zeros(len(points), dtype=bool)
    for plate in floor:
        over |= _inside(points, plate[:, [0, 2]])
    return float(1.0 - over.mean())


def _inside(
    points: Float[np.ndarray, "points 2"], corners: Float[np.ndarray, "4 2"]
) -> Float[np.ndarray, " points"]:
    """Whether points lie in a convex polygon, whichever way round its corners are listed."""
    centre = corners.mean(axis=0)
    around = corners[np.argsort(np.arctan2(*(corners - centre).T))]
    edge = np.roll(around, -1, axis=0) - around
    offset = points[:, None] - around
    side = edge[:, 0] * offset[..., 1] - edge[:, 1] * offset[..., 0]
    return (side >= 0).all(axis=1) | (side <= 0).all(axis=1)
