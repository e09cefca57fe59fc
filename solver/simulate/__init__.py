"""Synthetic captures that obey F = ma exactly at the root."""
