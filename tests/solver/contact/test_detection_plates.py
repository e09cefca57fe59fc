from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import ForcePlate
from solver.contact.detection import plate_faults
from solver.contact.detection_settings import DetectionSettings
from solver.contact.wrenches import ContactWrenches

RATE, WEIGHT = 1000.0, 700.0
TIMES = np.arange(121) / 100.0
STANCE = slice(300, 900)  # samples
SETTINGS = DetectionSettings()


@pytest.fixture
def plate() -> ForcePlate:
    """A stance of 0.6 s with two humps and a sharp impact, and noise of 1.5 N."""
    phase = np.linspace(0, 1, 600)
    force = np.zeros((1200, 3))
    force[STANCE, 1] = 700 * np.sin(np.pi * phase) ** 0.4 + 120 * np.sin(3 * np.pi * phase)
    force[STANCE, 1] += 400 * np.exp(-(((phase - 0.04) / 0.01) ** 2))  # 12 ms wide
    force += 1.5 * np.random.default_rng(0).standard_normal(force.shape)
    return ForcePlate("1", force, np.zeros_like(force), np.full_like(force, np.nan), RATE)


def faults(plate, settings=SETTINGS):
    frames = len(TIMES)
    contacts = ContactWrenches(
        foot_bodies=("calcn_r", "calcn_l"),
        wrench_ground=np.zeros((frames, 2, 6)),
        cop_ground=np.full((frames, 2, 3), np.nan),
        observed=np.ones(frames, dtype=bool),
        in_contact=np.zeros((frames, 2), dtype=bool),
        plate=np.ones((frames, 1), dtype=int),
        wrench_raw_ground=np.zeros((frames, 2, 6)),
    )
    return list(plate_faults([plate], contacts, TIMES, WEIGHT))


def changed(plate, vertical):
    force = plate.force_ground.copy()
    force[:, 1] = vertical
    return replace(plate, force_ground=force)


def the_one(found):
    assert len(found) == 1, found
    return found[0]


def test_a_sound_plate_with_a_hard_impact_shows_nothing(plate):
    assert faults(plate) == []


def test_a_clipped_peak(plate):
    sound = plate.force_ground[:, 1]
    found = faults(changed(plate, np.minimum(sound, 650.0)))
    assert {(f.reason, f.foot) for f in found} == {("interpolatedClippedGRF", "calcn_l")}
    flagged = np.zeros(len(TIMES), dtype=bool)
    for proposal in found:
        flagged[slice(*proposal.range)] = True
        assert proposal.evidence["peak_N"] == 650.0
    clipped = np.append(sound[::10], 0.0) > 650.0
    assert (clipped & ~flagged).sum() <= 2  # the noise makes some plateaus short
    assert (flagged & ~clipped).sum() <= 2 * len(found)


def test_a_plate_that_hangs_up(plate):
    vertical = plate.force_ground[:, 1].copy()
    force = plate.force_ground.copy()
    force[500:650] = force[500]
    found = the_one(faults(replace(plate, force_ground=force)))
    assert found.reason == "interpolatedClippedGRF"
    assert found.range == (50, 66)
    assert vertical[500] != vertical[649]


@pytest.mark.parametrize("height", [900.0, -900.0])
def test_a_spike_of_a_millisecond(plate, height):
    vertical = plate.force_ground[:, 1].copy()
    vertical[620] += height
    found = the_one(faults(changed(plate, vertical)))
    assert (found.reason, found.range) == ("hasInputOutliers", (62, 63))


def test_a_dropout_inside_a_stance(plate):
    vertical = plate.force_ground[:, 1].copy()
    vertical[500:540] = 0.0
    reasons = {f.reason: f.range for f in faults(changed(plate, vertical))}
    assert reasons["missingBlip"] == (50, 55)


def test_a_flight_is_no_dropout(plate):
    """The same gap, left and entered as feet do it."""
    vertical = plate.force_ground[:, 1].copy()
    vertical[500:540] = 0.0
    vertical[440:500] *= np.linspace(1, 0, 60)
    vertical[540:600] *= np.linspace(0, 1, 60)
    assert faults(changed(plate, vertical)) == []


def test_slow_samples_make_no_spikes(plate):
    """At 100 Hz a running impact is two samples wide: nothing tells it from a spike."""
    slow = replace(plate, force_ground=plate.force_ground[::10], rate=100.0)
    assert faults(slow) == []
