"""Lanes and charts over time."""
