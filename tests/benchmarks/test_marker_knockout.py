"""The model hidden, on two short recordings; the whole table: `python -m benchmarks.marker_knockout`."""

import numpy as np
import pytest

from benchmarks.fit_agreement import marker_distances
from benchmarks.leg_joints import JOINTS
from benchmarks.marker_knockout import (
    agreement,
    agreement_on_model,
    judged_labels,
    markers_alone,
    nonsense,
    roc_area,
)
from benchmarks.recordings import recordings_of
from solver.capture.subject.subject import open_subject
from solver.fitting.pipeline import solve

UNSEEN = ("walk_gait2354_subject01", "exo_apo_gordon")  # no limit of solver.markers was chosen on these


@pytest.mark.slow
@pytest.mark.real
def test_angles_and_joint_centres_without_the_model(real_data):
    """Definitions of the ankle's and the pelvis' zero differ from model to model, and count in full here."""
    found = agreement(open_subject(real_data / "opencap_subject4"), "walking1")
    assert max(found.angle_rms_deg[a] for a in JOINTS) < 5
    assert max(found.anatomical_rms_deg[a] for a in JOINTS) < 5
    assert max(found.centre_rms_m[j] for j in JOINTS) < 0.025


@pytest.mark.real
def test_a_bone_pitched_otherwise_does_not_count_by_landmarks(real_data):
    """The model of this recording pitches its pelvis against the spines, and so its hips."""
    found = agreement(open_subject(real_data / "exo_apo_gordon"), "NE21")
    assert max(found.anatomical_rms_deg[a] for a in JOINTS) < 5
    assert found.anatomical_rms_deg["hip"] < 0.8 * found.angle_rms_deg["hip"]


@pytest.mark.slow
@pytest.mark.real
def test_angles_and_joint_centres_with_the_model_whose_marker_set_is_hidden(real_data):
    found = agreement_on_model(open_subject(real_data / "opencap_subject4"), "walking1")
    assert found.markers_used >= 45
    assert max(found.angle_rms_deg[a] for a in JOINTS) < 5
    assert max(found.centre_rms_m[j] for j in JOINTS) < 0.025


@pytest.mark.real
def test_confidence_tells_labels_on_the_wrong_trajectory(real_data):
    judged = []
    for folder in UNSEEN:
        subject = open_subject(real_data / folder)
        markers = recordings_of(subject, subject.trials[0].name)[0]
        judged += [row for seed in range(5) for row in judged_labels(markers, 0.2, seed)]
    assert roc_area(judged) >= 0.95


@pytest.mark.slow
@pytest.mark.real
@pytest.mark.parametrize(
    ("folder", "trial", "fewest"),
    [("anomalies/tiziana2019_lencioni", "trial", 29), ("overground_falisse_AdDB", "Gait_7", 61)],
)
def test_recordings_without_a_model_are_fitted(real_data, folder, trial, fewest):
    fit = solve(open_subject(real_data / folder), markers_alone(), trials=[trial])
    assert len(fit.groundwork.match.model) >= fewest
    assert np.sqrt(np.nanmean(marker_distances(fit) ** 2)) < 0.02  # Hicks et al. 2015


@pytest.mark.slow
@pytest.mark.real
def test_labels_that_mean_nothing(real_data):
    found = nonsense(open_subject(real_data / "opencap_subject4"), "walking1", seed=0)
    assert max(found.agreement.angle_rms_deg[a] for a in JOINTS) < 8
    assert max(found.agreement.anatomical_rms_deg[a] for a in JOINTS) < 8
    assert max(found.agreement.centre_rms_m[j] for j in JOINTS) < 0.04
    assert sum(right for _, right in found.judged) >= 0.9 * len(found.judged)


def test_area_of_sure_and_unsure():
    assert roc_area([(0.9, True), (0.8, True), (0.1, False)]) == 1.0
    assert roc_area([(0.5, True), (0.5, False)]) == 0.5
