"""Sentences that a person reads."""
