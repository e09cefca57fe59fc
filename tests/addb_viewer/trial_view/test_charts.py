from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.trial_view.charts import charts_of


def test_a_fitted_trial_has_four_charts_with_units(make_replay):
    charts = charts_of(make_replay())
    assert [c.heading for c in charts] == [
        "Marker error [cm]", "Vertical force [N]", "Residual force [N]", "Residual moment [N·m]"
    ]  # fmt: skip
    errors, forces, residual, moment = charts
    np.testing.assert_allclose(errors.lines[0].values, 3.0)  # every model marker is 3 cm off
    np.testing.assert_allclose(errors.lines[1].values, 3.0)
    assert [line.label for line in forces.lines] == ["right", "left"]
    assert residual.lines[0].values[-1] == pytest.approx(100.0)
    assert residual.lines[1].values[0] == 35.0
    assert moment.lines[1].values[0] == 12.0
    np.testing.assert_array_equal(residual.shaded, np.arange(200) < 20)


def test_charts_without_data_are_left_out(make_replay):
    assert [c.title for c in charts_of(make_replay(fitted=False))] == ["Vertical force"]
    assert [c.title for c in charts_of(make_replay(fitted=False, plates=0))] == []
    assert "Vertical force" not in [c.title for c in charts_of(make_replay(plates=0))]


def test_unknown_stretches_are_shaded(make_replay):
    replay = make_replay()
    for plate in replay.plates:
        plate.force[100:] = np.nan
    forces = charts_of(replay)[1]
    np.testing.assert_array_equal(forces.shaded, np.arange(200) >= 100)


def test_the_solve_that_is_compared_with_lies_behind(make_replay):
    replay = make_replay()
    with_other = charts_of(replay, replace(replay))
    for c in with_other:
        assert (c.lines[0].label == "before") is (c.title != "Vertical force"), c.title
    assert len(with_other) == 4
