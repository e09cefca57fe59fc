import pytest

from solver.dynamics.thresholds import Figures, Thresholds, verdicts


def test_figures_on_and_beyond_the_limits():
    on = Figures(linear_BW=0.05, angular_BWh=0.01, marker_rms_m=0.02, marker_max_m=0.04)
    assert set(verdicts(on, Thresholds()).values()) == {True}
    beyond = Figures(linear_BW=0.051, angular_BWh=0.0101, marker_rms_m=0.021, marker_max_m=0.041)
    assert verdicts(beyond, Thresholds()) == {
        "linear": False,
        "angular": False,
        "marker_rms": False,
        "marker_max": False,
        "angular_paper": True,
    }


@pytest.mark.parametrize("missing", ["linear", "angular", "marker_rms", "marker_max"])
def test_a_missing_figure_has_no_verdict(missing):
    values = {"linear_BW": 0.01, "angular_BWh": 0.001, "marker_rms_m": 0.01, "marker_max_m": 0.01}
    name = next(key for key in values if key.startswith(missing))
    found = verdicts(Figures(**(values | {name: None})), Thresholds())
    assert found[missing] is None
    assert [key for key, verdict in found.items() if verdict is None] == [
        key for key in found if key.startswith(missing)
    ]
