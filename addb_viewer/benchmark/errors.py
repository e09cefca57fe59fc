"""What is wrong with a benchmark run, in one line."""

from solver.common.errors import SolverError


class BenchmarkError(SolverError):
    """A run that cannot be made, or whose figures would mean nothing."""
