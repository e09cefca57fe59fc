"""Nobody entered a mass, and steps beside the plates hide it from the forces at first."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.fitting.pipeline import resolve, solve
from solver.fitting.settings import settings_for

BOUND = 0.05  # of body weight: the dataset paper's, on the residual force


def test_forces_weigh_the_person_once_frames_that_miss_some_are_left_out(real_data):
    """With 80 kg, what people so tall weigh, the residual was 0.08 of body weight; the forces carry 69."""
    folder = real_data / "anomalies" / "tiziana2019_lencioni"
    settings = settings_for(folder)
    settings = replace(settings, trajectory=replace(settings.trajectory, held_out=False))
    fit = solve(open_subject(folder), settings)
    assert any(note.startswith("mass not given; ") and "from the forces" in note for note in fit.notes)
    (trial,) = [t for t in fit.trials if t.dynamics is not None]
    residual = trial.dynamics.residual_root[trial.dynamics.used, :3]
    rms = float(np.sqrt((residual**2).sum(axis=1).mean()))
    assert rms < BOUND * fit.mass_kg * 9.80665
    again = resolve(fit, {}, settings)
    assert again.mass_kg == pytest.approx(fit.mass_kg, rel=1e-3)
