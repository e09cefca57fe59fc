"""Forces as arrows."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.report.arrows import arrows_of
from addb_viewer.trial_view.palette import CAUSE, GREEN, RESIDUAL
from addb_viewer.trial_view.replay import RequiredForce


@pytest.fixture
def replay(recording):
    return recording.trials[0].replay


def test_measured_forces_have_the_colour_of_their_foot(replay):
    first = next(arrow for arrow in arrows_of(replay, None) if arrow.label == "plate 1")
    assert first.color == GREEN
    loaded = np.isfinite(first.force[:, 1])
    plate = replay.plates[0]
    np.testing.assert_array_equal(loaded, plate.force[:, 1] > 100)
    np.testing.assert_array_equal(first.force[loaded], plate.force[loaded])
    np.testing.assert_array_equal(first.start[loaded], plate.cop[loaded])


def test_the_residual_is_drawn_where_it_counts(replay):
    (residual,) = [a for a in arrows_of(replay, None) if a.color == RESIDUAL]
    np.testing.assert_array_equal(np.isfinite(residual.force[:, 0]), replay.residual.used)
    assert np.isfinite(residual.start[0]).all()


def test_what_the_motion_demands_is_told_apart_from_what_was_measured(replay):
    force = np.full((40, 3), np.nan)
    force[30:36] = [0.0, 300.0, 0.0]
    required = RequiredForce("calcn_r", force, np.zeros((40, 3)))
    (arrow,) = [a for a in arrows_of(replace(replay, required=(required,)), None) if a.is_required]
    np.testing.assert_array_equal(np.isfinite(arrow.force[:, 1]), ~replay.residual.used)


def test_a_named_force_is_there_while_it_acts(replay, diagnosis):
    contact = {
        "id": "external_contact",
        "target": "pelvis",
        "parameters": {
            f"force_{a}_N": {"value": v, "std": 1.0} for a, v in zip("xyz", (0, 50, 0), strict=True)
        },
        "frames": [[5, 9]],
        "trial": "walk",
        "time_histories": [],
    }
    (arrow,) = [a for a in arrows_of(replay, {**diagnosis, "effects": [contact]}) if a.color == CAUSE]
    assert np.flatnonzero(np.isfinite(arrow.force[:, 1])).tolist() == [5, 6, 7, 8]
    np.testing.assert_allclose(arrow.force[5], [0, 50, 0])
