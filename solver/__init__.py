"""Markers and ground forces in, a skeleton that obeys F = ma out."""
