"""Measured data: files to SI units, y up, ground frame, and nothing that knows a skeleton."""
