"""Which causes are taken of a recording, beyond a gross error too, and when none is."""

from dataclasses import replace

import numpy as np
import pytest

from solver.common.errors import Cancelled
from solver.diagnosis.causes.body_masses import SubjectMass
from solver.diagnosis.causes.clocks import ClockOffset
from solver.diagnosis.causes.exchanged_forces import PlateSwap
from solver.diagnosis.causes.gross_cause import correct_scene, with_samples
from solver.diagnosis.causes.plate_geometry import PlatePosition
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.search.selection import select
from solver.fitting.diagnosis_settings import DiagnosisSettings
from tests.solver.diagnosis.named_causes import (
    named,
)

SETTINGS = DiagnosisSettings()


@pytest.fixture(scope="module")
def few(short_scene):
    """A small catalogue."""
    gains = [PlateGain(plate.target) for plate in short_scene.plates]
    return [
        *gains,
        *PlatePosition.candidates([short_scene]),
        *SubjectMass.candidates([short_scene]),
        ClockOffset("all"),
    ]


def test_nothing_is_found_in_what_model_errors_make(drawn, balance_of_scenes, few):
    assert [named(select(balance_of_scenes(drawn(seed)), few)) for seed in range(4)] == [[]] * 4


def test_two_causes_are_found_one_after_another_and_refitted_together(
    short_scene, drawn, balance_of_scenes, few
):
    missing = 0.15 * short_scene.plates[1].wrench_ground
    loads = short_scene.plates[0].wrench_ground
    moved = np.zeros_like(loads)
    moved[:, 3:] = np.cross([0.03, 0, 0.02], loads[:, :3])
    balance = balance_of_scenes(drawn(4, missing + moved, scale=0.5))
    selection = select(balance, few)
    assert set(named(selection)) == {("plate_gain", "plate_2"), ("plate_position", "plate_1")}
    assert len(selection.solved.terms) == 2
    assert selection.null.terms == ()
    assert selection.solved.log_evidence > selection.null.log_evidence
    k = [t.candidate.id for t in selection.solved.terms].index("plate_gain")
    gain = selection.solved.estimates(k, balance.scenes)["gain_error"]
    assert abs(gain.value - (1 / 1.15 - 1)) < 3 * gain.std
    assert all(f.held_out_gain > 0 and f.contender.gain > SETTINGS.least_gain for f in selection.found)
    assert all(c.term.candidate is not f.contender.term.candidate for f in selection.found for c in f.rivals)


def with_gain_of_the_second_then_exchanged(sound):
    first, second, *others = sound.plates
    loads = second.loads
    strong = with_samples(second, 1.1 * loads.wrench_ground, loads.carrying)
    wrong = replace(sound, plates=(first, strong, *others))
    return replace(wrong, plates=PlateSwap("plate_1+plate_2").correct_plates(wrong.plates))


def test_beyond_an_exchange_causes_have_the_plates_own_names(drawn, balance_of_scenes):
    """In the files the second plate's force stands in the first one's columns, and so does its gain."""
    balance = balance_of_scenes(with_gain_of_the_second_then_exchanged(drawn(1)))
    selection = select(balance, [PlateSwap("plate_1+plate_2"), PlateGain("plate_1"), PlateGain("plate_2")])
    assert set(named(selection)) == {("plate_swap", "plate_1+plate_2"), ("plate_gain", "plate_2")}


def test_beyond_an_exchange_the_catalogue_is_that_of_the_corrected_recording(drawn, balance_of_scenes):
    scene = with_gain_of_the_second_then_exchanged(drawn(1))
    swap = PlateSwap("plate_1+plate_2")
    balance = balance_of_scenes(scene)

    def of_corrected(scenes):
        same = np.allclose(scenes[0].measured_ground, correct_scene(swap, scene).measured_ground)
        return [PlateGain("plate_2")] if same else []

    assert named(select(balance, [swap])) == [swap.key]
    selection = select(balance, [swap], candidates_of=of_corrected)
    assert set(named(selection)) == {swap.key, ("plate_gain", "plate_2")}


def test_who_wants_to_stop_can(drawn, balance_of_scenes):
    def progress(stage, fraction):
        raise Cancelled

    with pytest.raises(Cancelled):
        select(balance_of_scenes(drawn(1)), [PlateGain("plate_1")], progress)
