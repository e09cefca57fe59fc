"""The trajectory fit: one spline through all frames, markers and F = ma together."""
