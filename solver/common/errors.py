"""Errors for people: every message names the file, the place in it, what is wrong, and what to do."""


class SolverError(Exception):
    """Base of everything that the command line reports as one clear line and exit status 1."""


class CaptureError(SolverError):
    """A measured file or a subject folder cannot be used as it is."""


class ModelError(SolverError):
    """A skeleton model cannot be read or lacks something that the fit needs."""


class FitError(SolverError):
    """The data cannot be fitted: no markers shared with the model, no usable frames, and the like."""


class SettingsError(SolverError):
    """A settings file names something that does not exist, or gives it a value of the wrong kind."""


class ResultsError(SolverError):
    """Saved results cannot be read back: half a copy, or written by another version."""


class Cancelled(SolverError):  # noqa: N818 (stopping is no error)
    """The user stopped the work; nothing was written."""
