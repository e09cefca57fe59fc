"""Markers whose labels mean nothing, found on the body by where they lie and what they move with."""
