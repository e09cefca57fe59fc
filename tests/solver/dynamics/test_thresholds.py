import pytest

from solver.dynamics.thresholds import Verdicts, verdicts

FIGURES = ("linear_BW", "angular_BWh", "marker_rms_m", "marker_max_m")


def test_figures_on_and_beyond_the_limits():
    assert verdicts(0.05, 0.01, 0.02, 0.04) == Verdicts(True, True, True, True, True)
    assert verdicts(0.051, 0.0101, 0.021, 0.041) == Verdicts(False, False, False, False, angular_paper=True)


@pytest.mark.parametrize("missing", FIGURES)
def test_a_missing_figure_has_no_verdict(missing):
    found = vars(verdicts(**(dict.fromkeys(FIGURES, 0.001) | {missing: None})))
    unknown = {key for key, verdict in found.items() if verdict is None}
    assert unknown == {key for key in found if key.startswith(missing.rpartition("_")[0])}
