"""Whose a model is, and how much larger the fitted body is."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from solver.capture.capture import Subject
from solver.diagnosis.causes.capture_scale import OWN_MODEL_STD, PRIOR_STD, CaptureScale
from solver.diagnosis.scenes import size_against_own_model
from solver.fitting.fit import Fit
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.osim_writer import write_skeleton
from solver.skeleton.scaling import scaled

MASS_KG = 71.0


@pytest.fixture(scope="module")
def model():
    return default_skeleton(mass_kg=MASS_KG, height_m=1.75)


@pytest.fixture
def fit_of(model, tmp_path):
    """A fit whose body is the model's, each body larger by a factor of its own."""
    path = tmp_path / "own.osim"
    write_skeleton(model, path)

    def made(factors: np.ndarray, mass_kg: float | None = MASS_KG, with_model: bool = True) -> Fit:
        subject = Subject(tmp_path, (), model=path if with_model else None, mass_kg=mass_kg)
        return Fit(subject, scaled(model, np.repeat(factors[:, None], 3, axis=1)), (), MASS_KG, 1.75)

    return made


@pytest.fixture(scope="module")
def bodies(model):
    return len(model.bodies)


@pytest.mark.parametrize("factor", [0.985, 1.0, 1.02])
def test_one_factor_of_all_segments_is_the_size(fit_of, bodies, factor):
    assert size_against_own_model(fit_of(np.full(bodies, factor))) == pytest.approx(np.log(factor), abs=1e-6)


def test_a_model_of_other_proportions_is_nobodys(fit_of, bodies):
    factors = 1 + 0.03 * np.random.default_rng(1).choice([-1, 1], bodies)
    assert size_against_own_model(fit_of(factors)) is None


@pytest.mark.parametrize("mass_kg", [0.98 * MASS_KG, None])
def test_a_model_of_another_mass_is_nobodys(fit_of, bodies, mass_kg):
    assert size_against_own_model(fit_of(np.full(bodies, 1.02), mass_kg=mass_kg)) is None


def test_no_model_says_nothing(fit_of, bodies):
    assert size_against_own_model(fit_of(np.full(bodies, 1.02), with_model=False)) is None


def test_what_segments_scatter_by_is_no_obstacle(fit_of, bodies):
    factors = 1.01 * (1 + 0.002 * np.random.default_rng(2).standard_normal(bodies))
    found = size_against_own_model(fit_of(factors))
    assert found == pytest.approx(np.log(1.01), abs=0.003)


def test_a_size_is_evidence_as_two_gaussians_have_it(model):
    """For the scale against none: densities of the measured size under both."""
    for size in (-0.012, 0.0, 0.008):
        with_scale = norm.logpdf(size, 0, np.hypot(OWN_MODEL_STD, PRIOR_STD))
        expected = with_scale - norm.logpdf(size, 0, OWN_MODEL_STD)
        assert CaptureScale("all", size).seen_elsewhere == pytest.approx(expected)
    assert replace(CaptureScale("all", 0.01), log_size=None).seen_elsewhere == 0
