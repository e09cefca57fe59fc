"""The figures of a fit against sums done by hand."""

import json
from dataclasses import replace

import numpy as np
import pytest

from solver.common.notes import Kind, noted
from solver.common.typed_json import plain
from solver.dynamics.thresholds import Thresholds, verdicts
from solver.fitting.summary import HELD_OUT_DUE, all_notes, summary
from solver.kinematics.label_faults.fault import MASKED, LabelFault
from solver.kinematics.marker_errors import MarkerErrors
from tests.made_std import made_std

BODY_WEIGHT = 980.665  # [N] of 100 kg


def trial_figures(fit, trial=0, **changes):
    return plain(summary(replace(fit, **changes)))["trials"][trial]


def test_residuals_are_those_of_the_used_frames(small_fit):
    rms, mean = np.sqrt((9 + 16 + 144) / 3), 19 / 3  # of norms 3, 4 and 12
    figures = trial_figures(small_fit)
    assert figures["linear_residual"] == pytest.approx(
        {"rms_N": rms, "mean_norm_N": mean, "rms_BW": rms / BODY_WEIGHT}
    )
    assert figures["angular_residual"] == pytest.approx(
        {"rms_Nm": rms / 10, "mean_norm_Nm": mean / 10, "rms_BWh": rms / 10 / (2 * BODY_WEIGHT)}
    )
    assert figures["linear_residual_raw"]["rms_N"] == pytest.approx(2 * rms)
    assert figures["angular_residual_raw"]["rms_Nm"] == pytest.approx(2 * rms / 10)


def test_frames_used_and_where_the_mask_came_from(small_fit):
    figures = trial_figures(small_fit)
    assert figures["frames"] == 4
    assert figures["frames_with_force_used"] == 3
    assert figures["frames_used_ranges"] == [[0, 1], [2, 4]]
    assert figures["mask_source"] == "review.json"
    assert figures["rate_hz"] == 100.0
    assert figures["seconds"] == {"load": 0.5, "kinematics": 2.0, "dynamics": 0.25}


def test_how_far_torques_may_be_off_is_the_median_of_the_frames_used(small_fit):
    bent = replace(small_fit.skeleton.joints[0], parent=0)  # what places the root has no torque of its own
    std = made_std(4, 1)
    std.torque[:, 0] = [1.0, 50.0, 3.0, 4.0]
    changes = {"trials": (replace(small_fit.trials[0], std=std),)}
    joint = replace(small_fit.skeleton, joints=(bent,))
    assert trial_figures(small_fit, **changes, skeleton=joint)["torque_std_Nm"] == {"hip_flexion": 3.0}
    assert trial_figures(small_fit, **changes)["torque_std_Nm"] == {}
    assert trial_figures(small_fit, skeleton=joint)["torque_std_Nm"] == {}


def test_which_torques_rest_on_an_predicted_wrench(small_fit):
    predicted = np.array([[True], [False], [True], [True]])
    dynamics = replace(small_fit.trials[0].dynamics, wrench_is_predicted=predicted)
    trials = (replace(small_fit.trials[0], dynamics=dynamics),)
    assert trial_figures(small_fit, trials=trials)["torques_predicted_ranges"] == [[0, 1], [2, 4]]
    assert trial_figures(small_fit)["torques_predicted_ranges"] == []


def test_labels_that_were_repaired(small_fit):
    assert trial_figures(small_fit)["label_faults"] == []
    fault = LabelFault(("A",), 1, 3, MASKED, 2, 0.08, None, 3, onto="B")
    (told,) = trial_figures(small_fit, trials=(replace(small_fit.trials[0], label_faults=(fault,)),))[
        "label_faults"
    ]
    assert told == {
        "labels": ["A"],
        "frames": [1, 3],
        "done": "masked",
        "frames_with_markers": 2,
        "onto": "B",
        "off_m": 0.08,
        "repaired_off_m": None,
        "neighbours": 3,
        "accepted": False,
    }


def test_blocks_that_wait_for_their_prediction_are_noted(small_fit):
    assert HELD_OUT_DUE in all_notes(replace(small_fit, held_out_due=True))
    assert HELD_OUT_DUE not in all_notes(small_fit)


def test_marker_errors(small_fit):
    figures = trial_figures(small_fit)
    assert figures["marker_rms_m"] == pytest.approx(0.015)
    assert figures["marker_rms_frame_mean_m"] == pytest.approx(0.012)
    assert figures["marker_max_m"] == pytest.approx(0.021)


def test_without_forces_there_are_no_residuals_and_no_verdicts_on_them(small_fit):
    figures = trial_figures(small_fit, trial=1)
    assert figures["linear_residual"] is None
    assert figures["angular_residual_raw"] is None
    assert figures["frames_with_force_used"] == 0
    assert figures["frames_used_ranges"] == []
    assert figures["mask_source"] == "none"
    assert figures["hicks"] == vars(verdicts(None, None, 0.015, 0.021))


@pytest.mark.parametrize(
    ("mass_kg", "height_m", "expected"),
    [
        # RMS 7.506 N and 0.7506 N·m: bounds at 15.31 kg (linear) and 7.654 kg·m or 0.7654 kg·m (angular)
        (16.0, 1.0, {"linear": True, "angular": True, "angular_paper": True}),
        (15.0, 1.0, {"linear": False, "angular": True, "angular_paper": True}),
        (7.0, 1.0, {"linear": False, "angular": False, "angular_paper": True}),
        (7.0, 0.1, {"linear": False, "angular": False, "angular_paper": False}),
        (100.0, 0.07, {"linear": True, "angular": False, "angular_paper": True}),
    ],
)
def test_hicks_verdicts_follow_mass_and_height(small_fit, mass_kg, height_m, expected):
    verdicts = trial_figures(small_fit, mass_kg=mass_kg, height_m=height_m)["hicks"]
    assert {name: verdicts[name] for name in expected} == expected


def test_a_trial_whose_markers_were_never_seen_has_no_marker_figures(small_fit):
    trial = replace(small_fit.trials[0], marker_errors=MarkerErrors(("ASIS",), np.full((4, 1), np.nan)))
    figures = trial_figures(small_fit, trials=(trial,))
    assert figures["marker_rms_m"] is figures["marker_max_m"] is figures["hicks"]["marker_rms"] is None


def test_an_unknown_height_leaves_body_weight_heights_out_and_the_json_strict(small_fit):
    figures = plain(summary(replace(small_fit, height_m=float("nan"))))
    assert figures["subject"] == {
        "mass_kg": 100.0,
        "mass_entered_kg": 98.5,
        "height_m": None,
        "mass_std_kg": None,
    }
    assert figures["trials"][0]["angular_residual"]["rms_BWh"] is None
    json.dumps(figures, allow_nan=False)


def test_notes_name_their_trial_and_come_once(small_fit):
    repeated = replace(small_fit, notes=noted(Kind.OTHER, "walk: plate 1 was not tared", "mass from forces"))
    assert all_notes(repeated) == (
        "height read from the model",
        "walk: plate 1 was not tared",
        "mass from forces",
        "no/forces: no forces found",
    )


def test_the_contract_has_all_its_fields(small_fit):
    figures = plain(summary(small_fit, files=["fit.json"]))
    assert set(figures) == {"subject", "model", "trials", "files", "notes", "unused"}
    assert figures["model"] == {"bodies": 1, "dofs": 1}
    assert figures["files"] == ["fit.json"]
    assert set(figures["trials"][0]) == {
        "name", "frames", "rate_hz", "frames_with_force_used", "frames_used_ranges", "mask_source",
        "marker_rms_m", "marker_rms_frame_mean_m", "marker_max_m",
        "linear_residual", "angular_residual", "linear_residual_raw", "angular_residual_raw",
        "hicks", "held_out", "kinematics_only", "change", "seconds", "torques_predicted_ranges",
        "label_faults", "held_out_layouts", "forces_predicted", "stored", "frames_without_pose_ranges",
        "coordinates_guessed_ranges", "marker_max_label", "verdict", "torque_std_Nm",
    }  # fmt: skip


def test_thresholds_are_those_of_hicks_2015():
    assert Thresholds() == Thresholds(0.05, 0.01, 0.02, 0.04, 0.1)
