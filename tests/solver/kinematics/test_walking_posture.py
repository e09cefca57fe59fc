import numpy as np
import pytest

from solver.kinematics.motion import Motion
from solver.kinematics.settings import KinematicsSettings
from solver.kinematics.upright_pelvis import posture_notes

SETTINGS = KinematicsSettings()
DOFS = ("pelvis_tilt", "hip_flexion_r", "hip_flexion_l", "lumbar_extension")


def moving(tilt=0.0, lumbar=-5.0, turns=-1.0, seconds=2.0):
    t = np.arange(round(100 * seconds)) / 100.0
    swing = 22.0 * np.sin(2 * np.pi * t)
    q = np.stack([np.full_like(t, tilt), 10 + swing, 10 + turns * swing, np.full_like(t, lumbar)], axis=1)
    return Motion(DOFS, np.radians(q), 100.0, 0.0)


@pytest.mark.parametrize(("tilt", "lumbar"), [(4.7, -18.9), (-1.7, -3.4), (-20.0, 5.0)])
def test_postures_that_people_walk_in_are_no_warning(tilt, lumbar):
    assert posture_notes(moving(tilt, lumbar)) == ()


def test_a_walk_that_leans_back_and_bends_is_a_warning_with_its_figures():
    tilted, bent = posture_notes(moving(21.0, -36.0))
    assert "mean pelvis tilt is 21°" in tilted
    assert "mean lumbar extension is -36°" in bent


def test_a_squat_may_bend_and_a_cut_out_step_is_too_short_to_tell():
    assert posture_notes(moving(-40.0, -50.0, turns=1.0)) == ()
    assert posture_notes(moving(-40.0, -50.0, seconds=0.5)) == ()
