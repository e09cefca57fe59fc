"""What a kept fit still knows of its solve."""

import pytest

from addb_viewer.trial_view.solver_steps import stages_of
from solver.fitting.fit_summary import MarkersAloneFigures
from tests.addb_viewer.fit_figures import of_trial

FIGURES = of_trial(
    seconds={"load": 0.5, "kinematics": 1.5, "dynamics": 2.0},
    marker_rms_m=0.008,
    kinematics_only=MarkersAloneFigures(0.007, 0.02, 0.01),
)


def test_stages_end_when_their_seconds_are_spent():
    steps = stages_of(FIGURES)
    assert [(s.stage, s.seconds, s.fraction) for s in steps] == [
        ("load", 0.5, 0.125),
        ("kinematics", 2.0, 0.5),
        ("dynamics", 4.0, 1.0),
    ]
    assert [dict(s.values) for s in steps] == [
        {},
        {"marker_rms_cm": pytest.approx(0.7)},
        {"marker_rms_cm": pytest.approx(0.8)},
    ]


def test_each_iteration_has_its_cost_and_a_share_of_the_stage():
    steps = [s for s in stages_of(FIGURES, (90.0, 40.0, 30.0, 29.9)) if "cost" in s.values]
    assert [s.values["cost"] for s in steps] == [90.0, 40.0, 30.0, 29.9]
    assert [s.seconds for s in steps] == [2.0, 2.5, 3.0, 3.5]
    assert steps[0].stage == "dynamics, where the search begins"
    assert steps[3].stage == "dynamics, iteration 3"
