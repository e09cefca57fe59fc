"""The fit: a row of stages, its settings, and its results on disk."""
