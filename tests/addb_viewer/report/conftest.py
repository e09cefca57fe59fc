"""Reports of the small fit that the recordings' tests know."""

import pytest

from addb_viewer.report.content import DiagnosisShown, SubjectReport
from solver.common.notes import Kind, Note
from tests.addb_viewer.recordings.conftest import analog, edits, make_fit, q, recording, skeleton
from tests.addb_viewer.recordings.conftest import diagnosis as one_cause
from tests.addb_viewer.synthetic_residual import residual, trial
from tests.addb_viewer.told_diagnosis import told

__all__ = ["analog", "edits", "make_fit", "one_cause", "q", "recording", "skeleton"]


@pytest.fixture
def diagnosis():
    """A late clock that accounts for everything, with the time history of the residual."""
    time_history = {"time_s": [0.1, 0.2, 0.3, 0.4]}
    for name in ("force_N", "force_after_N", "force_floor_N"):
        time_history[name] = [40.0, 50.0, 60.0, 40.0]
    for name in ("moment_Nm", "moment_after_Nm", "moment_floor_Nm"):
        time_history[name] = [4.0, 5.0, 6.0, 4.0]
    effect = {
        "id": "clock_offset",
        "target": "all",
        "parameters": {"offset_s": {"value": 0.012, "std": 0.001}},
        "confidence": 0.98,
        "trial": "walk",
        "frames": [[0, 40]],
        "sentence": "The forces were recorded <late>.",
        "remedy": "Check the trigger.",
        "time_histories": [],
    }
    return told(
        {
            "verdict": "explained",
            "effects": [effect],
            "alternatives": [],
            "gain": {"held_out_linear_residual_N": {"before": 41.0, "after": 12.0, "interval": [11.0, 13.0]}},
            "remaining": {"linear_residual_N": 12.0, "noise_floor_N": 10.0, "location": None},
            "trials": ["walk"],
            "rates_Hz": {"walk": 50.0},
            "notes": [Note(Kind.OTHER, "a note of the diagnosis").as_json()],
            "residual": residual(trial("walk", (2, 27), time_history)),
        }
    )


@pytest.fixture
def report(recording, diagnosis):
    """Of one trial, with a diagnosis."""
    return SubjectReport(recording, DiagnosisShown(diagnosis, ""))
