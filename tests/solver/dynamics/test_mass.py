"""The subject's mass: from good forces, from forces with holes that nobody flagged, from several trials."""

from dataclasses import replace

import numpy as np
import pytest

from solver.dynamics.com_settings import ComSettings
from solver.dynamics.com_trajectory import ComData, MassEstimate, com_data
from solver.dynamics.mass import mass_from_forces, pool_masses
from tests.conftest import MARKERS_ALONE

SETTINGS = ComSettings()


def _without_force(data: ComData, where: np.ndarray, share: float = 1.0) -> ComData:
    """The plates missed that share of the force, and nobody says so."""
    return replace(
        data, force_ground=np.where(where[:, None], (1 - share) * data.force_ground, data.force_ground)
    )


def test_a_walk_on_the_plates(walker):
    found = mass_from_forces([walker(500)], SETTINGS)
    assert found is not None
    assert found.mass_kg == pytest.approx(81.0, rel=1e-3)


@pytest.mark.parametrize("share", [0.4, 1.0])
def test_steps_beside_the_plates_that_nobody_flagged(walker, unseen_steps, share):
    found = mass_from_forces([_without_force(walker(800), unseen_steps(800, 100.0), share)], SETTINGS)
    assert found is not None
    assert found.mass_kg == pytest.approx(81.0, rel=0.01)


def test_even_when_most_of_the_trial_is_off_the_plates(walker):
    elsewhere = np.ones(1000, dtype=bool)
    elsewhere[400:600] = False
    found = mass_from_forces([_without_force(walker(1000), elsewhere)], SETTINGS)
    assert found is not None
    assert found.mass_kg == pytest.approx(81.0, rel=0.01)


def test_a_force_that_belongs_to_somebody_else_does_not_count_either(walker, unseen_steps):
    doubled = _without_force(walker(800), unseen_steps(800, 100.0), -1.0)
    found = mass_from_forces([doubled], SETTINGS)
    assert found is not None
    assert found.mass_kg == pytest.approx(81.0, rel=0.01)


@pytest.mark.parametrize("slope_deg", [-20.0, -8.0, 0.0, 8.0, 15.0])
def test_forces_in_axes_of_a_sloping_belt_weigh_along_their_own_direction(walker, slope_deg):
    """Held against the markers' vertical in all three directions, 15° made 4 % more."""
    data = walker(800)
    c, s = np.cos(np.radians(slope_deg)), np.sin(np.radians(slope_deg))
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])
    found = mass_from_forces([replace(data, force_ground=data.force_ground @ turn.T)], SETTINGS)
    assert found is not None
    assert found.mass_kg == pytest.approx(81.0, rel=0.01)
    assert found.lean_deg == pytest.approx(abs(slope_deg), abs=0.5)


def test_nobody_on_the_plates(walker):
    data = walker(300)
    empty = replace(data, force_ground=np.zeros((300, 3)))
    unseen = replace(data, observed=np.zeros(300, dtype=bool))
    for trials in ([], [empty], [unseen], [walker(2)]):
        assert mass_from_forces(trials, SETTINGS) is None


def test_a_trial_without_forces_takes_no_part(walker):
    empty = replace(walker(300), observed=np.zeros(300, dtype=bool))
    assert mass_from_forces([walker(500), empty], SETTINGS) == mass_from_forces([walker(500)], SETTINGS)


def test_equal_trials_share_their_noise_but_not_the_plates_gain():
    one = MassEstimate(70.0, 1.12, 0.4)
    four = pool_masses([one] * 4, SETTINGS)
    assert four.mass_kg == pytest.approx(70.0)
    assert four.sampling_std_kg == pytest.approx(0.2)
    assert four.std_kg == pytest.approx(np.hypot(0.2, 70.0 * SETTINGS.plate_gain_std))


def test_trials_that_contradict_each_other_make_the_mean_unsure():
    estimates = [MassEstimate(m, 1.0, 0.1) for m in (60.0, 62.0, 64.0)]
    found = pool_masses(estimates, SETTINGS)
    assert found.mass_kg == pytest.approx(62.0)
    assert found.sampling_std_kg == pytest.approx(2.0 / np.sqrt(3), rel=0.01)  # standard error of the three


@pytest.mark.slow
@pytest.mark.real
@pytest.mark.parametrize(
    ("folder", "mass_kg"),
    [
        ("walk_rajagopal2015", 85.07),  # entered
        ("walk_gait2354_subject01", 72.6),  # entered
        ("sprint_overground_dorn2012_JA1_9ms", 75.93),  # entered; at 9 m/s
        ("overground_camargo2021_AB06", 77.6),  # what its quiet standing weighs
    ],
)
def test_recorded_masses_with_no_word_about_missed_steps(recorded_fit, folder, mass_kg):
    fit = recorded_fit(folder, MARKERS_ALONE)
    trials = [
        com_data(fit.skeleton, t.motion, t.contacts, replace(t.mask, counts=np.ones_like(t.mask.counts)))
        for t in fit.trials
    ]
    found = mass_from_forces(trials, SETTINGS)
    assert found is not None
    assert found.mass_kg == pytest.approx(mass_kg, rel=0.01)
