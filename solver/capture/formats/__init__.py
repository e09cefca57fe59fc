"""Readers of the files that laboratories have."""
