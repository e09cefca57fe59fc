import numpy as np
import pytest

from solver.simulate.faults import recorded
from solver.simulate.faults.drawing import NoPlaceError
from solver.simulate.faults.real import EMULATED, hide_emulated, with_external


def total(capture):
    return sum(np.hstack([p.force_ground, p.moment_ground]) for p in capture.plates)


def test_the_plates_lose_just_the_external_wrench(recording):
    trial = recording.trials[0]
    times = trial.plates[0].times
    force = np.sin(2 * np.pi * times)[:, None] * np.array([5.0, 20.0, -4.0])
    point = np.array([0.1, 1.1, 0.05]) + 0.1 * np.cos(times)[:, None] * np.ones(3)
    changed = with_external(trial, force, point)
    expected = -np.hstack([force, np.cross(point, force)])
    np.testing.assert_allclose(total(changed) - total(trial), expected, atol=1e-8)


def test_centres_of_pressure_move_alike_and_stay_centres(recording):
    trial = recording.trials[0]
    n = trial.plates[0].samples
    changed = with_external(trial, np.tile([4.0, 30.0, 0.0], (n, 1)), np.tile([0.0, 1.0, 0.1], (n, 1)))
    moved = [
        after.cop_ground - before.cop_ground
        for after, before in zip(changed.plates, trial.plates, strict=True)
    ]
    both = np.all([recorded.loaded(p) for p in trial.plates], axis=0)
    assert both.sum() > 50
    np.testing.assert_allclose(moved[0][both], moved[1][both], atol=1e-12)
    for plate, before in zip(changed.plates, trial.plates, strict=True):
        on = recorded.loaded(before)
        about = recorded.free_moment(plate)[on]
        np.testing.assert_allclose(about[:, [0, 2]], recorded.free_moment(before)[on][:, [0, 2]], atol=1e-9)


def test_nothing_can_pull_a_person_in_the_air(recording):
    trial = recording.trials[0]
    flying = type(trial)(
        trial.name, trial.markers, tuple(recorded.blanked(p, slice(400, 600)) for p in trial.plates)
    )
    n = trial.plates[0].samples
    with pytest.raises(NoPlaceError, match="nobody on the plates"):
        with_external(flying, np.tile([0.0, 50.0, 0.0], (n, 1)), np.zeros((n, 3)))


@pytest.mark.parametrize("id", list(EMULATED))
def test_each_effect_changes_the_mean_force_by_its_parameters(recording, id):
    changed, hidden = hide_emulated(recording, id, 1.0, np.random.default_rng(3))
    difference = (total(changed.trials[0]) - total(recording.trials[0]))[:, :3]
    p = hidden.parameters
    if id == "body_weight_support":
        np.testing.assert_allclose(difference.mean(axis=0), [0, -p["force_N"], 0], atol=1e-9)
    if id == "carried_mass":
        assert difference[:, 1].mean() == pytest.approx(p["mass_kg"] * 9.81, rel=0.1)
    if id == "external_contact":
        ((first, last),) = hidden.frames
        stated = -np.array([p[f"force_{a}_N"] for a in "xyz"])
        np.testing.assert_allclose(difference[first * 10 : last * 10].mean(axis=0), stated, atol=0.5)
