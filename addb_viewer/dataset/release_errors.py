"""What a release is refused for."""

from solver.common.errors import SolverError


class ReleaseError(SolverError):
    """A release cannot be read, described or written as asked."""
