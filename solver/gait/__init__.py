"""Gait: when feet meet and leave the ground, the cycles between, and the figures of a walk or run."""
