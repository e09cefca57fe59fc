"""A plate tared while something stood on it, its empty samples set to zero afterwards."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.effect import Estimate, Fitted
from solver.diagnosis.causes.gross_cause import with_samples
from solver.diagnosis.causes.plate_readings import FORCES, MOMENTS, ZeroLevel

LEVEL, ASIDE_M = np.array([12.0, -180.0, 25.0]), np.array([0.1, 0.0, -0.15])


def tared_under_load(scene, k):
    """What stood aside of the middle is lacking in every loaded sample."""
    plate = scene.plates[k]
    loaded = plate.loads.carrying
    level = np.concatenate([LEVEL, np.cross(plate.centre_ground + ASIDE_M, LEVEL)])
    changed = with_samples(plate, plate.loads.wrench_ground + loaded[:, None] * level, loaded)
    return replace(scene, plates=(*scene.plates[:k], changed, *scene.plates[k + 1 :]))


def test_level_and_place_come_out_by_least_squares(scene, fitted):
    wrong = tared_under_load(scene, 1)
    candidate = ZeroLevel("plate_2")
    x, covariance = fitted(candidate, wrong, scene.measured_ground - wrong.measured_ground)
    found = candidate.estimates([wrong], Fitted((), (), x, covariance))
    assert [found[name].value for name in FORCES] == pytest.approx(LEVEL.tolist(), rel=0.01)
    about_middle = np.cross(ASIDE_M, LEVEL)
    assert [found[f"moment_{a}_Nm"].value for a in "xyz"] == pytest.approx(about_middle.tolist(), rel=0.02)
    assert candidate.is_notable(found)


def test_what_a_tared_plate_drifts_is_none(scene):
    small = {name: Estimate(20.0, 1.0) for name in FORCES} | {name: Estimate(1.0, 0.1) for name in MOMENTS}
    assert not ZeroLevel("plate_1").is_notable(small)


def test_a_plate_that_is_seen_empty_has_none(scene):
    assert all(plate.seen_empty for plate in scene.plates)
    assert ZeroLevel.candidates([scene]) == []
    wrong = tared_under_load(scene, 1)
    never = np.ones(len(wrong.plates[1].loads.carrying), dtype=bool)
    standing = with_samples(wrong.plates[1], wrong.plates[1].loads.wrench_ground, never)
    always = replace(wrong, plates=(wrong.plates[0], standing))
    assert [c.key for c in ZeroLevel.candidates([always])] == [("zero_level", "plate_2")]
