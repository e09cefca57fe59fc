"""What reading the files has undone is named where leaving it in would cost evidence."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.exchanged_forces import PlateSwap
from solver.diagnosis.search.selection import select
from tests.solver.diagnosis.named_causes import (
    Shaken,
    named,
)


def test_what_reading_undid_is_named_if_leaving_it_in_would_cost(drawn, balance_of_scenes):
    balance = balance_of_scenes(drawn(1))
    selection = select(balance, [Shaken("all")])
    (one,) = selection.corrected
    assert one.key == ("shaken", "all")
    assert named(selection) == []
    (left_in,) = selection.uncorrected
    worse = balance.solve([left_in]).log_evidence
    assert one.contender.gain == pytest.approx(selection.solved.log_evidence - worse, abs=1e-6)


@pytest.mark.parametrize("exchanged", [True, False])
def test_what_reading_undid_is_told_of_the_plate_that_has_it_in_the_corrected_recording(
    drawn, balance_of_scenes, exchanged
):
    """Of plate 1 as the files number them, which hold there, if they are exchanged, what plate 2 measured."""
    sound = drawn(1)
    recorded = replace(sound, plates=PlateSwap("plate_1+plate_2").correct_plates(sound.plates))
    balance = balance_of_scenes(recorded if exchanged else sound)
    selection = select(balance, [PlateSwap("plate_1+plate_2"), Shaken("plate_1")])
    assert [name for name, _ in named(selection)] == (["plate_swap"] if exchanged else [])
    assert [c.key for c in selection.corrected] == [("shaken", "plate_2" if exchanged else "plate_1")]


def test_what_reading_undid_is_not_named_if_leaving_it_in_would_do(drawn, balance_of_scenes, short_scene):
    lost = np.zeros((short_scene.frames, 6))
    lost[:, 0] = 40.0  # taken off where it belonged
    balance = balance_of_scenes(drawn(1, lost))
    assert select(balance, [Shaken("all")]).corrected == ()
