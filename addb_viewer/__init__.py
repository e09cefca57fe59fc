"""Fit a skeleton that obeys F = ma to markers and force plates, and learn what is wrong with a recording.

    from addb_viewer import Subject

    subject = Subject.open("SUBJECT")             # or Subject.from_arrays(...)
    fit = subject.fit()
    fit["walk"].torques["knee_angle_r"]           # [N·m] over time

docs/reference/api.md is the page about it. Names are loaded when they are first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from addb_viewer.jobs.environment import check_own_packages

check_own_packages()

if TYPE_CHECKING:
    from addb_viewer.api.acceptance import Acceptance as Acceptance
    from addb_viewer.api.cycle_curves import CycleCurves as CycleCurves
    from addb_viewer.api.fitted_trial import FittedTrial as FittedTrial
    from addb_viewer.api.labelled import Series as Series
    from addb_viewer.api.labelled import Table as Table
    from addb_viewer.api.recording import Plate as Plate
    from addb_viewer.api.recording import Recording as Recording
    from addb_viewer.api.subject import Subject as Subject
    from addb_viewer.api.subject_diagnosis import Cause as Cause
    from addb_viewer.api.subject_diagnosis import Diagnosis as Diagnosis
    from addb_viewer.api.subject_fit import Fit as Fit
    from annotations.review_errors import ReviewError as ReviewError
    from solver.common.errors import Cancelled as Cancelled
    from solver.common.errors import SolverError as SolverError

_HOME = {
    "Acceptance": "addb_viewer.api.acceptance",
    "Cancelled": "solver.common.errors",
    "Cause": "addb_viewer.api.subject_diagnosis",
    "CycleCurves": "addb_viewer.api.cycle_curves",
    "Diagnosis": "addb_viewer.api.subject_diagnosis",
    "Fit": "addb_viewer.api.subject_fit",
    "FittedTrial": "addb_viewer.api.fitted_trial",
    "Plate": "addb_viewer.api.recording",
    "Recording": "addb_viewer.api.recording",
    "ReviewError": "annotations.review_errors",
    "Series": "addb_viewer.api.labelled",
    "SolverError": "solver.common.errors",
    "Subject": "addb_viewer.api.subject",
    "Table": "addb_viewer.api.labelled",
}

__all__ = [*_HOME, "__version__"]  # noqa: PLE0604 (names of the table above)


def __getattr__(name: str) -> Any:
    """Load a name of the interface, when it is first asked for."""
    if name == "__version__":
        return import_module("importlib.metadata").version("addb-viewer")
    if name not in _HOME:
        raise AttributeError(f"module 'addb_viewer' has no attribute '{name}'; it has {', '.join(__all__)}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return __all__
