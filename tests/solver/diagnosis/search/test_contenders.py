"""How causes compare: odds, likeness, confidence."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.body_masses import WHOLE_LIMBS_ODDS, SegmentMass
from solver.diagnosis.causes.exchanged_forces import PlateSwap
from solver.diagnosis.causes.external_contact import ExternalContact
from solver.diagnosis.causes.gross_cause import Beyond
from solver.diagnosis.causes.on_segments import BETWEEN_OTHERS_ODDS
from solver.diagnosis.causes.plate_geometry import PlatePosition
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.search.contenders import TEMPER_NATS, confidence, handicap
from solver.diagnosis.search.selection import select
from solver.fitting.diagnosis_settings import DiagnosisSettings

SETTINGS = DiagnosisSettings()


def test_one_leg_alone_is_rarer_than_both(short_scene):
    usual = {c.target: handicap(c, SETTINGS) for c in SegmentMass.candidates([short_scene])}
    assert usual["femur_r"] == usual["femur_l"] > usual["femur_r+femur_l"]


def test_confidence_is_a_share_among_rivals_and_none(drawn, balance_of_scenes, short_scene):
    balance = balance_of_scenes(drawn(4, 0.2 * short_scene.plates[0].wrench_ground))
    found = select(
        balance, [PlateGain("plate_1"), PlateGain("plate_2"), *PlatePosition.candidates([short_scene])]
    ).found[0]
    one = found.contender
    temper = TEMPER_NATS
    odds = [c.gain - handicap(c.term.candidate, SETTINGS) for c in (one, *found.rivals)]
    weights = np.exp((np.array([*odds, 0.0]) - odds[0]) / temper)
    assert confidence(one, found.rivals, SETTINGS) == pytest.approx(1 / weights.sum())
    assert confidence(one, (one, *found.rivals), SETTINGS) == pytest.approx(1 / weights.sum())
    alone = confidence(one, (), SETTINGS)
    assert alone >= confidence(one, found.rivals, SETTINGS)
    counterpart = replace(
        found.rivals[0],
        gain=one.gain
        - handicap(one.term.candidate, SETTINGS)
        + handicap(found.rivals[0].term.candidate, SETTINGS),
    )
    assert confidence(one, (counterpart,), SETTINGS) == pytest.approx(0.5, abs=0.01)


def test_whole_limbs_are_likelier_than_single_segments():
    pair = SegmentMass("femur_r+femur_l")
    legs = SegmentMass("femur_r+tibia_r+femur_l+tibia_l")
    nearer = handicap(pair, SETTINGS) - handicap(legs, SETTINGS)
    assert nearer == -WHOLE_LIMBS_ODDS > 0
    beyond = Beyond(legs.target, legs, PlateSwap("plate_1+plate_2"))
    assert handicap(beyond, SETTINGS) == handicap(legs, SETTINGS)


def test_a_forearm_is_touched_more_rarely_than_a_hand():
    hand, forearm = ExternalContact("hand_r"), ExternalContact("ulna_r", between_others=True)
    farther = handicap(forearm, SETTINGS) - handicap(hand, SETTINGS)
    assert farther == BETWEEN_OTHERS_ODDS > 0
    beyond = Beyond(forearm.target, forearm, PlateSwap("plate_1+plate_2"))
    assert handicap(beyond, SETTINGS) == handicap(forearm, SETTINGS)
