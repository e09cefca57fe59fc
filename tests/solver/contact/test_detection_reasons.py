"""How far a proposal reaches beyond what the contact states say."""

import numpy as np
import pytest

from solver.contact.detection import ROLLING_ODDS, ROLLING_S, proposals_of
from solver.contact.detection_search import Findings
from solver.contact.detection_settings import BORDER_S, DetectionSettings
from solver.contact.detection_shares import Explained
from solver.contact.detection_states import ContactStates, Foot, FrameEvidence
from solver.contact.wrenches import ContactWrenches

FRAMES, RATE, WEIGHT = 100, 200.0, 700.0
SETTINGS = DetectionSettings()
LOST = slice(40, 60)
REACH = round(ROLLING_S * RATE)
BORDER = round(BORDER_S * RATE)


def proposals(missing, ground=2.0):
    feet = np.full((FRAMES, 2), Foot.UP)
    feet[LOST, 0] = Foot.LOST
    nothing = np.zeros(FRAMES)
    frame_evidence = FrameEvidence(
        missing=np.where(missing > 50, 4.0, -1.0),
        partly=np.zeros((FRAMES, 2)),
        ground=np.full((FRAMES, 2), ground),
        place={},
        loaded=np.zeros((FRAMES, 2), dtype=bool),
        rate=RATE,
    )
    findings = Findings(
        contact_states=ContactStates(feet, nothing.astype(bool)),
        frame_evidence=frame_evidence,
        missing=missing,
        error=nothing + 20.0,
        weight=WEIGHT,
        slip=np.zeros((FRAMES, 2)),
        corners_ground=(),
        recorded=(),
        explained=Explained.nothing(0, SETTINGS),
        border=BORDER,
    )
    contacts = ContactWrenches(
        foot_bodies=("calcn_r", "calcn_l"),
        wrench_ground=np.zeros((FRAMES, 2, 6)),
        cop_ground=np.full((FRAMES, 2, 3), np.nan),
        observed=np.ones(FRAMES, dtype=bool),
        in_contact=np.zeros((FRAMES, 2), dtype=bool),
        plate=np.zeros((FRAMES, 0), dtype=int),
        wrench_raw_ground=np.zeros((FRAMES, 2, 6)),
    )
    return list(proposals_of(findings, contacts, (), SETTINGS))


def force(rise):
    """A missing force of one body weight that rises and falls by so much a frame [N]."""
    inside = np.minimum(np.arange(FRAMES) - LOST.start + 1, LOST.stop - np.arange(FRAMES))
    return np.clip(rise * inside, 0.0, WEIGHT)


def test_a_foot_that_rolls_may_still_carry_a_little_beside_what_the_balance_sees():
    (found,) = proposals(force(0.01 * WEIGHT))
    assert found.range == (LOST.start - REACH - BORDER, LOST.stop + REACH + BORDER)


def test_a_foot_that_strikes_carried_nothing_before():
    (found,) = proposals(force(0.5 * WEIGHT))
    assert found.range == (LOST.start - BORDER, LOST.stop + BORDER)


def test_each_edge_is_judged_by_itself():
    falling = np.where(np.arange(FRAMES) < 50, force(0.5 * WEIGHT), force(0.01 * WEIGHT))
    (found,) = proposals(falling)
    assert found.range == (LOST.start - BORDER, LOST.stop + REACH + BORDER)


def test_a_swinging_foot_does_not_roll():
    (found,) = proposals(force(0.01 * WEIGHT), ground=ROLLING_ODDS - 0.1)
    assert found.range == (LOST.start - BORDER, LOST.stop + BORDER)


@pytest.mark.parametrize("start", [0, 1])
def test_a_loss_at_the_trials_end_stays_within_it(start, monkeypatch):
    monkeypatch.setattr(f"{__name__}.LOST", slice(start, FRAMES))
    (found,) = proposals(np.full(FRAMES, WEIGHT))
    assert found.range == (0, FRAMES)
