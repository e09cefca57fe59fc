"""A trial whose labels are corrected before the fit: what changes, what stays, and what is told."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import Capture, Markers
from solver.common.notes import Kind, noted
from solver.kinematics.label_faults.fault import EXCHANGED, MASKED, Exchange
from solver.kinematics.label_faults.repair import repair_labels_of
from solver.kinematics.label_faults.settings import LabelRepairSettings
from solver.kinematics.label_faults.wrong_labels import exchanged_back
from solver.kinematics.marker_matching import match_markers

SETTINGS = LabelRepairSettings()
OFF = replace(SETTINGS, enabled=False)
SWAP, GHOST = (slice(100, 160), (0, 2)), (slice(30, 60), 8)


@pytest.fixture
def repaired(crane):
    """Repairs positions under the crane's names, in another order and beside a label that it lacks."""

    def run(positions, rate, *, settings=SETTINGS, others=(), accepted=()):
        def recording(x):
            loose = np.full((len(x), 1, 3), 5.0)
            return Markers(
                ("loose", *crane.marker_names[::-1]), np.concatenate([loose, x[:, ::-1]], axis=1), rate
            )

        capture = Capture("walk", recording(positions), notes=noted(Kind.OTHER, "read"))
        match = match_markers(crane, [capture.markers])
        return capture, *repair_labels_of(
            capture, [recording(x) for x in others], match, match.skeleton(crane), settings, accepted=accepted
        )

    return run


@pytest.fixture
def spoilt(swinging):
    x = exchanged_back(swinging.positions_ground, SWAP[1], SWAP[0].start, SWAP[0].stop)
    x[GHOST] = [1.0, 1.0, 1.0]
    return x


def test_a_sound_trial_is_the_same_object(repaired, swinging):
    capture, exchanged, faults = repaired(swinging.positions_ground, swinging.rate)
    assert exchanged is capture
    assert faults == ()


def test_both_kinds_are_repaired_noted_and_nothing_else_moves(repaired, spoilt, swinging):
    capture, exchanged, (ghost, swap) = repaired(spoilt, swinging.rate)
    assert (swap.labels, swap.start, swap.end, swap.done, swap.frames) == (
        ("M0", "M2"),
        100,
        160,
        EXCHANGED,
        60,
    )
    assert (ghost.labels, ghost.start, ghost.end, ghost.done, ghost.frames) == (("M8",), 30, 60, MASKED, 30)
    assert exchanged.notes == ("read", ghost.note, swap.note)
    expected = swinging.positions_ground.copy()
    expected[GHOST] = np.nan
    np.testing.assert_array_equal(exchanged.markers.positions_ground[:, :0:-1], expected)
    np.testing.assert_array_equal(exchanged.markers.positions_ground[:, 0], 5.0)
    assert np.isfinite(capture.markers.positions_ground).all()  # as recorded


def test_what_is_repaired_needs_no_repair(repaired, spoilt, swinging):
    _, exchanged, _ = repaired(spoilt, swinging.rate)
    _, again, faults = repaired(exchanged.markers.positions_ground[:, :0:-1], swinging.rate)
    assert faults == ()
    assert again.notes == ("read",)


def test_switched_off_only_a_persons_word_counts(repaired, spoilt, swinging):
    assert repaired(spoilt, swinging.rate, settings=OFF)[2] == ()
    word = Exchange("walk", ("M0", "M2"), 100, 160)
    _, exchanged, (swap,) = repaired(
        spoilt, swinging.rate, settings=OFF, accepted=[word, Exchange("run", ("M0", "M3"), 0, 9)]
    )
    assert swap.accepted
    assert "accepted" in exchanged.notes[-1]
    np.testing.assert_array_equal(exchanged.markers.positions_ground[:, -1], swinging.positions_ground[:, 0])


def test_what_a_person_exchanged_is_not_found_once_more(repaired, spoilt, swinging):
    word = Exchange("walk", ("M0", "M2"), 100, 160)
    *_, faults = repaired(spoilt, swinging.rate, accepted=[word])
    assert [(f.labels, f.accepted) for f in faults] == [(("M8",), False), (("M0", "M2"), True)]


def test_names_that_another_recording_contradicts_are_left_alone(repaired, swinging):
    x = exchanged_back(swinging.positions_ground, SWAP[1], 80, 300)
    assert len(repaired(x, swinging.rate)[2]) == 1  # the wrong part, were nothing else known
    assert repaired(x, swinging.rate, others=[swinging.positions_ground[:50]])[2] == ()
