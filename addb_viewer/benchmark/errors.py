"""What is wrong with a benchmark run, in one line."""

from solver.errors import SolverError


class BenchmarkError(SolverError):
    """A run that cannot be made, or whose figures would mean nothing."""
