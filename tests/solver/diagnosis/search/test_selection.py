"""Which causes are selected, beyond a gross error as well; and what reading the files has undone."""

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
from tests.solver.diagnosis.named_causes import Shaken, named

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
