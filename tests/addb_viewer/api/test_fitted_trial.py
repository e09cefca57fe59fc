"""The arrays of a fit are the solver's, with the names and units that belong to them."""

import shutil
from dataclasses import replace
from pathlib import Path

import ezc3d
import numpy as np
import pytest

from addb_viewer import Fit, Subject
from addb_viewer.api.fitted_trial import FittedTrial
from solver.capture.capture import Capture, Markers
from solver.common.errors import FitError
from solver.dynamics.dynamics import MassStd
from solver.export.trial_table import export_csv
from solver.fitting.fit_result import Groundwork, SettledFit, TrialFit
from solver.kinematics.marker_errors import MarkerErrors
from solver.kinematics.motion import Motion
from solver.skeleton.default_body import default_skeleton
from tests.made_std import made_std


@pytest.fixture
def fit(small_fit, tmp_path):
    return Fit(small_fit, tmp_path / "results")


def test_trials_by_name_and_in_order(fit):
    assert fit.trials == ("walk", "no/forces")
    assert [trial.name for trial in fit] == list(fit.trials)
    assert len(fit) == 2
    with pytest.raises(KeyError, match="no trial 'Walk'; nearest: walk"):
        fit["Walk"]


def test_arrays_have_the_solvers_values_names_and_units(fit, small_fit):
    walk, solved = fit["walk"], small_fit.trials[0]
    assert walk.times.tolist() == [0.25, 0.26, 0.27, 0.28]
    assert (walk.coordinates.names, walk.coordinates.units) == (("hip_flexion",), ("rad",))
    assert walk.coordinates["hip_flexion"].tolist() == [0.0, 0.1, 0.2, 0.3]
    np.testing.assert_allclose(walk.velocities["hip_flexion"], 10.0)
    assert (walk.velocities.unit, walk.accelerations.unit) == ("rad/s", "rad/s²")
    assert walk.torques.unit == "Nm"
    assert walk.powers.unit == "W"
    assert walk.residual_force["x"].tolist() == [3.0, 1000.0, 0.0, 0.0]
    assert walk.residual_moment["z"].tolist() == [0.0, 0.0, 0.0, 1.2]
    assert walk.used.tolist() == [True, False, True, True]
    assert walk.counts["thigh"].tolist() == [True, False, True, True]
    assert walk.forces.shape == (4, 1, 3)
    assert walk.markers.names == ("ASIS", "PSIS")
    assert np.isnan(walk.markers["PSIS"][3]).all()
    assert walk.marker_errors["ASIS"].tolist() == [0.003, 0.003, 0.021, 0.021]
    np.testing.assert_array_equal(walk.model_markers.values, solved.model_markers_ground)


def test_standard_deviations_are_those_of_the_same_quantity(small_fit, tmp_path):
    walk = replace(small_fit.trials[0], std=made_std(4, 1))
    walk = Fit(replace(small_fit, trials=(walk,)), tmp_path)["walk"]
    known = (walk.coordinates, walk.velocities, walk.accelerations, walk.torques, walk.powers, walk.com)
    assert [series.std[1, 0] for series in known] == [0.01, 0.02, 0.03, 0.04, 0.05, 0.001]
    assert np.isnan(walk.torques.std_of("hip_flexion")).tolist() == [True, False, False, False]
    assert walk.residual_force.std is walk.marker_errors.std is None
    names = walk.table.names
    assert names[-8:] == (
        "hip_flexion_std_rad", "hip_flexion_std_rad_s", "hip_flexion_std_rad_s2", "hip_flexion_moment_std_Nm",
        "hip_flexion_power_std_W", "com_x_std_m", "com_y_std_m", "com_z_std_m",
    )  # fmt: skip


def test_without_them_there_are_none(fit):
    assert fit["walk"].torques.std is None
    assert not [name for name in fit["walk"].table.names if "_std_" in name]


def test_why_forces_do_not_count(fit):
    assert list(fit["walk"].left_out) == [
        {"start": 1, "end": 2, "foot": "thigh", "reason": "manualReview", "said_by": "review.json"}
    ]


def test_without_forces_what_rests_on_them_is_empty_and_the_rest_is_there(fit):
    trial = fit["no/forces"]
    assert not trial.used.any()
    assert trial.coordinates.shape == (4, 1)
    assert trial.feet == ()
    for empty in (trial.torques, trial.powers, trial.residual_force, trial.forces, trial.com, trial.counts):
        assert (empty.names, empty.shape) == ((), (4, 0))
    assert len(trial.left_out) == 0


def test_body_poses_are_those_of_the_skeleton(fit):
    walk = fit["walk"]
    assert walk.bodies == ("thigh",)
    angle = walk.coordinates["hip_flexion"][3]
    R = walk.body_rotations[3, 0]
    np.testing.assert_allclose(R @ [1, 0, 0], [np.cos(angle), np.sin(angle), 0], atol=1e-12)
    assert walk.body_positions["thigh"][:, 1].tolist() == [0.9] * 4


def test_tables_have_the_columns_of_the_exported_ones(fit, small_fit, tmp_path):
    exported = next(path for path in export_csv(small_fit, tmp_path) if path.name == "walk.csv")
    head = exported.read_text().splitlines()[0].replace('"', "").split(",")
    assert list(fit["walk"].table.names) == head
    whole = fit.table
    assert len(whole) == 8
    assert whole["trial"].tolist() == ["walk"] * 4 + ["no/forces"] * 4
    assert np.isnan(whole["residual_force_x_N"][4:]).all()
    assert not whole["used"][4:].any()


def test_figures_and_summary_are_those_of_the_command_line(fit, small_fit):
    assert fit.figures["trials"][0]["linear_residual"]["rms_N"] == pytest.approx(np.sqrt((9 + 16 + 144) / 3))
    assert "height read from the model" in fit.notes
    text = str(fit)
    assert text.startswith("100.0 kg (98.5 kg entered), 2.00 m; 1 bodies, 1 degrees of freedom")
    assert "3 of 4" in text
    assert fit.bodies["mass_kg"].tolist() == [100.0]
    assert np.isnan([fit.mass_std_kg, fit.bodies["mass_std_kg"][0]]).all()


def test_masses_have_bands(small_fit, tmp_path):
    off = MassStd(1.5, np.array([1.2]), np.array([4.0]))
    settled = SettledFit(100.0, {}, np.zeros(0), (), {}, {}, mass_std=off)
    solved = replace(small_fit, groundwork=Groundwork(small_fit.skeleton, None, (), settled=settled))
    fit = Fit(solved, tmp_path)
    assert str(fit).startswith("100.0 ± 2.9 kg (98.5 kg entered)")
    assert fit.figures["subject"]["mass_std_kg"] == fit.mass_std_kg == 1.5
    assert (fit.bodies["mass_std_kg"][0], fit.bodies["mass_std_untold_kg"][0]) == (1.2, 4.0)


def test_a_covariance_of_what_is_not_there_says_so(fit):
    with pytest.raises(KeyError, match="no trial 'run'"):
        fit.torque_covariance("run", 0)
    with pytest.raises(KeyError, match="no coordinate 'hip_flex'; nearest: hip_flexion"):
        fit.torque_covariance("walk", 0, ["hip_flex"])
    with pytest.raises(FitError, match="has frames 0 to 3; frame 4 is none"):
        fit.torque_covariance("walk", 4)
    with pytest.raises(FitError, match="its torques have no bands"):
        fit.torque_covariance("walk", 0)


def test_export_writes_into_the_results_or_another_folder(fit, tmp_path):
    (first, *_) = fit.export("csv")
    assert first == tmp_path / "results" / "csv" / "walk.csv"
    assert fit.export("csv", tmp_path / "other")[0] == tmp_path / "other" / "csv" / "walk.csv"
    with pytest.raises(ValueError, match="no format 'xlsx'; choose opensim, b3d, csv"):
        fit.export("xlsx")


def test_what_a_format_cannot_hold_is_a_warning(fit, tmp_path):
    """MuJoCo has polynomials of the fourth degree only for joints that follow another."""
    with pytest.warns(UserWarning, match="polynomials of the fourth degree"):
        fit.export("mujoco", tmp_path)


def test_type_information_lies_beside_the_packages():
    import addb_viewer
    import annotations
    import solver

    for package in (addb_viewer, annotations, solver):
        assert Path(package.__file__).with_name("py.typed").is_file()


def test_analog_channels_are_read_from_the_recording_when_asked_for(real_data, small_fit, fit, tmp_path):
    file = real_data / "wild" / "unipd_bts" / "2012_10_17" / "Walking1.c3d"
    trial = small_fit.trials[0]
    recorded = replace(trial, capture=replace(trial.capture, files=(file,)))
    analog = Fit(replace(small_fit, trials=(recorded,)), tmp_path)["walk"].analog
    expected = ezc3d.c3d(str(file))["data"]["analogs"][0]
    assert (analog.shape, analog.units[0]) == ((4896, 15), "V")
    np.testing.assert_array_equal(analog["Right Soleus"], expected[12 + analog.names.index("Right Soleus")])
    assert analog.times[1020] == pytest.approx(1.0)
    assert fit["walk"].analog.names == ()
    shutil.copytree(file.parent, tmp_path / "BTS")
    again = Subject.open(tmp_path / "BTS").analog("Walking1")
    np.testing.assert_array_equal(again.values, analog.values)


def test_angles_by_conventions_are_degrees_with_sides():
    body = default_skeleton()
    q = np.random.default_rng(7).uniform(-0.3, 0.3, (4, len(body.dofs)))
    markers, nothing = Markers((), np.zeros((4, 0, 3)), 100.0), np.zeros((4, 0))
    errors = MarkerErrors((), nothing)
    trial = TrialFit(Capture("walk", markers), Motion(body.dofs, q, 100.0), errors, markers.positions_ground)
    trial = FittedTrial(trial, body)
    cgm = trial.angles("cgm")
    assert cgm.unit == "deg"
    np.testing.assert_allclose(
        cgm["knee_flexion_r"], np.degrees(trial.coordinates["knee_angle_r"]), atol=1e-9
    )
    assert trial.angles("isb").names[-1] == "elbow_pronation_l"
    with pytest.raises(KeyError, match="no convention 'pig'; there are: cgm, isb"):
        trial.angles("pig")


def test_predicted_forces_are_those_of_the_dynamics_with_their_own_standard_deviation(small_fit, tmp_path):
    trial = small_fit.trials[0]
    assert trial.dynamics is not None
    predicted, off = np.zeros((4, 1, 6)), np.full((4, 1, 3), np.nan)
    predicted[1, 0, 1], off[1, 0] = 700.0, (10.0, 20.0, 5.0)
    trial = replace(
        trial,
        dynamics=replace(trial.dynamics, wrench_predicted_ground=predicted),
        std=replace(made_std(4, 1), predicted_force_ground=off),
    )
    walk = Fit(replace(small_fit, trials=(trial,)), tmp_path)["walk"]
    assert walk.predicted_forces["thigh"][1].tolist() == [0.0, 700.0, 0.0]
    assert walk.predicted_forces.std_of("thigh")[1].tolist() == [10.0, 20.0, 5.0]
    assert not Fit(small_fit, tmp_path)["walk"].predicted_forces.values.any()


def test_no_stance_is_left_out_of_a_fit_that_tells_no_bands(fit):
    assert len(fit.stance_influence["trial"]) == 0
