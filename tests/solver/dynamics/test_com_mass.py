"""The mass of one trial: its uncertainty against repeated noise, and how it is weighed and worded."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from solver.dynamics.com_settings import ComSettings
from solver.dynamics.com_trajectory import MassEstimate, MassPrior, disagreement, fit_com_trajectory

SETTINGS = ComSettings()


def _lasting_errors(shape: tuple[int, ...], rate: float, lasting_s: float, rng) -> np.ndarray:
    """Errors of unit size whose correlation fades over that time (Ornstein-Uhlenbeck)."""
    keep = np.exp(-1 / (rate * lasting_s))
    white = rng.normal(size=shape) * np.sqrt(1 - keep**2)
    white[0] /= np.sqrt(1 - keep**2)
    return lfilter([1.0], [1.0, -keep], white, axis=0)


@pytest.mark.slow
@pytest.mark.parametrize("lasting_s", [0.02, 0.1, 0.3, 1.0])
@pytest.mark.parametrize("seconds", [1.2, 2.5, 8.0])
def test_the_sampling_deviation_covers_repeated_noise(walker, lasting_s, seconds):
    """Centre-of-mass errors of 5 mm that last from two frames to a second: rarely beyond two deviations."""
    rng = np.random.default_rng(7)
    data = walker(round(100 * seconds))
    beyond = []
    for _ in range(40):
        noise = 0.005 * _lasting_errors(data.com_ground.shape, data.rate, lasting_s, rng)
        mass = fit_com_trajectory(replace(data, com_ground=data.com_ground + noise), SETTINGS).mass
        assert mass is not None
        beyond.append((mass.mass_kg - 81.0) / mass.sampling_std_kg)
    assert np.mean(np.abs(beyond) > 2) <= 0.1
    assert np.std(beyond) > 0.1  # and is no mere excuse: within ten times what it has to cover


def test_the_whole_deviation_adds_the_plates_gain(walker):
    mass = fit_com_trajectory(walker(300), SETTINGS).mass
    assert mass is not None
    gain = SETTINGS.plate_gain_std * mass.mass_kg
    assert mass.std_kg == pytest.approx(np.hypot(mass.sampling_std_kg, gain))


def test_longer_trials_tell_the_mass_better(walker):
    stds = [fit_com_trajectory(walker(frames), SETTINGS).mass.sampling_std_kg for frames in (100, 400, 1600)]
    assert stds[0] > 1.5 * stds[1] > 2 * stds[2]


def test_a_prior_as_sure_as_the_data_meets_it_half_way(walker):
    free = fit_com_trajectory(walker(400), SETTINGS).mass
    assert free is not None
    shy = 0.97 * free.mass_kg
    as_sure = MassPrior(shy, free.std_kg * 0.97**2)  # equal in the inverse mass
    both = fit_com_trajectory(walker(400), SETTINGS, as_sure).mass
    assert both is not None
    assert 1 / both.mass_kg == pytest.approx((1 / free.mass_kg + 1 / shy) / 2, rel=1e-3)
    same_scale = (both.mass_kg / free.mass_kg) ** 2  # dm = m² dμ
    assert both.std_kg == pytest.approx(same_scale * free.std_kg / np.sqrt(2), rel=1e-3)


@pytest.mark.parametrize(("prior_std", "near"), [(1e-4, 60.0), (1e4, 81.0)])
def test_the_surer_side_wins(walker, prior_std, near):
    mass = fit_com_trajectory(walker(400), SETTINGS, MassPrior(60.0, prior_std)).mass
    assert mass is not None
    assert mass.mass_kg == pytest.approx(near, rel=1e-3)


def test_without_forces_the_prior_remains(walker):
    blind = replace(walker(100), observed=np.zeros(100, dtype=bool))
    mass = fit_com_trajectory(blind, SETTINGS, MassPrior(66.0, 3.0)).mass
    assert mass is not None
    assert (mass.mass_kg, mass.std_kg) == pytest.approx((66.0, 3.0))


def test_masses_that_agree_are_not_worth_a_word():
    assert disagreement(MassEstimate(81.6, 1.2, 0.2), 80.5, SETTINGS) is None


@pytest.mark.parametrize(
    ("told", "how", "suspect"), [(63.1, "4.1 kg more", "loads"), (54.0, "5.0 kg less", "steps")]
)
def test_a_disagreement_names_both_masses_and_what_to_look_at(told, how, suspect):
    warning = disagreement(MassEstimate(told, 1.0, 0.2), 59.0, SETTINGS)
    assert warning is not None
    for part in (f"{told} ± 2.0 kg", "59.0 kg", how, suspect):
        assert part in warning
