"""The demo's walk, simulated once for all tests that only read it."""

from functools import cache

from addb_viewer import Subject


@cache
def demo_walk() -> Subject:
    """In a temporary folder, which lives as long as it does."""
    return Subject.demo()
