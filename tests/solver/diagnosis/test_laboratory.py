"""What every laboratory is off by: as columns, and within the parameters that are told."""

import numpy as np
import pytest

from solver.diagnosis.causes.catalogue import CAUSES, catalogue
from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.plate_readings import PlateBias
from solver.diagnosis.search.balance import laboratory_errors
from solver.diagnosis.search.selection import select
from solver.diagnosis.search.terms import with_the_usual
from tests.solver.diagnosis.conftest import trial_rows_of, with_demand


def test_columns_are_what_plates_off_by_a_standard_deviation_change(short_scene):
    """Of each plate: a force at its centre while loaded, a shifted centre of pressure, and so on."""
    rows = trial_rows_of(short_scene)
    H = laboratory_errors([rows])
    plate = short_scene.plates[0]
    newtons = PlateBias.about.usual_std
    wrench = np.zeros((short_scene.frames, 6))
    wrench[plate.loaded, 0] = newtons
    wrench[plate.loaded, 3:] = np.cross(plate.centre_ground, [newtons, 0.0, 0.0])
    wanted = -rows.reduce(wrench)
    nearest = np.abs(H - wanted[:, None]).max(axis=0).min()
    assert nearest < 0.5 * newtons  # an edge of the loaded stretch falls between two frames
    cosine = (H.T @ wanted) / np.linalg.norm(H, axis=0) / np.linalg.norm(wanted)
    assert cosine.max() > 0.98
    assert H.shape[1] == len(short_scene.plates) * (3 + 2)


def test_plates_are_shared_by_trials(short_scene, drawn):
    one, other = trial_rows_of(short_scene), trial_rows_of(drawn(3))
    alone = [laboratory_errors([rows]) for rows in (one, other)]
    np.testing.assert_allclose(laboratory_errors([one, other]), np.concatenate(alone))


def test_they_stay_below_what_anybody_acts_on(short_scene, balance_of_scenes):
    """A standard deviation of each, told as a cause, would not be named."""
    scenes = [short_scene]
    usual = [cause for cause in CAUSES if cause.about.usual_std]
    assert usual
    for cause in usual:
        std = cause.about.usual_std
        for candidate in cause.candidates(scenes):
            width = balance_of_scenes(short_scene).rows_of(candidate, ()).columns.shape[1]
            x = np.full(width, std / np.sqrt(width))
            assert not candidate.is_notable(
                candidate.estimates(scenes, Fitted((), (), x, np.zeros((width, width))))
            )


def test_the_whole_of_a_fault_is_told():
    """Its parameter and the usual part of it, against one Gaussian for both."""
    rng = np.random.default_rng(5)
    A, noise, p, u = rng.normal(size=(12, 2)), 0.7, np.array([3.0, 1.5]), 0.8
    data = rng.normal(size=12)
    both = np.concatenate([A, A], axis=1)
    prior = np.diag(np.concatenate([p, [u, u]]) ** -2.0)
    joint = np.linalg.inv(both.T @ both / noise**2 + prior)
    mean = joint @ both.T @ data / noise**2
    total = np.concatenate([np.eye(2), np.eye(2)], axis=1)
    x, covariance = with_the_usual(mean[:2], joint[:2, :2], p, u)
    np.testing.assert_allclose(x, total @ mean, rtol=1e-9)
    np.testing.assert_allclose(covariance, total @ joint @ total.T, rtol=1e-9)


@pytest.mark.parametrize("newtons", [2.5, 40.0])
def test_a_drifted_zero_is_no_fault_until_it_is_large(short_scene, drawn, balance_of_scenes, newtons):
    """Sideways on one plate; the usual one neither is named nor lets anything else be."""
    sound = drawn(7)
    plate = short_scene.plates[0]
    share = np.nan_to_num(plate.at_frames(plate.loads.carrying.astype(float)))
    force = np.array([0.0, 0.0, newtons])
    wrench = share[:, None] * np.concatenate([force, np.cross(plate.centre_ground, force)])
    balance = balance_of_scenes(with_demand(sound, sound.required_ground - wrench))
    named = [f.contender.term.candidate for f in select(balance, catalogue(balance.scenes)).found]
    assert [c.key for c in named] == ([("plate_bias", plate.target)] if newtons > 10 else [])
